"""Renders small scenes on a device, and what the camera sees in float64."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.bench.numerics.kernel_probe import choices
from clrt.bench.significance import mean_test
from clrt.device.open import Device
from clrt.rendering.accumulation.single_device import Session
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.rendering.film.film import Film
from clrt.scene.materials.material_types import Material
from clrt.scene.model import Camera, Mesh, Sampler, Scene


Doubles = NDArray[np.float64]


def session(device: Device, scene: Scene, sampler: Sampler = "independent", **chosen: Any) -> Session:
    """The scene with its own settings but for the sampler: statistics are those of independent samples.

    `chosen`: see Choices. Programs stay in memory from one to the next.
    """
    settings = replace(scene.render, sampler=sampler)
    return Session(device, compile_scene(replace(scene, render=settings), choices(device, **chosen)), settings.size,
                   settings.max_depth, settings.seed, settings.spp)


def film(device: Device, scene: Scene, spp: int | None = None, **chosen: Any) -> Film:
    """The scene's film after spp samples a pixel, or as many as its settings say; see `session`."""
    running = session(device, scene, **chosen)
    for _ in running.render(spp or scene.render.spp):
        pass
    return running.film()


def pixel_p_values(film: Film, expected: Doubles) -> Doubles:
    """(h, w, 3) p-values of the pixels' means, a dozen float32 roundings aside, against expected (h, w, 3)."""
    count = film.pixels["count"].astype(np.float64)[..., None]
    squares = (film.pixels["square"].astype(np.float64) + film.pixels["square_error"]) / count
    variance = np.maximum(squares - film.mean**2, 0) * count / (count - 1)
    return mean_test(film.mean, variance + count * (1e-6 * expected)**2, count, expected)


def view_rays(camera: Camera, size: tuple[int, int], x: Doubles, y: Doubles) -> Doubles:
    """(n, 3) directions, not of unit length, through picture points (x, y) in pixels from the upper left corner.

    The picture's right is cross(forward, up), and `fov_degrees` the full vertical angle.
    """
    forward, right, up, extent = frame(camera)
    a, b = (2 * x / size[0] - 1) * size[0] / size[1] * extent, (1 - 2 * y / size[1]) * extent
    return np.asarray(forward + a[..., None] * right + b[..., None] * up)


def frame(camera: Camera) -> tuple[Doubles, Doubles, Doubles, float]:
    """Unit forward, right and up, and the tangent of half the vertical angle."""
    forward = np.subtract(camera.look_at, camera.position)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, camera.up)
    right /= np.linalg.norm(right)
    return forward, right, np.cross(right, forward), float(np.tan(np.radians(camera.fov_degrees) / 2))


def pixel_points(camera: Camera, size: tuple[int, int], height: float, steps: int = 4) -> Doubles:
    """(h, w, steps², 3): the plane y = height seen at Gauss–Legendre points of each pixel (see pixel_means)."""
    nodes = (np.polynomial.legendre.leggauss(steps)[0] + 1) / 2
    x, y = np.meshgrid(np.add.outer(np.arange(size[0]), nodes).ravel(), np.add.outer(np.arange(size[1]), nodes).ravel())
    w = view_rays(camera, size, x, y)
    points = camera.position + (height - camera.position[1]) / w[..., 1:2] * w
    return points.reshape(size[1], steps, size[0], steps, 3).transpose(0, 2, 1, 3, 4).reshape(size[1], size[0], -1, 3)


def pixel_means(values: Doubles) -> Doubles:
    """(h, w, k): means over each pixel of values (h, w, steps², k) at pixel_points."""
    weights = np.polynomial.legendre.leggauss(int(np.sqrt(values.shape[2])))[1] / 2
    return np.asarray(np.einsum("hwsk,s->hwk", values, np.outer(weights, weights).ravel()))


def quad(corners: list[tuple[float, float, float]], material: Material) -> Mesh:
    """Four corners, counter-clockwise seen from the front."""
    return Mesh(np.array(corners, np.float32), np.array([[0, 1, 2], [0, 2, 3]], np.int32), material)


def box(half: float, material: Material) -> Mesh:
    """The cube [−half, half]³ whose front sides face inwards."""
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32) * np.float32(half)
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([side for a, b, c, d in sides for side in ((a, b, c), (a, c, d))], np.int32)
    triangles = corners[faces].astype(np.float64)
    outside = np.sum(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
                     * triangles.mean(axis=1), axis=1) > 0
    faces[outside] = faces[outside][:, ::-1]
    return Mesh(corners, faces, material)
