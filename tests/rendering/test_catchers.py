"""Catchers: shadows against closed forms, and images over a backdrop against the render of what is in them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clrt.device.open import Device
from clrt.errors import SceneError
from clrt.rendering.film.film import Film
from clrt.rendering.renderer import Renderer
from clrt.scene.lights import DirectionalLight
from clrt.scene.materials.material_types import Diffuse, Material, MetallicRoughness
from clrt.scene.materials.textures import Picture, Texture
from clrt.scene.model import Camera, Environment, Instance, Mesh, RenderSettings, Scene, Sphere
from clrt.scene.validation.validate import validate

from ..covering import others
from .pictures import Doubles, film

BLACK = Diffuse(color=(0.0, 0.0, 0.0))
GREY = Diffuse(color=(0.5, 0.5, 0.5))
#: Seen from straight above: x to the right, z downwards in the image.
ABOVE = Camera(position=(0.0, 9.0, 0.0), up=(0.0, 0.0, -1.0), projection="orthographic", view_height=4.0)
SIZE = (24, 16)
SKY = (0.25, 0.5, 1.5)
BALL = Sphere(center=(-0.4, 1.0, 0.1), radius=0.5, material=BLACK)
SUN = DirectionalLight(direction=(1.0, -1.0, 0.2), irradiance=(3.0, 3.0, 3.0))


def ground(material: Material, reach: float = 60.0, uv: bool = False) -> Mesh:
    """Return the plane y = 0 around the image, seen from above; uv: over the image."""
    x, z = (reach, reach) if not uv else (3.0, 2.0)
    corners = np.array([(-x, 0, -z), (-x, 0, z), (x, 0, z), (x, 0, -z)], np.float32)
    coordinates = np.array([(0, 0), (0, 1), (1, 1), (1, 0)], np.float32)
    return Mesh(corners, np.array([(0, 1, 2), (0, 2, 3)], np.int32), material, uv=coordinates if uv else None)


def caught(scene: Scene) -> Scene:
    """Return the scene with its ground as a catcher, on a transparent background."""
    mesh = replace(scene.meshes[0], material=replace(scene.meshes[0].material, catcher=True))
    return replace(scene, meshes=[mesh, *scene.meshes[1:]], render=replace(scene.render, transparent=True))


def on_ground(material: Material = GREY, **parts: Any) -> Scene:
    settings: dict[str, Any] = {"size": SIZE, "spp": 256, "max_depth": 4, **parts.pop("render", {})}
    made: dict[str, Any] = {"spheres": [BALL], "camera": ABOVE, **parts}
    return Scene(meshes=[ground(material)], render=RenderSettings(**settings), **made)


def places(count: int) -> tuple[Doubles, Doubles]:
    """Return x and z (h, w, count²) of a grid of points of the ground in each pixel."""
    inner = (np.arange(count) + 0.5) / count
    x = (np.arange(SIZE[0])[:, None] + inner).ravel() / SIZE[0] * 6 - 3
    z = (np.arange(SIZE[1])[:, None] + inner).ravel() / SIZE[1] * 4 - 2
    rows = [
        each.reshape(SIZE[1], count, SIZE[0], count).swapaxes(1, 2).reshape(*SIZE[::-1], -1)
        for each in np.meshgrid(x, z)
    ]
    return rows[0], rows[1]


def covered(found: Film) -> Doubles:
    assert found.alpha is not None
    return found.alpha


def test_hard_shadow_of_a_sphere(device: Device) -> None:
    """Alpha is the part of a pixel's area that the ball covers or shades, where the line to the sun meets it."""
    x, z = places(64)
    points = np.stack([x, np.zeros_like(x), z], axis=-1) - BALL.center
    towards = -np.array(SUN.direction) / np.linalg.norm(SUN.direction)
    distance = np.linalg.norm(points - (points @ towards)[..., None] * towards, axis=-1)
    ball = np.hypot(x - BALL.center[0], z - BALL.center[2]) < BALL.radius
    area = (ball | (distance < BALL.radius)).mean(axis=2)
    found = film(device, caught(on_ground(lights=[SUN], render={"spp": 1024})), sampler="sobol")
    shade = (distance < BALL.radius).mean(axis=2) * (ball.mean(axis=2) == 0)
    assert (shade == 1).sum() > 4 and ((shade > 0) & (shade < 1)).sum() > 10
    np.testing.assert_allclose(covered(found), area, atol=8e-3)
    np.testing.assert_array_equal(covered(found)[area == 0], 0)
    np.testing.assert_array_equal(found.mean, 0)


@pytest.mark.programs
def test_ambient_shadow_of_a_sphere(device: Device) -> None:
    """Below a constant sky, a black ball of radius r takes the fraction r²h/D³ of the light at a distance D from its
    center, at a height h."""
    scene = on_ground(environment=Environment(color=SKY), render={"spp": 4096})
    found = film(device, caught(scene), sampler="sobol")
    x, z = places(16)
    h, r = BALL.center[1], BALL.radius
    distance = np.sqrt((x - BALL.center[0]) ** 2 + (z - BALL.center[2]) ** 2 + h**2)
    shadow = (r**2 * h / distance**3).mean(axis=2)
    seen = np.hypot(x - BALL.center[0], z - BALL.center[2]).min(axis=2) > r
    assert seen.sum() > 300 and shadow[seen].max() > 0.1
    np.testing.assert_allclose(covered(found)[seen], shadow[seen], atol=6e-3)
    assert abs(np.mean(covered(found)[seen] - shadow[seen])) < 3e-4
    assert found.mean.max() < 0.02 * max(SKY)  # noise alone: all channels lose the same


@pytest.mark.parametrize(
    "material",
    [MetallicRoughness(color=(0.8, 0.7, 0.6), metallic=1.0, roughness=0.15), *others(GREY)],
    ids=["glossy", "matte"],
)
def test_over_the_bare_ground_it_is_the_whole_render(device: Device, material: Material) -> None:
    """Shadow, bounced light and reflection of a colored ball in colored light: over the render of the ground alone,
    catcher and ball are the render of both; as a backdrop, and composited by alpha."""
    ball = replace(BALL, center=(-0.4, 0.6, 0.1), material=Diffuse(color=(0.9, 0.2, 0.1)))
    environment = Environment(color=(0.6, 0.5, 0.9))
    scene = on_ground(material, spheres=[ball], lights=[SUN], environment=environment, render={"spp": 1024})
    below = replace(scene, spheres=[replace(ball, center=(0.0, -2.0, 0.0))])  # without another program for no spheres
    whole, alone = (film(device, each, sampler="sobol") for each in (scene, below))
    bare, found = alone.mean, film(device, caught(scene), sampler="sobol")
    assert np.abs(whole.mean - bare).max() > 0.3 and found.mean[covered(found) < 0.9].max() > 0.01
    noise = 1e-3 + 5 * np.sqrt(2 * whole.variance)
    by_alpha = found.mean + (1 - covered(found))[..., None] * bare
    for over in (by_alpha, Film(found.pixels, bare.astype(np.float32)).mean):
        assert np.mean(np.abs(over - whole.mean) < noise) > 0.99  # apart from rare bright samples
        assert np.abs(over - whole.mean).mean() < 2e-3


@pytest.mark.programs
def test_over_a_photo_it_is_the_render_of_the_photographed_ground(device: Device) -> None:
    """A photo of a colored ground in colored light, with the shadow of a black ball: to 1/255 what the ground with the
    ball is, whatever the catcher's own color."""
    rng = np.random.default_rng(2)
    texels = np.full((8, 12, 4), 255, np.uint8)
    texels[..., :3] = rng.integers(40, 250, (8, 12, 3))
    paint = Diffuse(color=Texture(picture=Picture(texels, "photo"), filter="nearest"))
    lit: dict[str, Any] = {"lights": [SUN], "environment": Environment(color=SKY), "render": {"spp": 1024}}
    real = replace(on_ground(**lit), meshes=[ground(paint, uv=True)])
    photo, whole = (film(device, each, sampler="sobol").mean for each in (replace(real, spheres=[]), real))
    found = film(device, caught(replace(on_ground(**lit), meshes=[ground(GREY, uv=True)])), sampler="sobol")
    over = Film(found.pixels, photo.astype(np.float32)).mean
    assert np.abs(photo - whole).max() > 0.3
    np.testing.assert_allclose(over, whole, rtol=0.02, atol=2 / 255)
    assert np.abs(over - whole).mean() < 0.25 / 255


def test_catchers_light_each_other(device: Device) -> None:
    """A wall behind the ground and no object: nothing is changed, so nothing is in the image."""
    corners = np.array([(-3, 0, -1), (3, 0, -1), (3, 2, -1), (-3, 2, -1)], np.float32)
    wall = Mesh(corners, np.array([(0, 1, 2), (0, 2, 3)], np.int32), replace(GREY, catcher=True))
    scene = caught(on_ground(spheres=[], lights=[SUN], environment=Environment(color=SKY), render={"spp": 16}))
    found = film(device, replace(scene, meshes=[*scene.meshes, wall]))
    assert found.pixels["catcher"].min() == 16
    np.testing.assert_array_equal(covered(found), 0)
    np.testing.assert_array_equal(found.mean, 0)


def test_lamps_are_there_without_the_objects(device: Device) -> None:
    """An emissive ball lights the ground before and after; an object dims it."""
    lamp = Sphere(center=(1.5, 1.5, 0.0), radius=0.2, material=Diffuse(emission=(9.0, 9.0, 9.0), camera_visible=False))
    alone = film(device, caught(on_ground(spheres=[lamp])))
    np.testing.assert_array_equal(covered(alone), 0)
    both = film(device, caught(on_ground(spheres=[lamp, BALL])))
    assert 0.9 < covered(both)[:, : SIZE[0] // 2].max() and covered(both)[:, -3:].max() < 0.1


def test_instances_are_objects_and_may_be_catchers(device: Device) -> None:
    """An instanced plate casts the shadow of a plate; an instanced ground catches it."""
    plate = ground(BLACK, reach=0.5)
    up = np.eye(3, 4)
    up[:, 3] = -0.4, 1.0, 0.1
    scene = caught(on_ground(spheres=[], lights=[SUN], render={"spp": 64}))
    mesh = replace(scene, meshes=[*scene.meshes, replace(plate, vertices=plate.vertices + up[:, 3].astype(np.float32))])
    instance = replace(scene, instances=[Instance(plate, up, name=str(i)) for i in range(1)])
    moved = replace(instance, meshes=[], instances=[*instance.instances, Instance(scene.meshes[0])])
    expected = covered(film(device, mesh, sampler="sobol"))
    assert expected.max() == 1 and 0.03 < expected.mean() < 0.2
    for other in (instance, moved):
        np.testing.assert_allclose(covered(film(device, other, sampler="sobol")), expected, atol=0.02)


@pytest.mark.combinations
def test_catchers_in_checkpoints_and_on_several_devices(device: Device, tmp_path: Path) -> None:
    """Two workers, and a render resumed from a checkpoint, give the film of one, to the last bit."""
    scene = caught(on_ground(lights=[SUN], environment=Environment(color=SKY), render={"spp": 16}))
    whole, pair = (Renderer(scene, device=[device.info.index] * count) for count in (1, 2))
    for renderer in (whole, pair):
        for _ in renderer.passes():
            pass
    for stop_after in (2, 16):
        resumed = Renderer(scene, device=device.info.index, checkpoint=tmp_path / "film", resume=True)
        for state in resumed.passes():
            if state.spp >= stop_after:
                break
    one, two, three = (renderer.session.film().pixels for renderer in (whole, pair, resumed))
    assert one["bare"].max() > 0
    np.testing.assert_array_equal(one, two)
    np.testing.assert_array_equal(one, three)


def test_what_catchers_do_not_support() -> None:
    scene = caught(on_ground())
    validate(scene)
    for integrator in ("local", "raster"):
        with pytest.raises(SceneError, match=f'"{integrator}" does not support catchers.*write "path"'):
            replace(scene, camera=Camera(), render=replace(scene.render, integrator=integrator))
    for wrong, fault in (
        ({"emission": (1.0, 1.0, 1.0)}, "this one emits"),
        ({"camera_visible": False}, "must be seen"),
    ):
        with pytest.raises(SceneError, match=rf"Diffuse.catcher: .*{fault}"):
            Diffuse(catcher=True, **wrong)
