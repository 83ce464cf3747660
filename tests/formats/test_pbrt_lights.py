"""pbrt's lights and spectra, against closed forms."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

import clrt
from clrt.formats.pbrt.equal_area import direction_of, looked_up, square_of
from clrt.output.images import write_image
from clrt.scene.lights import DirectionalLight, PointLight, SpotLight

from ..covering import covering
from .pbrt_files import UPRIGHT, radiance, scene


@pytest.mark.parametrize(
    ("light", "irradiance"),
    [
        ('LightSource "point" "rgb I" [8 4 2] "point3 from" [0 2 0]', (2, 1, 0.5)),
        ('LightSource "point" "float power" 100 "point3 from" [0 2 0]', (100 / (16 * np.pi),) * 3),
        ('LightSource "distant" "rgb L" [3 3 3] "point3 from" [0 1 0] "point3 to" [0 0 0]', (3, 3, 3)),
        ('LightSource "distant" "rgb L" [2 1 1] "float illuminance" 5 "point3 from" [1 1 0] "point3 to" [0 0 0]', None),
        ('LightSource "infinite" "rgb L" [2 3 4] "float scale" 0.5', (np.pi, 1.5 * np.pi, 2 * np.pi)),
        ('LightSource "infinite" "float illuminance" 7', (7, 7, 7)),
        (
            'LightSource "spot" "rgb I" [8 8 8] "point3 from" [0 2 0] "point3 to" [0 0 0] "float conedeltaangle" 0.001',
            (2, 2, 2),
        ),
    ],
)
def test_lights_illuminate_by_closed_forms(folder: Path, light: str, irradiance: Any) -> None:
    """Diffuse reflection is ρE/π; E = I/d² and the like."""
    expected = np.array((2, 1, 1)) * 5 / np.sqrt(2) if irradiance is None else np.array(irradiance)
    np.testing.assert_allclose(radiance(folder, light), 0.5 / np.pi * expected, rtol=2e-3)


@pytest.mark.programs
def test_a_spherical_light_of_a_power_illuminates_like_a_point(folder: Path) -> None:
    """Φ/(4πd²) on a plane that faces it, whatever its radius, also if it is scaled."""
    black = 'Material "diffuse" "rgb reflectance" [0 0 0]'
    for size in (0.5, 2.0):
        light = f"""AttributeBegin Translate 0 4 0 Scale {size} {size} {size} {black}
        AreaLightSource "diffuse" "float power" 500 Shape "sphere" "float radius" .5 AttributeEnd"""
        np.testing.assert_allclose(radiance(folder, light), 0.5 / np.pi * 500 / (4 * np.pi * 16), rtol=1e-2)


@pytest.mark.programs
def test_a_closed_furnace(folder: Path) -> None:
    """In an emissive sphere that reflects half of it, radiance doubles."""
    world = """Material "diffuse" "rgb reflectance" [.5 .5 .5] AreaLightSource "diffuse" "rgb L" [.5 .5 .5]
    ReverseOrientation Shape "sphere" "float radius" 3"""
    before = 'Integrator "path" "integer maxdepth" 40 Film "rgb" "integer xresolution" 8 "integer yresolution" 8\n'
    image = clrt.render(scene(folder, world, before), spp=64).pixels
    np.testing.assert_allclose(image.mean((0, 1)), 1, rtol=1e-2)


def chromaticity(folder: Path, parameter: str) -> tuple[float, float]:
    """x and y of an emission, whose luminance must be 1."""
    color = scene(folder, f'LightSource "infinite" {parameter}').environment.color
    matrix = np.array([(0.412391, 0.357584, 0.180481), (0.212639, 0.715169, 0.072192), (0.019331, 0.119195, 0.950532)])
    xyz = matrix @ color
    assert xyz[1] == pytest.approx(1, abs=2e-3)
    return xyz[0] / xyz.sum(), xyz[1] / xyz.sum()


@pytest.mark.parametrize(
    ("parameter", "x", "y"),
    [
        ('"blackbody L" 2856', 0.44757, 0.40745),
        ('"blackbody L" 6504', 0.31352, 0.32363),
        ('"blackbody L" 10000', 0.28063, 0.28828),
        ('"spectrum L" "stdillum-A"', 0.44757, 0.40745),
        ('"spectrum L" "stdillum-D65"', 0.3127, 0.3290),
        ('"spectrum L" [200 3 900 3]', 1 / 3, 1 / 3),
        ('"rgb L" [1 1 1]', 0.3127, 0.3290),
    ],
)
def test_emission_has_the_spectrums_chromaticity(folder: Path, parameter: str, x: float, y: float) -> None:
    """Of black bodies as CIE 15 and Planck's law give it, and luminance 1 whatever the values, as in pbrt-v4."""
    assert chromaticity(folder, parameter) == pytest.approx((x, y), abs=1e-3)


def test_emission_of_v3_has_the_values_that_are_written(folder: Path) -> None:
    end = "\nWorldEnd"
    white = scene(folder, f'LightSource "infinite" "spectrum L" [400 3 700 3]{end}').environment.color
    assert 0.212639 * white[0] + 0.715169 * white[1] + 0.072192 * white[2] == pytest.approx(3, rel=1e-3)
    scaled = scene(folder, f'LightSource "infinite" "blackbody L" [6500 4] "rgb scale" [.5 1 2]{end}').environment.color
    plain = scene(folder, f'LightSource "infinite" "blackbody L" [6500 1]{end}').environment.color
    np.testing.assert_allclose(scaled, np.multiply(plain, (2, 4, 8)), rtol=1e-9)


@settings(max_examples=300, deadline=None)
@given(st.floats(0, 1), st.floats(0, 1))
def test_the_equal_area_map_is_its_inverses_inverse(u: float, v: float) -> None:
    square = np.array([[u, v]])
    direction = direction_of(square)
    assert np.linalg.norm(direction) == pytest.approx(1)
    np.testing.assert_allclose(direction_of(square_of(direction)), direction, atol=1e-7)


def test_the_equal_area_map_is_a_concentric_map_of_lamberts_disk() -> None:
    """Each hemisphere is Lambert's azimuthal equal-area disk, of radius √(1 − |z|), by Shirley and Chiu's concentric
    map on a square turned by 45°; that of −z is folded outward over its edges."""
    rng = np.random.default_rng(2)
    directions = rng.normal(size=(500, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for (x, y, z), (u, v) in zip(directions, 2 * square_of(directions) - 1):
        radius, angle = np.sqrt(1 - abs(z)), np.arctan2(y, x)
        turned = (angle - np.pi / 4 + np.pi) % (2 * np.pi) - np.pi  # the edge |u| + |v| = 1 of this quadrant is upright
        quarter = np.round(turned / (np.pi / 2))
        along = 4 / np.pi * (turned - quarter * np.pi / 2) * radius  # Shirley and Chiu: a = r, b = 4rφ/π
        middle = quarter * np.pi / 2 + np.pi / 4
        out = radius if z >= 0 else 2 - radius
        across = np.array([-np.sin(middle), np.cos(middle)])
        expected = (out * np.array([np.cos(middle), np.sin(middle)]) + along * across) / np.sqrt(2)
        np.testing.assert_allclose((u, v), expected, atol=1e-9)


def test_a_square_map_is_interpolated_over_its_edges() -> None:
    """A smooth function of the direction to a few pixels' error, everywhere."""
    size = 128
    rows, columns = np.divmod(np.arange(size * size), size)
    at = direction_of(np.column_stack([(columns + 0.5) / size, (rows + 0.5) / size]))
    image = np.repeat((at @ (0.3, -0.5, 0.8))[:, None], 3, axis=1).reshape(size, size, 3).astype(np.float32)
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(3000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    np.testing.assert_allclose(looked_up(image, directions)[:, 0], directions @ (0.3, -0.5, 0.8), atol=0.02)


@covering("square, mirrored", [True, False], [True, False])
def test_an_environment_map_lies_where_its_transformation_says(folder: Path, square: bool, mirrored: bool) -> None:
    """A bright spot, in light space at a known direction, is in clrt's map where the camera's image shows it."""
    towards = np.array([0.6, 0.48, 0.64])
    if square:
        shape, (u, v) = (64, 64), square_of(towards[None])[0]
    else:
        shape, u, v = (64, 128), np.arctan2(0.48, 0.6) / (2 * np.pi), np.arccos(0.64) / np.pi
    image = np.full((*shape, 3), 0.1, np.float32)
    image[int(v * shape[0]), int(u * shape[1])] = 1000
    write_image(folder / "sky.exr", image)
    before = UPRIGHT if mirrored else 'Camera "perspective"\n'
    world = 'Rotate 40 1 2 3\nLightSource "infinite" "string filename" "sky.exr"'
    sky = scene(folder, world, before).environment
    assert sky.image is not None and sky.rotation_degrees == 0
    height, width = sky.image.shape[:2]
    bright = sky.image[..., 0] > 100
    rows, columns = np.nonzero(bright)
    theta, phi = np.pi * (rows.mean() + 0.5) / height, 2 * np.pi * (columns.mean() + 0.5) / width
    found = np.array([np.sin(theta) * np.sin(phi), np.cos(theta), -np.sin(theta) * np.cos(phi)])
    axis = np.array([1, 2, 3]) / np.sqrt(14)
    expected = Rotation.from_rotvec(np.radians(40) * axis).apply(towards) * (1 if mirrored else -1, 1, 1)
    assert found @ expected > np.cos(np.radians(2))


def test_v3s_map_about_y_is_used_as_it_is(folder: Path) -> None:
    """Its zenith is +z in light space; turned upright it needs no resampling."""
    image = np.random.default_rng(0).random((8, 16, 3), np.float32)
    write_image(folder / "sky.exr", image)
    world = 'Rotate -90 1 0 0\nLightSource "infinite" "string mapname" "sky.exr" "rgb L" [2 2 2]'
    sky = scene(folder, world, 'Camera "perspective"').environment
    assert sky.image is not None and sky.strength == 2
    # Its first column is towards +x, here −x since the world is mirrored: −z turned by 90° about y.
    assert sky.rotation_degrees == pytest.approx(90)
    np.testing.assert_allclose(sky.image, image)


def test_infinite_lights_add_up(folder: Path) -> None:
    two = 'LightSource "infinite" "rgb L" [1 2 3]\nLightSource "infinite" "rgb L" [1 1 1]'
    assert scene(folder, two).environment.color == (2, 3, 4)


def test_spot_lights_and_points_are_moved(folder: Path) -> None:
    world = """Translate 1 2 3 Scale 2 2 2 LightSource "point" "point3 from" [1 0 0]
    LightSource "spot" "point3 from" [0 0 0] "point3 to" [0 -1 0] "float coneangle" 40
    LightSource "distant" "point3 from" [0 1 0] "point3 to" [0 0 0]"""
    point, spot, sun = scene(folder, world).lights
    assert isinstance(point, PointLight) and point.position == pytest.approx((3, 2, 3))
    assert isinstance(spot, SpotLight) and (spot.inner_degrees, spot.outer_degrees) == (35, 40)
    assert spot.direction == pytest.approx((0, -2, 0))
    assert isinstance(sun, DirectionalLight) and sun.direction == pytest.approx((0, -2, 0))
