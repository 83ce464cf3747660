"""Images of lights: intensities over directions as the scene format describes, closed forms, and where they compile."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.kernel_probe import Probe
from clrt.device.open import Device
from clrt.errors import SceneError
from clrt.formats.load_scene import load
from clrt.formats.scene_parts.texture_images import LUMINANCE
from clrt.output.images import write_image
from clrt.rendering.compile.choices import Choices
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.scene.geometry.transform import transform_light
from clrt.scene.light_images import LightImage
from clrt.scene.lights import GoniometricLight, Light, PointLight, ProjectorLight, SpotLight
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Camera, RenderSettings, Scene

from ..covering import others
from ..oracle.lights import arriving as facing
from .pictures import film, pixel_points, quad

Doubles = NDArray[np.float64]
KINDS: list[type[SpotLight | ProjectorLight | GoniometricLight]] = [SpotLight, ProjectorLight, GoniometricLight]
UP = np.array([0.0, 1.0, 0.0])


def arriving(device: Device, light: Light, points: Doubles) -> Doubles:
    """Return the irradiance (n, 3) of surfaces that face the light at points (n, 3)."""
    normals = np.tile(UP, (len(points), 1))
    return Probe(device, Scene(lights=[light]))("light_sample", 12, points, normals, seed=1)[:, 3:6]


def random_light(kind: type[Any], rng: np.random.Generator, **given: Any) -> Any:
    """Return a light with a random image, mapped somehow."""
    image = LightImage(
        pixels=rng.uniform(0, 3, (*rng.integers(1, 7, 2).tolist(), 3)).astype(np.float32),
        scale=(rng.uniform(-2, 2), rng.uniform(-2, 2)),
        offset=(rng.uniform(-1, 1), rng.uniform(-1, 1)),
        rotation_degrees=rng.uniform(-180, 180),
        wrap=((None, ("repeat", "mirror"), ("clamp", "repeat"), ("mirror", "clamp"))[rng.integers(4)]),
        filter=("linear", "nearest")[rng.integers(2)],
    )
    position, direction, up = rng.normal(size=(3, 3)).tolist()
    values = {"position": position, "direction": direction, "up": up, "intensity": rng.uniform(1, 9, 3), "image": image}
    return kind(**values, **given)


@pytest.mark.parametrize("count", [8, *others(24)])
@pytest.mark.parametrize("kind", KINDS)
def test_images_are_seen_from_the_light(device: Device, kind: type[Any], count: int) -> None:
    """At random points, with all mappings, angles and falloffs; under transforms, which may mirror, the light moves
    with the points."""
    rng = np.random.default_rng(KINDS.index(kind))
    for number in range(count):
        given: dict[str, Any] = {}
        if kind is SpotLight:
            outer = rng.uniform(5, 80)
            given = {"outer_degrees": outer, "inner_degrees": outer / 2, "falloff": ("cosine", "angle")[number % 2]}
        elif kind is ProjectorLight:
            given = {"fov_degrees": rng.uniform(5, 120), "image_of": ("irradiance", "intensity")[number % 2]}
        light = random_light(kind, rng, **given)
        forward = np.array(light.direction) / np.linalg.norm(light.direction)
        aside = rng.uniform(-1, 1, (300, 3)) * (9.0 if kind is GoniometricLight else rng.uniform(0, 1, (300, 1)))
        points = light.position + (forward + aside) * rng.uniform(0.5, 3, (300, 1))
        points = points.astype(np.float32).astype(np.float64)
        right = facing(light, points)[2]
        found = arriving(device, light, points)
        assert np.count_nonzero(right.any(axis=1)) > 10
        np.testing.assert_allclose(found, right, rtol=2e-4, atol=2e-5 * right.max())
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.normal(size=3)
        moved = points @ matrix[:3, :3].T + matrix[:3, 3]
        np.testing.assert_allclose(
            arriving(device, transform_light(light, matrix), moved), right, rtol=5e-4, atol=5e-5 * right.max()
        )


@pytest.mark.parametrize("kind", KINDS)
def test_the_top_left_pixel_is_at_the_top_left(device: Device, kind: type[Any]) -> None:
    """A light at the eye: along −z with y up, the image's right is +x."""
    pixels = np.array([[(1, 0, 0), (0, 1, 0)], [(0, 0, 1), (1, 1, 1)]], np.float32)
    image = LightImage(pixels=pixels, filter="nearest")
    light = kind(position=(0, 0, 0), direction=(0, 0, -1), intensity=(1, 1, 1), image=image)
    left_top, right_top, left_low, right_low = np.sign(
        arriving(device, light, np.array([(-0.2, 0.2, -1), (0.2, 0.2, -1), (-0.2, -0.2, -1), (0.2, -0.2, -1)]))
    ).tolist()
    assert (left_top, right_top, left_low, right_low) == ([1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1])


@pytest.mark.parametrize("integrator", ["raster", *others("path", "direct", "local")])
def test_a_screen_is_evenly_lit(device: Device, integrator: Any) -> None:
    """A white projector gives a white screen at the distance z the irradiance intensity/z², in a rectangle of the
    image's shape, and nothing around it; with an object between, its shadow."""
    z, fov, aspect = 2.0, 60.0, 3
    image = LightImage(pixels=np.ones((1, aspect, 3), np.float32))
    light = ProjectorLight(
        position=(0, z, 0), direction=(0, -1, 0), up=(0, 0, -1), intensity=(8, 4, 2), image=image, fov_degrees=fov
    )
    floor = quad([(-9, 0, 9), (9, 0, 9), (9, 0, -9), (-9, 0, -9)], Diffuse(color=(1.0, 1.0, 1.0)))
    camera = Camera(position=(0, 5, 0), look_at=(0, 0, 0), up=(0, 0, -1), fov_degrees=90)
    settings = RenderSettings(size=(33, 21), max_depth=2, integrator=integrator)
    lit = Scene(meshes=[floor], lights=[light], camera=camera, render=settings)
    picture = film(device, lit, 1).mean
    places, half = pixel_points(camera, settings.size, 0.0, 8), z * np.tan(np.radians(fov / 2))
    shown = (np.abs(places[..., 0]) < aspect * half) & (np.abs(places[..., 2]) < half)
    inside, outside = shown.all(axis=2), ~shown.any(axis=2)
    assert inside.sum() > 20 and outside.sum() > 20
    np.testing.assert_allclose(picture[inside], np.tile(np.divide([2, 1, 0.5], np.pi), (inside.sum(), 1)), rtol=1e-5)
    assert not picture[outside].any()
    lid = quad([(-9, 1, 9), (9, 1, 9), (9, 1, -9), (-9, 1, -9)], Diffuse(color=(0.0, 0.0, 0.0)))
    assert not film(device, replace(lit, meshes=[floor, lid]), 1).mean.any()


def test_the_power_is_that_of_the_image(device: Device) -> None:
    """Of a goniometric light by its pixels' solid angles, as nearest texels; of a projector by their areas on a screen
    at the distance 1, on which it is the irradiance."""
    rng = np.random.default_rng(3)
    pixels = rng.uniform(0, 2, (8, 12, 3)).astype(np.float32)
    image, intensity = LightImage(pixels=pixels, filter="nearest"), np.array([3.0, 2.0, 1.0])
    around = GoniometricLight(position=(0, 0, 0), intensity=(3, 2, 1), image=image)
    rows, columns = 800, 1200
    theta, phi = np.pi * (np.arange(rows) + 0.5) / rows, 2 * np.pi * (np.arange(columns) + 0.5) / columns
    sine, cosine = np.sin(theta)[:, None], np.repeat(np.cos(theta)[:, None], columns, axis=1)
    directions = np.stack([sine * np.cos(phi), cosine, sine * np.sin(phi)], axis=-1).reshape(-1, 3)
    weight = np.repeat(sine.ravel(), columns) * 2 * np.pi**2 / (rows * columns)
    power = (arriving(device, around, directions) * weight[:, None]).sum(axis=0)
    edges = np.cos(np.pi * np.arange(9) / 8)
    solid = (edges[:-1] - edges[1:]) * 2 * np.pi / 12
    np.testing.assert_allclose(power, intensity * np.einsum("hwc,h->c", pixels, solid), rtol=1e-3)
    thrown = ProjectorLight(position=(0, 0, 0), direction=(0, 0, 1), intensity=(3, 2, 1), image=image, fov_degrees=100)
    high = np.tan(np.radians(50))
    across = ((np.arange(600) + 0.5) / 300 - 1) * high * 1.5
    down = ((np.arange(400) + 0.5) / 200 - 1) * high
    screen = np.stack([*np.meshgrid(across, down), np.ones((400, 600))], axis=-1).reshape(-1, 3)
    cosine = 1 / np.linalg.norm(screen, axis=1)
    flux = (arriving(device, thrown, screen) * cosine[:, None]).mean(axis=0) * 4 * 1.5 * high**2
    np.testing.assert_allclose(flux, intensity * pixels.mean(axis=(0, 1)) * 6 * high**2, rtol=1e-3)


def test_bounds_have_the_image(device: Device) -> None:
    """Equal spots of which one has a darker image are chosen in proportion to the root mean squares."""
    dim = LightImage(pixels=np.full((2, 2, 3), 0.25, np.float32))
    uneven = LightImage(pixels=np.array([[[0.0] * 3], [[1.0] * 3], [[0.0] * 3], [[0.0] * 3]], np.float32))
    light = ProjectorLight(position=(0, 1, 0), direction=(0, -1, 0), up=(0, 0, -1), intensity=(1, 1, 1), image=dim)
    lights: list[Light] = [light, replace(light, image=uneven), replace(light, image=None)]
    probe = Probe(device, Scene(lights=lights))
    chances = [probe("light_probability", 1, [[0, 0, 0]], [[0, 1, 0]], [[i]])[0, 0] for i in range(3)]
    share = np.array([0.25, 0.5, 1.0]) / 1.75
    np.testing.assert_allclose(chances, 0.8 * share + 0.2 / 3, rtol=1e-5)


def test_black_images_are_no_lights(device: Device) -> None:
    black = LightImage(pixels=np.zeros((2, 3, 3), np.float32))
    light = ProjectorLight(position=(0, 1, 0), direction=(0, -1, 0), up=(0, 0, -1), intensity=(1, 1, 1), image=black)
    assert light.is_black and not replace(light, image=None).is_black
    assert "LIGHTS" not in compile_scene(Scene(lights=[light]), Choices()).features


def test_only_scenes_with_images_compile_them(device: Device) -> None:
    """Images that are used twice are stored once; lights without one add nothing."""
    image = LightImage(pixels=np.ones((5, 7, 3), np.float32))
    spot = SpotLight(position=(0, 1, 0), direction=(0, -1, 0.1), intensity=(1, 1, 1))
    plain = compile_scene(Scene(lights=[spot, PointLight(position=(0, 1, 0), intensity=(1, 1, 1))]), Choices())
    assert not {"light/image.cl", "core/bilinear.cl", "light/spot_image.cl"} & set(plain.files)
    assert not {"light_images", "light_texels"} & set(plain.buffers)
    shown = replace(spot, image=image)
    twice = [spot, shown, replace(shown, image=replace(image)), replace(shown, image=image.mirrored())]
    both = compile_scene(Scene(lights=list(twice)), Choices())
    assert {"light/image.cl", "light/spot.cl", "light/spot_image.cl"} <= set(both.files)
    assert len(both.buffers["light_images"][1]) == 2 and len(both.buffers["light_texels"][1]) == 35


def test_scene_files(tmp_path: Path) -> None:
    """The image is a file name, or a table with the keys of textures; 8 bits are decoded from sRGB."""
    write_image(tmp_path / "slide.exr", np.full((2, 3, 3), 7.0, np.float32))
    write_image(tmp_path / "slide.png", np.full((2, 3, 3), 0.25, np.float32))
    common = (
        'type = "projector"\nposition = [0, 3, 0]\ndirection = [0, -1, 0]\nup = [0, 0, -1]\nintensity = [1, 1, 1]\n'
    )
    table = '{ image = "slide.png", scale = 2, wrap = "mirror", filter = "nearest", rotation_degrees = 30 }'
    text = f'[[light]]\n{common}image = "slide.exr"\n[[light]]\n{common}image = {table}\n'
    (tmp_path / "a.toml").write_text(text)
    plain, placed = (light.image for light in load(tmp_path / "a.toml").lights if isinstance(light, ProjectorLight))
    assert plain is not None and placed is not None
    assert (plain.pixels == 7).all() and plain.wrap is None and plain.name == "slide.exr"
    np.testing.assert_allclose(placed.pixels @ LUMINANCE, 0.25, atol=2e-3)
    assert (placed.scale, placed.wrap, placed.filter, placed.rotation_degrees) == (
        (2, 2),
        ("mirror", "mirror"),
        "nearest",
        30,
    )


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('image = "no.png"', "light[0].image: "),
        ("image = 3", "light[0].image: 3 is not a string"),
        ('image = { image = "no.png" }', "light[0].image.image: "),
        ('image = { image = "slide.png", factor = 2 }', 'light[0].image: key "factor" is unknown'),
        ('image = { image = "slide.png", wrap = "around" }', 'light[0].image.wrap[0]: "around" is unknown'),
        ('image = "slide.png"\nup = [0, 0, 3]', "light[0].up: is parallel to the direction"),
        ('image = "slide.png"\nimage_of = "light"', 'light[0].image_of: "light" is unknown'),
        ("fov_degrees = 180", "light[0].fov_degrees: 180 is not below 180"),
        ('image = "negative.exr"', "light[0].image.pixels: 1 pixels are negative, the first in row 0, column 1"),
    ],
)
def test_mistakes_are_named(tmp_path: Path, line: str, said: str) -> None:
    write_image(tmp_path / "slide.png", np.full((2, 3, 3), 0.25, np.float32))
    negative = np.zeros((1, 2, 3), np.float32)
    negative[0, 1, 2] = -1
    write_image(tmp_path / "negative.exr", negative)
    common = '[[light]]\ntype = "projector"\nposition = [0, 3, 0]\ndirection = [0, 0, -1]\nintensity = [1, 1, 1]\n'
    (tmp_path / "a.toml").write_text(f"{common}{line}\n")
    with pytest.raises(SceneError) as error:
        load(tmp_path / "a.toml")
    assert said in str(error.value), error.value


def test_arrays_are_not_images() -> None:
    """Python callers who give an array are told what to write; floats of 64 bits are converted."""
    given: Any = {"position": (0, 1, 0), "direction": (0, 0, 1), "intensity": (1, 1, 1)}
    array: Any = np.ones((2, 2, 3), np.float32)
    with pytest.raises(SceneError, match="^ProjectorLight.image: .*write a clrt.LightImage$"):
        ProjectorLight(image=array, **given)
    assert LightImage(pixels=np.ones((2, 2, 3))).pixels.dtype == np.float32  # type: ignore[arg-type]
