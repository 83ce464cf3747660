"""Helpers that render small scenes on a device, and the camera's view rays in float64."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.bench.kernel_probe import choices
from clrt.bench.significance import mean_test
from clrt.device.open import Device
from clrt.rendering.accumulation.launch_plan import LaunchPlan
from clrt.rendering.accumulation.single_device import SingleDeviceAccumulation
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.rendering.film.film import Film
from clrt.scene.materials.material_types import Material
from clrt.scene.model import Camera, Mesh, Scene
from clrt.scene.render_settings import Sampler

Doubles = NDArray[np.float64]


def session(device: Device, scene: Scene, sampler: Sampler = "independent", **chosen: Any) -> SingleDeviceAccumulation:
    """Return a session of the scene with its own settings except for the sampler: the tests assume independent samples.

    `chosen`: see Choices. Compiled programs are shared between sessions.
    """
    settings = replace(scene.render, sampler=sampler)
    compiled = compile_scene(replace(scene, render=settings), choices(device, **chosen))
    return SingleDeviceAccumulation(device, compiled, LaunchPlan.of(settings, settings.spp))


def film(device: Device, scene: Scene, spp: int | None = None, **chosen: Any) -> Film:
    """Return the scene's film after spp samples per pixel (default: its settings' spp); see `session`."""
    running = session(device, scene, **chosen)
    for _ in running.render(spp or scene.render.spp):
        pass
    return running.film()


def pixel_p_values(film: Film, expected: Doubles) -> Doubles:
    """Return the p-values (h, w, 3) of the pixel means against expected (h, w, 3), allowing a dozen float32
    roundings."""
    count = film.pixels["count"].astype(np.float64)[..., None]
    squares = (film.pixels["square"].astype(np.float64) + film.pixels["square_error"]) / count
    variance = np.maximum(squares - film.mean**2, 0) * count / (count - 1)
    return mean_test(film.mean, variance + count * (1e-6 * expected) ** 2, count, expected)


def view_rays(camera: Camera, size: tuple[int, int], x: Doubles, y: Doubles) -> Doubles:
    """Return directions (n, 3), not normalized, through image points (x, y) in pixels from the upper left corner.

    The image's right is cross(forward, up), and `fov_degrees` the full vertical angle.
    """
    forward, right, up, extent = frame(camera)
    a, b = (2 * x / size[0] - 1) * size[0] / size[1] * extent, (1 - 2 * y / size[1]) * extent
    return np.asarray(forward + a[..., None] * right + b[..., None] * up)


def frame(camera: Camera) -> tuple[Doubles, Doubles, Doubles, float]:
    """Return unit forward, right and up, and the tangent of half the vertical angle."""
    forward = np.subtract(camera.look_at, camera.position)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, camera.up)
    right /= np.linalg.norm(right)
    return forward, right, np.cross(right, forward), float(np.tan(np.radians(camera.fov_degrees) / 2))


def pixel_points(camera: Camera, size: tuple[int, int], height: float, steps: int = 4) -> Doubles:
    """Return the points (h, w, steps², 3) of the plane y = height at Gauss–Legendre nodes of
    each pixel (see pixel_means).
    """
    nodes = (np.polynomial.legendre.leggauss(steps)[0] + 1) / 2
    x, y = np.meshgrid(np.add.outer(np.arange(size[0]), nodes).ravel(), np.add.outer(np.arange(size[1]), nodes).ravel())
    w = view_rays(camera, size, x, y)
    points = camera.position + (height - camera.position[1]) / w[..., 1:2] * w
    return points.reshape(size[1], steps, size[0], steps, 3).transpose(0, 2, 1, 3, 4).reshape(size[1], size[0], -1, 3)


def pixel_means(values: Doubles) -> Doubles:
    """Return the means (h, w, k) over each pixel of values (h, w, steps², k) at pixel_points."""
    weights = np.polynomial.legendre.leggauss(int(np.sqrt(values.shape[2])))[1] / 2
    return np.asarray(np.einsum("hwsk,s->hwk", values, np.outer(weights, weights).ravel()))


def quad(corners: list[tuple[float, float, float]], material: Material) -> Mesh:
    """Return a quad of four corners, counter-clockwise seen from the front."""
    return Mesh(np.array(corners, np.float32), np.array([[0, 1, 2], [0, 2, 3]], np.int32), material)


def box(half: float, material: Material) -> Mesh:
    """Return the cube [−half, half]³ with its front faces inwards."""
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32) * np.float32(half)
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([side for a, b, c, d in sides for side in ((a, b, c), (a, c, d))], np.int32)
    triangles = corners[faces].astype(np.float64)
    outside = (
        np.sum(
            np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]) * triangles.mean(axis=1),
            axis=1,
        )
        > 0
    )
    faces[outside] = faces[outside][:, ::-1]
    return Mesh(corners, faces, material)
