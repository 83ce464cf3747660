"""Lights of USD files: power and irradiance by closed forms, and the orientation of dome lights."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.formats.load_scene import load
from clrt.formats.usd.reader import read_usd
from clrt.output.images import write_image
from clrt.scene.lights import DirectionalLight, PointLight, SpotLight
from clrt.scene.materials.textures import Texture
from clrt.scene.model import Mesh

from .test_usd import area, facing
from .usd_files import mesh, usda

pytestmark = pytest.mark.needs("pxr")


def lit(kind: str, content: str, api: str = "") -> str:
    """Return a light."""
    return f'def {kind} "lamp" {api}\n{{{content}}}\n' + mesh()


def radiance(emitter: Mesh) -> NDArray[np.float64]:
    return np.array(emitter.material.radiance)


def test_strength(tmp_path: Path) -> None:
    """Radiance is intensity · 2^exposure · color."""
    content = "float inputs:intensity = 3\nfloat inputs:exposure = 2\ncolor3f inputs:color = (1, 0.5, 0)"
    (emitter,) = read_usd(usda(tmp_path, lit("SphereLight", content))).emitters
    np.testing.assert_allclose(radiance(emitter), [12, 6, 0])


AREAS = {
    "SphereLight": ("float inputs:radius = 2", 16 * math.pi),
    "DiskLight": ("float inputs:radius = 2", 4 * math.pi),
    "RectLight": ("float inputs:width = 2\nfloat inputs:height = 3", 6.0),
}


@pytest.mark.parametrize("kind", AREAS)
def test_normalized_lights_keep_their_power(tmp_path: Path, kind: str) -> None:
    """Radiance times area, in the stage's unit, is the intensity, at any scale; flat lights emit along −Z."""
    content, expected = AREAS[kind]
    scaled = 'double3 xformOp:scale = (3, 3, 3)\nuniform token[] xformOpOrder = ["xformOp:scale"]\n'
    for transform, factor in (("", 1), (scaled, 9)):
        text = f"{content}\nfloat inputs:intensity = 5\n{transform}"
        (plain,) = read_usd(usda(tmp_path, lit(kind, text))).emitters
        (even,) = read_usd(usda(tmp_path, lit(kind, text + "\nbool inputs:normalize = 1"))).emitters
        assert area(plain) == pytest.approx(expected * factor, rel=5e-3)
        np.testing.assert_allclose(radiance(plain), 5)
        np.testing.assert_allclose(radiance(even) * area(even), 5, rtol=1e-6)
        (small,) = read_usd(usda(tmp_path, lit(kind, text + "\nbool inputs:normalize = 1"), meters=0.01)).emitters
        np.testing.assert_allclose(radiance(small), radiance(even), rtol=1e-5)
        if kind != "SphereLight":
            np.testing.assert_allclose(facing(plain), [0, 0, -area(plain)], atol=1e-6)


def test_points_and_spots(tmp_path: Path) -> None:
    """A sphere's radiant intensity is its radiance times the area of its disc, in meters."""
    content = "float inputs:intensity = 8\nfloat inputs:radius = 50\n"
    shaping = '(prepend apiSchemas = ["ShapingAPI"])'
    cone = "float inputs:shaping:cone:angle = 30\nfloat inputs:shaping:cone:softness = 0.5\n"
    point = read_usd(usda(tmp_path, lit("SphereLight", content + "bool treatAsPoint = 1"), meters=0.01)).lights
    spot = read_usd(usda(tmp_path, lit("SphereLight", content + cone, shaping), meters=0.01)).lights
    expected = pytest.approx((8 * math.pi * 0.25,) * 3)
    assert isinstance(point[0], PointLight) and point[0].intensity == expected
    assert isinstance(spot[0], SpotLight) and spot[0].intensity == expected
    assert (spot[0].direction, spot[0].outer_degrees, spot[0].inner_degrees) == ((0, 0, -1), 30, 15)
    even = read_usd(
        usda(tmp_path, lit("SphereLight", content + "bool treatAsPoint = 1\nbool inputs:normalize = 1"))
    ).lights
    assert isinstance(even[0], PointLight) and even[0].intensity == (2, 2, 2)  # L = I/(4πr²), over a disc of πr²


@pytest.mark.parametrize(
    ("content", "irradiance"),
    [
        ("float inputs:angle = 60", 4 * math.pi * math.sin(math.radians(30)) ** 2),
        ("float inputs:angle = 60\nbool inputs:normalize = 1", 4),
        ("float inputs:angle = 0", 4),
    ],
)
def test_distant_lights(tmp_path: Path, content: str, irradiance: float) -> None:
    """A disc of constant radiance L has an irradiance of π L sin² of half its angle."""
    turned = 'float xformOp:rotateX = -90\nuniform token[] xformOpOrder = ["xformOp:rotateX"]\n'
    path = usda(tmp_path, lit("DistantLight", f"float inputs:intensity = 4\n{content}\n{turned}"))
    (light,) = read_usd(path).lights
    assert isinstance(light, DirectionalLight) and light.irradiance == pytest.approx((irradiance,) * 3)
    np.testing.assert_allclose(light.direction, [0, -1, 0], atol=1e-6)
    assert load(path).lights == [light]


def test_emitters_belong_to_the_lights(tmp_path: Path) -> None:
    """A bare model has its own lights instead of the sun; in a scene file only with `lights = true`; the camera frames
    the model alone."""
    far = 'double3 xformOp:translate = (0, 99, 0)\nuniform token[] xformOpOrder = ["xformOp:translate"]\n'
    usda(tmp_path, lit("RectLight", far))
    bare = load(tmp_path / "a.usda")
    assert [each.name for each in bare.meshes] == ["square", "lamp"] and not bare.lights
    assert bare.camera == load(usda(tmp_path, mesh(), name="b.usda")).camera
    for keys, expected in (("", ["square"]), ("lights = true\n", ["square", "lamp"])):
        (tmp_path / "a.toml").write_text(f'[[mesh]]\nfile = "a.usda"\n{keys}')
        assert [each.name for each in load(tmp_path / "a.toml").meshes] == expected


def test_rectangle_textures(tmp_path: Path) -> None:
    """Seen along +Z, from where it emits, the image is upright, and its left is at +X."""
    write_image(tmp_path / "a.png", np.ones((2, 2, 3), np.float32))
    (emitter,) = read_usd(usda(tmp_path, lit("RectLight", "asset inputs:texture:file = @a.png@"))).emitters
    assert isinstance(emitter.material.emission, Texture) and emitter.uv is not None
    x, y = emitter.vertices[:, 0], emitter.vertices[:, 1]
    np.testing.assert_allclose(emitter.uv, np.column_stack([0.5 - x, 0.5 - y]))


def direction_image(folder: Path) -> NDArray[np.float32]:
    """Write a latlong image whose color is the direction it stands for: OpenEXR's has +Z in the middle, +X left."""
    longitude = math.pi - (np.arange(64) + 0.5) * 2 * math.pi / 64
    latitude = math.pi / 2 - (np.arange(32)[:, None] + 0.5) * math.pi / 32
    x, y, z = (
        np.sin(longitude) * np.cos(latitude),
        np.sin(latitude) + 0 * longitude,
        np.cos(longitude) * np.cos(latitude),
    )
    image = np.asarray(np.stack([x, y, z], axis=2) + 1, np.float32)
    write_image(folder / "dome.exr", image)
    return image


@pytest.mark.parametrize("up", ["Y", "Z"])
@pytest.mark.parametrize(
    "turn", ["", 'float xformOp:rotateX = 90\nuniform token[] xformOpOrder = ["xformOp:rotateX"]\n']
)
def test_dome_lights(tmp_path: Path, up: str, turn: str) -> None:
    """A direction of the scene shows the image's color of that direction in the dome's own axes."""
    direction_image(tmp_path)
    content = f"asset inputs:texture:file = @dome.exr@\nfloat inputs:intensity = 2\n{turn}"
    scene = load(usda(tmp_path, lit("DomeLight", content), up=up))
    image = scene.environment.image
    assert image is not None and not scene.lights
    rows, columns = np.mgrid[:32, :64]
    polar, azimuth = (rows + 0.5) * math.pi / 32, (columns + 0.5) * 2 * math.pi / 64
    x, y, z = np.sin(azimuth) * np.sin(polar), np.cos(polar), -np.cos(azimuth) * np.sin(polar)  # of Environment
    world = np.stack([x, -z, y] if up == "Z" else [x, y, z], axis=2)  # in the stage's axes
    own = np.stack([world[..., 0], world[..., 2], -world[..., 1]], axis=2) if turn else world
    np.testing.assert_allclose(image / 2 - 1, own, atol=0.01)


def test_domes_turned_about_the_vertical_are_not_resampled(tmp_path: Path) -> None:
    stored = direction_image(tmp_path)
    turn = 'float xformOp:rotateY = 30\nuniform token[] xformOpOrder = ["xformOp:rotateY"]\n'
    environment = load(usda(tmp_path, lit("DomeLight", f"asset inputs:texture:file = @dome.exr@\n{turn}"))).environment
    assert environment.image is not None and environment.rotation_degrees == pytest.approx(30)
    still = load(usda(tmp_path, lit("DomeLight", "asset inputs:texture:file = @dome.exr@"))).environment
    np.testing.assert_array_equal(environment.image, still.image)
    np.testing.assert_allclose(np.sort(environment.image, axis=None), np.sort(stored, axis=None), rtol=1e-3)


def test_constant_domes(tmp_path: Path) -> None:
    scene = load(usda(tmp_path, lit("DomeLight", "color3f inputs:color = (1, 2, 3)")))
    assert scene.environment.image is None and scene.environment.color == (1, 2, 3)
