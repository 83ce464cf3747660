"""Calibrated cameras: points lie where K·[R|t] projects them, in rays and in rendered images."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.device.open import Device
from clrt.errors import SceneError, UsageError
from clrt.rendering.compile.camera_kernel import launch_record
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Camera, RenderSettings, Scene, Sphere

from ..covering import others
from .pictures import film

Doubles = NDArray[np.float64]
SIZE = (64, 48)


def calibrated(rng: np.random.Generator) -> tuple[Doubles, Doubles]:
    """Return K (3, 3) and a pose from world to camera (4, 4), by OpenCV's convention."""
    fx, fy = rng.uniform(20, 120, 2)
    K = np.array([[fx, rng.uniform(-5, 5), rng.uniform(10, 54)], [0, fy, rng.uniform(10, 38)], [0, 0, 1]])
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    pose = np.eye(4)
    pose[:3, :3] = turn * np.sign(np.linalg.det(turn))
    pose[:3, 3] = rng.normal(size=3) * 3
    return K, pose


def visible(K: Doubles, pose: Doubles, pixels: Doubles, depth: Doubles) -> Doubles:
    """Return the points (n, 3) in the world that project to the pixels (n, 2) at these depths."""
    rays = np.linalg.solve(K, np.column_stack([pixels, np.ones(len(pixels))]).T).T
    return np.asarray((rays * depth[:, None] - pose[:3, 3]) @ pose[:3, :3])


def test_rays_go_through_what_projects_to_their_pixel() -> None:
    """2000 random cameras, 25 pixels each: the direction of a ray in float32, against float64."""
    rng, (width, height) = np.random.default_rng(5), SIZE
    worst = 0.0
    for _ in range(2000):
        K, pose = calibrated(rng)
        pixels = rng.uniform((0, 0), SIZE, (25, 2))
        record = launch_record(Camera.from_matrix(K, SIZE, world_to_camera=pose), SIZE)[0]
        right, up, forward, eye = (
            np.asarray(record[name], np.float64) for name in ("right", "up", "forward", "position")
        )
        sx, sy = 2 * pixels[:, :1] / width - 1, 2 * pixels[:, 1:] / height - 1
        rays = sx * right - sy * up + forward
        wanted = visible(K, pose, pixels, np.full(25, 7.0)) - eye
        rays, wanted = (each / np.linalg.norm(each, axis=1, keepdims=True) for each in (rays, wanted))
        worst = max(worst, np.abs(rays - wanted).max())
    assert worst < 1e-6


@pytest.mark.parametrize(
    "lens", [{}, *others({"aperture_radius": 0.05, "focus_distance": 9.0})], ids=["pinhole", "lens"]
)
def test_spheres_are_seen_where_they_project(device: Device, lens: dict[str, Any]) -> None:
    """Spheres smaller than a pixel, at pixel centers; with a lens in its plane of focus, whatever the shift."""
    rng = np.random.default_rng(7)
    for _ in range(3):
        K, pose = calibrated(rng)
        pixels = np.unique(rng.integers((1, 1), (63, 47), (6, 2)), axis=0)
        depth = rng.uniform(5, 15, len(pixels)).astype(np.float64)
        if lens:
            depth[:] = 9.0
        centers = visible(K, pose, (pixels + 0.5).astype(np.float64), depth)
        spheres = [
            Sphere(center=tuple(center), radius=0.12 * z / K.diagonal().max(), material=Diffuse(emission=(1.0, i, 0.0)))
            for i, (center, z) in enumerate(zip(centers.tolist(), depth.tolist()), start=1)
        ]
        camera = Camera.from_matrix(K, SIZE, world_to_camera=pose, **lens)
        scene = Scene(spheres=spheres, camera=camera, render=RenderSettings(size=SIZE, spp=256, max_depth=1))
        picture = film(device, scene).mean
        assert sorted(map(tuple, np.argwhere(picture[..., 0]))) == sorted((y, x) for x, y in pixels.tolist())
        found = picture[pixels[:, 1], pixels[:, 0]]
        np.testing.assert_allclose(found[:, 1] / found[:, 0], np.arange(1, len(pixels) + 1), rtol=1e-6)


def test_depth_is_along_the_optical_axis(device: Device) -> None:
    """A sphere around the optical axis at a depth of 8, seen with a shifted lens: its depth is that of its points."""
    camera = Camera(position=(0.0, 0.0, 0.0), look_at=(0.0, 0.0, -1.0), lens_shift=(0.3, -0.2))
    plane = Sphere(center=(0.0, 0.0, -1e4), radius=1e4 - 8)
    settings = RenderSettings(size=SIZE, spp=1, integrator="depth")
    depth = film(device, Scene(spheres=[plane], camera=camera, render=settings)).mean[..., 0]
    np.testing.assert_allclose(depth, 8.0, atol=3e-3)


def test_matrices_come_back() -> None:
    rng = np.random.default_rng(9)
    flip = np.diag([1.0, -1.0, -1.0, 1.0])
    for _ in range(200):
        K, pose = calibrated(rng)
        for first in (0.0, 0.5):
            camera = Camera.from_matrix(K, SIZE, world_to_camera=pose, first_pixel=first)
            np.testing.assert_allclose(camera.matrix(SIZE, first), K, atol=1e-10)
        np.testing.assert_allclose(camera.world_to_camera, pose, atol=1e-10)
        other = Camera.from_matrix(K, SIZE, camera_to_world=np.linalg.inv(pose) @ flip, convention="opengl")
        np.testing.assert_allclose(other.world_to_camera, pose, atol=1e-10)
        half = (SIZE[0] // 2, SIZE[1] // 2)
        np.testing.assert_allclose(camera.matrix(half), np.diag([0.5, 0.5, 1]) @ K, atol=1e-10)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"K": np.eye(4)}, "K is"),
        ({"K": [[1, 0, 0], [0, 1, 0], [0, 0, 2]]}, "K is"),
        ({"K": [[1, 0, 0], [0, -1, 0], [0, 0, 1]]}, "focal lengths 1 and -1"),
        ({"K": [[np.nan, 0, 0], [0, 1, 0], [0, 0, 1]]}, "must be finite"),
        ({"world_to_camera": np.eye(3)}, "has the shape"),
        ({"world_to_camera": 2 * np.eye(4)[:3]}, "must be a rotation"),
        ({"world_to_camera": np.diag([1.0, 1.0, -1.0, 1.0])}, "must be a rotation"),
        ({"camera_to_world": np.eye(4)}, "give one pose"),
        ({"convention": "opngl"}, "is unknown; choose from opencv, opengl"),
    ],
)
def test_wrong_matrices(changes: dict[str, Any], message: str) -> None:
    given: dict[str, Any] = {"K": np.diag([50.0, 50.0, 1.0]), "size": SIZE, "world_to_camera": np.eye(4)}
    given |= changes
    with pytest.raises(UsageError, match=message):
        Camera.from_matrix(**given)


@pytest.mark.parametrize("given", [{"lens_shift": (0.1, 0.0)}, {"skew": 0.1}])
def test_the_rasterizer_needs_a_centered_lens(given: dict[str, Any]) -> None:
    with pytest.raises(SceneError, match=f"supports only pinhole cameras, and the camera has {next(iter(given))} = "):
        Scene(spheres=[Sphere()], camera=Camera(**given), render=RenderSettings(integrator="raster"))
