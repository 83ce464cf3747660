"""Integrators without light: depth, normals and albedo of the first hit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.api import render
from clrt.device.open import Device
from clrt.errors import UsageError
from clrt.output.images import read_image
from clrt.rendering.accumulation.denoiser_guides import render_guides
from clrt.scene.materials.material_types import Diffuse, MetallicRoughness, Mirror
from clrt.scene.model import Camera, RenderSettings, Scene, Sphere
from clrt.scene.render_settings import Integrator

from ..covering import others
from .pictures import film, frame, quad, session, view_rays
from .test_camera import CAMERAS, seen_at
from .test_variants import everything

Doubles = NDArray[np.float64]
RED, BALL = Diffuse(color=(0.7, 0.2, 0.1)), (0.2, -0.1, 0.0)
SIZE = (20, 14)


def ball(integrator: Integrator, camera: Camera, spp: int = 4, unit: float = 1.0) -> Scene:
    """Return a scene with a sphere of radius 1.3 at BALL."""
    center = tuple((unit * np.array(BALL)).tolist())
    return Scene(
        spheres=[Sphere(center=center, radius=1.3 * unit, material=RED)],
        camera=camera,
        render=RenderSettings(size=SIZE, spp=spp, integrator=integrator),
    )


def met(origin: Doubles, w: Doubles) -> Doubles:
    """Return the distance to the sphere along unit directions (n, 3), NaN for a miss, (n,)."""
    d = np.array(BALL) - origin
    along = np.sum(d * w, axis=-1)
    with np.errstate(invalid="ignore"):
        t = along - np.sqrt(1.3**2 - np.sum(d * d, axis=-1) + along**2)
    return np.where(t > 0, t, np.nan)


@pytest.mark.programs
@pytest.mark.parametrize("name", ["rolled", "lens", "parallel", "all around"])
@pytest.mark.parametrize("unit", [1.0, 2.0**-30])
def test_depth_of_a_ball(device: Device, name: str, unit: float) -> None:
    """Depth along the view for the ray through the pixel's and the lens's centre; the distance if equirectangular."""
    camera = replace(CAMERAS[name], look_at=BALL, position=(-2.0, 1.0, 2.0))
    x, y = (grid.ravel() for grid in np.meshgrid(np.arange(SIZE[0]) + 0.5, np.arange(SIZE[1]) + 0.5))
    near, far = (seen_at(camera, SIZE, x, y, np.full(len(x), depth))[0] for depth in (1.0, 2.0))
    w = (far - near) / np.linalg.norm(far - near, axis=1, keepdims=True)
    start = near - w if camera.projection == "equirectangular" else near - w / (w @ frame(camera)[0])[:, None]
    expected = met(start, w) * (1.0 if camera.projection == "equirectangular" else w @ frame(camera)[0])
    position, look_at = (tuple((unit * np.array(place)).tolist()) for place in (camera.position, camera.look_at))
    camera = replace(
        camera,
        position=position,
        look_at=look_at,
        aperture_radius=camera.aperture_radius * unit,
        focus_distance=camera.focus_distance and camera.focus_distance * unit,
        view_height=camera.view_height and camera.view_height * unit,
    )
    found = film(device, ball("depth", camera, unit=unit)).mean / unit
    assert 5 <= np.isfinite(expected).sum() < len(expected)
    np.testing.assert_allclose(found, np.nan_to_num(expected).reshape(*SIZE[::-1], 1) * np.ones(3), rtol=2e-6)


def test_normals_of_a_ball(device: Device) -> None:
    """Means over pixels equal those over the centres of 64 x 64 cells of each."""
    camera = Camera(position=(3.0, 2.0, 4.0), look_at=BALL, fov_degrees=30)
    x, y = np.meshgrid((np.arange(64 * SIZE[0]) + 0.5) / 64, (np.arange(64 * SIZE[1]) + 0.5) / 64)
    w = view_rays(camera, SIZE, x, y)
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    normals = (np.array(camera.position) + met(np.array(camera.position), w)[..., None] * w - BALL) / 1.3
    expected = np.nan_to_num(normals).reshape(SIZE[1], 64, SIZE[0], 64, 3).mean(axis=(1, 3))
    found = film(device, ball("normals", camera, 4096), sampler="sobol").mean
    np.testing.assert_allclose(found, expected, atol=5e-3)


def test_albedo_is_the_materials_own(device: Device) -> None:
    """Also for mirrors; normals are those of the visible side. A wall of the other material is behind."""
    camera = Camera(position=(0.0, 0.0, 3.0), fov_degrees=20)
    materials = {RED: (0.7, 0.2, 0.1), Mirror(color=(0.5, 0.6, 0.7)): (0.5, 0.6, 0.7)}
    for (material, color), other in zip(materials.items(), reversed(materials)):
        walls = [
            quad([(-9, -9, z), (-9, 9, z), (9, 9, z), (9, -9, z)], each)  # seen from behind
            for z, each in ((0, material), (-1, other))
        ]
        for integrator, expected in (("albedo", color), ("normals", (0.0, 0.0, 1.0)), ("depth", (3.0, 3.0, 3.0))):
            settings = RenderSettings(size=(5, 3), spp=2, integrator=integrator)  # type: ignore[arg-type]
            picture = film(device, Scene(meshes=walls, camera=camera, render=settings)).mean
            np.testing.assert_allclose(picture, np.broadcast_to(expected, picture.shape), rtol=1e-6, atol=1e-7)


@pytest.mark.programs
def test_what_is_clear_is_not_seen(device: Device) -> None:
    """A one-sided wall from behind and one of opacity 0 are not seen in front of another wall."""
    walls = [
        quad([(-9, -9, z), (9, -9, z), (9, 9, z), (-9, 9, z)], replace(RED, **clear))
        for z, clear in ((-1.0, {}), (0.0, {"opacity": 0.0}), (1.0, {"one_sided": True}))
    ]
    walls[2] = replace(walls[2], faces=np.ascontiguousarray(walls[2].faces[:, ::-1]))
    for integrator, expected in (("normals", (0.0, 0.0, 1.0)), ("depth", (4.0, 4.0, 4.0))):
        settings = RenderSettings(size=(5, 3), spp=2, integrator=integrator)  # type: ignore[arg-type]
        scene = Scene(meshes=walls, camera=Camera(position=(0.0, 0.0, 3.0), fov_degrees=20), render=settings)
        picture = film(device, scene).mean
        np.testing.assert_allclose(picture, np.broadcast_to(expected, picture.shape), rtol=1e-5, atol=1e-7)


@pytest.mark.combinations
def test_pictures_are_what_guides_are(device: Device) -> None:
    """They agree sample by sample if there are no mirrors or glass to follow."""
    scene = replace(everything(), spheres=[Sphere(center=(-1.0, 0.7, 0.5), radius=0.7, material=MetallicRoughness())])
    scene = replace(scene, environment=Scene().environment)
    for integrator, guide in (("normals", "normal"), ("albedo", "albedo")):
        settings = replace(scene.render, spp=16, integrator=integrator)  # type: ignore[arg-type]
        running = session(device, replace(scene, render=settings), "sobol")
        for _ in running.render(16):
            pass
        np.testing.assert_allclose(render_guides(running, 16)[guide], running.film().mean, atol=1e-6)


@pytest.mark.programs
@pytest.mark.parametrize("integrator", ["albedo", *others("normals", "depth")])
def test_no_light_is_compiled_or_missed(
    device: Device, integrator: Integrator, caplog: pytest.LogCaptureFixture
) -> None:
    """No warning about darkness, no light code, no black pixels; SIMD widths agree."""
    scene = replace(everything(), render=replace(everything().render, integrator=integrator))
    compiled = session(device, scene).compiled
    assert not [file for file in compiled.files if file.startswith("light") or file == "integrator/path_segment.cl"]
    pictures = [film(device, scene, lanes=lanes).mean for lanes in (1, 8)]
    differs = np.any(np.abs(pictures[0] - pictures[1]) > 1e-5 * (np.abs(pictures[1]) + 0.1), axis=2)
    assert np.mean(differs) < 1e-3
    image = render(Scene(), integrator=integrator, size=(8, 8), spp=2, device=device.info.index)
    assert not image.pixels.any() and not caplog.records and image.report["integrator"] == integrator


@pytest.mark.programs
def test_png_files_are_for_eyes_and_exr_files_for_numbers(device: Device, tmp_path: Path) -> None:
    """PNG shows normals as ½ + ½n and depth as nearest/depth, for any view. A miss is black."""
    camera = Camera(position=(0.0, 0.0, 3.0), fov_degrees=20)
    half = quad([(-9, -9, 0), (0, -9, 0), (0, 9, 0), (-9, 9, 0)], RED)
    step = quad([(-9, 0, 1.5), (0, 0, 1.5), (0, 9, 1.5), (-9, 9, 1.5)], RED)
    scene = Scene(meshes=[half, step], camera=camera)
    expected = {"normals": ((128, 128, 255), (128, 128, 255)), "depth": ((255, 255, 255), (128, 128, 128))}
    values = {"normals": ((0, 0, 1), (0, 0, 1)), "depth": ((1.5, 1.5, 1.5), (3, 3, 3))}
    for integrator in ("normals", "depth"):
        image = render(scene, integrator=integrator, size=(4, 4), spp=1, device=device.info.index)
        for suffix, left in ((".png", expected), (".exr", values)):
            path = image.save(tmp_path / f"{integrator}{suffix}", view="reinhard", exposure=2.0)
            pixels = iio.imread(path) if suffix == ".png" else read_image(path)
            np.testing.assert_allclose(pixels[:2, :2], np.broadcast_to(left[integrator][0], (2, 2, 3)), rtol=1e-6)
            np.testing.assert_allclose(pixels[2:, :2], np.broadcast_to(left[integrator][1], (2, 2, 3)), rtol=1e-6)
            assert not pixels[:, 2:].any()


def test_only_colours_are_denoised(device: Device) -> None:
    with pytest.raises(UsageError, match="denoising is for colour images, and the integrator is normals"):
        render(Scene(), integrator="normals", size=(8, 8), spp=1, denoise=True, device=device.info.index)
