"""pbrt's cameras and film, beside the left-handed camera of its description."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import clrt

from .pbrt_files import radiance, scene


def seen_at(camera: Any, point: Any) -> tuple[float, float]:
    """Where a clrt camera shows a point: to the right and up from the middle, in tangents."""
    position, forward = np.array(camera.position), np.subtract(camera.look_at, camera.position)
    right = np.cross(forward, camera.up)
    upward = np.cross(right, forward)
    x, y, z = ((np.array(point) - position) @ axis / np.linalg.norm(axis) for axis in (right, upward, forward))
    return x / z, y / z


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10**6), st.booleans())
def test_a_point_is_seen_where_the_left_handed_camera_sees_it(tmp_path_factory: Any, seed: int, mirrored: bool) -> None:
    """x, y and z in the camera's coordinates, to the right, up and forward, are CTM · point."""
    rng = np.random.default_rng(seed)
    eye, target, up, point = rng.normal(size=(4, 3))
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(up, forward)
    right /= np.linalg.norm(right)
    x, y, z = (point - eye) @ np.array([right, np.cross(forward, right), forward]).T
    before = ("Scale -1 1 1\n" if mirrored else "") + f"LookAt {' '.join(map(str, [*eye, *target, *up]))}\n"
    before += 'Camera "perspective"\n'
    world = f'Translate {" ".join(map(str, point))}\nShape "sphere" "float radius" 0.1'
    read = scene(tmp_path_factory.mktemp("seen"), world, before)
    expected = (-x if mirrored else x) / z, y / z
    np.testing.assert_allclose(seen_at(read.camera, read.spheres[0].center), expected, rtol=1e-6, atol=1e-6)


def test_an_image_is_not_mirrored(folder: Path) -> None:
    """A light at +x is on the right, at +y above, for a camera at the origin that looks along +z."""
    before = 'Film "rgb" "integer xresolution" 32 "integer yresolution" 16 Camera "perspective" "float fov" 60\n'
    light = 'AreaLightSource "diffuse"\nTranslate 1 0.3 4\nShape "sphere" "float radius" 0.4'
    image = clrt.render(scene(folder, light, before), spp=4).pixels[..., 0]
    rows, columns = np.nonzero(image > 0.5)
    assert columns.min() >= 16 and rows.max() < 8


def test_cameras(folder: Path) -> None:
    """fov is along the shorter side; a screen window and the film's shape change the height."""
    film = 'Film "rgb" "integer xresolution" {} "integer yresolution" {}\n'
    wide = scene(folder, "", film.format(300, 200) + 'Camera "perspective" "float fov" 60').camera
    assert wide.fov_degrees == pytest.approx(60)
    high = scene(folder, "", film.format(200, 300) + 'Camera "perspective" "float fov" 60').camera
    assert np.tan(np.radians(high.fov_degrees / 2)) == pytest.approx(1.5 * np.tan(np.radians(30)))
    text = 'Camera "perspective" "float fov" 90 "float screenwindow" [-1.5 1.5 -1 1]'
    assert scene(folder, "", film.format(300, 200) + text).camera.fov_degrees == pytest.approx(90)
    lens = 'Scale 2 2 2 Camera "perspective" "float lensradius" 0.5 "float focaldistance" 8'
    camera = scene(folder, "", film.format(200, 200) + lens).camera
    assert camera.aperture_radius == pytest.approx(0.25) and camera.focus_distance == pytest.approx(4)
    flat = scene(folder, "", film.format(300, 200) + 'Camera "orthographic" "float screenwindow" [-3 3 -2 2]').camera
    assert flat.projection == "orthographic" and flat.view_height == pytest.approx(4)
    settings_ = scene(folder, "", 'Sampler "halton" "integer pixelsamples" 32 Integrator "path" "integer maxdepth" 1')
    assert settings_.render.spp == 32 and settings_.render.max_depth == 2


def test_a_spherical_camera_sees_longitude_from_left_to_right(folder: Path) -> None:
    """The ray of column u and row v: (sin πv cos 2πu, cos πv, sin πv sin 2πu), in the camera's coordinates."""
    before = 'Film "rgb" "integer xresolution" 64 "integer yresolution" 32\n'
    before += 'Camera "spherical" "string mapping" "equirectangular"\n'
    for u, v in ((0.1, 0.4), (0.3, 0.6), (0.55, 0.5), (0.9, 0.3)):
        direction = np.array([np.sin(np.pi * v) * np.cos(2 * np.pi * u), np.cos(np.pi * v), 0])
        direction[2] = np.sin(np.pi * v) * np.sin(2 * np.pi * u)
        place = " ".join(map(str, 4 * direction))
        world = f'AreaLightSource "diffuse"\nTranslate {place}\nShape "sphere" "float radius" 0.4'
        image = clrt.render(scene(folder, world, before), spp=4).pixels[..., 0]
        row, column = np.argwhere(image > 0.5).mean(0)
        assert column == pytest.approx(64 * u - 0.5, abs=0.7) and row == pytest.approx(32 * v - 0.5, abs=0.7)


def test_the_film_scales_light(folder: Path) -> None:
    """By ISO/100 and the shutter's seconds."""
    light = 'LightSource "infinite" "rgb L" [1 1 1]'
    np.testing.assert_allclose(radiance(folder, light, '"float iso" 250'), 1.25, rtol=2e-3)
    before = 'Film "rgb" "float iso" 400 Camera "perspective" "float shutterclose" 0.5'
    assert scene(folder, light, before).environment.color == pytest.approx((2, 2, 2))
