"""Scenes and rays for traversal benchmarks: closed rooms, so that every ray hits something, and four kinds of rays.

Everything is numpy and seeded; the hits that secondary rays start from come from a function argument.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .ray_speed import Floats, Rays

Doubles = NDArray[np.float64]
Faces = NDArray[np.int32]
Mesh = tuple[Floats, Faces]
#: From origins, directions and t_max to the records of `RayQuery.closest_hit`.
Tracer = Callable[[Floats, Floats, Floats], NDArray[Any]]
#: Offset of ray origins from a surface, and of shadow rays' ends from the light, relative to the scene's extent.
GAP = 1e-5
FOV_DEGREES = 45.0
#: From the center of the mesh, in units of its largest extent; both inside its room.
CAMERA = np.array([0.6, 0.4, 1.3])
LIGHT = np.array([0.6, 1.2, 0.4])


class Workload(NamedTuple):
    """Rays of one kind. any_hit: whether they query any hit, or the closest hit."""

    name: str
    any_hit: bool
    rays: Rays


def bumpy_ball(subdivisions: int = 7) -> Mesh:
    """Return a sphere with waves of 12·4^subdivisions triangles (196 608): a box, subdivided and projected."""
    mesh = _box(np.zeros(3), 1.0)
    for _ in range(subdivisions):
        mesh = subdivide(*mesh)
    directions = mesh[0] / np.linalg.norm(mesh[0], axis=1, keepdims=True)
    radii = 1 + 0.08 * np.sin(9 * directions).prod(axis=1) + 0.02 * np.sin(40 * directions).sum(axis=1) / 3
    return (radii[:, None] * directions).astype(np.float32), mesh[1]


def closed_room(vertices: Floats, faces: Faces) -> Mesh:
    """Return the mesh centered in a cube of 12 triangles, whose half edge is 1.5 times the mesh's largest extent."""
    center, extent = _frame(vertices)
    return joined([(vertices, faces), _box(center, 1.5 * extent)])


def subdivide(vertices: Floats, faces: Faces) -> Mesh:
    """Split each triangle into four coplanar ones at its edges' midpoints; shared vertices stay shared."""
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1).astype(np.int64)
    keys, middle = np.unique(edges[:, 0] * len(vertices) + edges[:, 1], return_inverse=True)
    middles = (vertices[keys // len(vertices)] + vertices[keys % len(vertices)]) / 2
    (a, b, c), (ab, bc, ca) = faces.T, (len(vertices) + middle.reshape(-1, 3).astype(np.int32)).T
    corners = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return (
        np.concatenate([vertices, middles.astype(np.float32)]),
        np.concatenate([np.stack(triangle, axis=1) for triangle in corners]),
    )


def rotated_copies(vertices: Floats, faces: Faces, count: int, seed: int = 0) -> Mesh:
    """Return randomly rotated copies of the mesh, in random cells of a cubic grid; neighbors may overlap."""
    rng = np.random.default_rng(seed)
    center, extent = _frame(vertices)
    side = int(np.ceil(count ** (1 / 3)))
    cells = np.stack(np.unravel_index(rng.permutation(side**3)[:count], (side,) * 3), axis=1)
    return joined([((vertices - center) @ _rotation(rng).T + 1.2 * extent * cell, faces) for cell in cells])


def workloads(
    vertices: Floats, faces: Faces, target: Floats, trace: Tracer, size: tuple[int, int], seed: int = 0
) -> Iterator[Workload]:
    """Yield rays. primary: from a camera; bounce: on from its hits; shadow, occluded: from its hits to a light.

    The light of `occluded` is at the center of the target, which occludes it from most sides. target: the vertices (n,
    3) that the camera looks at; size: width and height in pixels.
    """
    center, extent = _frame(target)
    primary = camera_rays(center + extent * CAMERA, center, size)
    yield Workload("primary", False, primary)
    points, normals = surface_points(vertices, faces, primary, trace(*primary))
    points += GAP * _frame(vertices)[1] * normals
    yield Workload("bounce", False, bounce_rays(points, normals, seed))
    yield Workload("shadow", True, light_rays(points, normals, center + extent * LIGHT))
    yield Workload("occluded", True, light_rays(points, normals, center))


def camera_rays(position: Doubles, look_at: Doubles, size: tuple[int, int]) -> Rays:
    """Return one ray through the center of each pixel, in rows from the top, with infinite t_max."""
    width, height = size
    forward = _unit(look_at - position)
    right = _unit(np.cross(forward, [0.0, 1.0, 0.0]))
    up = np.cross(right, forward)
    y, x = np.mgrid[:height, :width].reshape(2, -1, 1) + 0.5
    half = np.tan(np.radians(FOV_DEGREES) / 2)
    directions = _unit(forward + half * ((2 * x - width) / height * right + (1 - 2 * y / height) * up))
    return (
        np.broadcast_to(position.astype(np.float32), directions.shape).copy(),
        directions.astype(np.float32),
        np.full(len(directions), np.inf, np.float32),
    )


def surface_points(vertices: Floats, faces: Faces, rays: Rays, hits: NDArray[Any]) -> tuple[Doubles, Doubles]:
    """Return the hit points, and the triangles' unit normals on the rays' side: (k, 3) float64 each.

    Rays that miss, or hit a triangle of zero area, are left out.
    """
    corners = vertices.astype(np.float64)[faces[hits["primitive"]]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    kept = (hits["primitive"] >= 0) & (normals != 0).any(axis=1)
    u, v = (hits[name][kept, None].astype(np.float64) for name in "uv")
    corners, normals = corners[kept], _unit(normals[kept])
    points = (1 - u - v) * corners[:, 0] + u * corners[:, 1] + v * corners[:, 2]
    against = np.einsum("ij,ij->i", normals, rays[1][kept]) > 0
    return points, np.where(against[:, None], -normals, normals)


def bounce_rays(points: Doubles, normals: Doubles, seed: int = 0) -> Rays:
    """Return a direction at each point with pdf cosθ/π around its normal: normal + a point on the unit sphere."""
    sphere = _unit(np.random.default_rng(seed).normal(size=points.shape))
    directions = _unit(normals + sphere)
    return points.astype(np.float32), directions.astype(np.float32), np.full(len(points), np.inf, np.float32)


def light_rays(points: Doubles, normals: Doubles, light: Doubles) -> Rays:
    """Return shadow rays that end just before the light, from the points whose normals face it, as in a renderer."""
    points = points[np.einsum("ij,ij->i", normals, light - points) > 0]
    distances = np.linalg.norm(light - points, axis=1)
    directions = (light - points) / distances[:, None]
    return points.astype(np.float32), directions.astype(np.float32), ((1 - GAP) * distances).astype(np.float32)


def _frame(vertices: Floats) -> tuple[Doubles, float]:
    """Return the center and the largest extent of the vertices' bounding box."""
    low, high = vertices.min(axis=0).astype(np.float64), vertices.max(axis=0).astype(np.float64)
    return (low + high) / 2, float((high - low).max())


def _box(center: Doubles, half: float) -> Mesh:
    """Return a cube of 12 triangles."""
    corners = np.stack(np.unravel_index(np.arange(8), (2, 2, 2)), axis=1) * 2 - 1
    sides = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]], np.int32)
    return ((center + half * corners).astype(np.float32), np.concatenate([sides[:, [0, 1, 2]], sides[:, [0, 2, 3]]]))


def joined(meshes: list[tuple[NDArray[Any], Faces]]) -> Mesh:
    """Join all meshes into one."""
    first = np.cumsum([0] + [len(vertices) for vertices, _ in meshes]).astype(np.int32)
    return (
        np.concatenate([vertices for vertices, _ in meshes]).astype(np.float32),
        np.concatenate([faces + start for (_, faces), start in zip(meshes, first)]),
    )


def _rotation(rng: np.random.Generator) -> Doubles:
    """Return a uniformly distributed rotation from a normal quaternion (Shoemake, Uniform random rotations, 1992)."""
    w, x, y, z = _unit(rng.normal(size=4))
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _unit(vectors: Doubles) -> Doubles:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))
