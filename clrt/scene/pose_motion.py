"""Motion of a scene between two of its poses: those at the start and at the end of an exposure."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import fields, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from .model import Environment, Instance, Mesh, Scene

log = logging.getLogger(__name__)
Doubles = NDArray[np.float64]
#: Vertices that determine the motion of a mesh.
SAMPLES = 1000
#: Deviation from an affine motion that rounding of vertices to float32 explains, relative to their size.
ROUNDING = 1e-5
#: Directions in which a mesh is this much smaller than in its longest one are determined by the others.
FLAT = 1e-5


def moving_between(start: Scene, end: Scene) -> Scene:
    """Return the scene at the start of an exposure, whose camera, instances and meshes move to where they are at its
    end; meshes that do become instances.

    Deforming meshes, lights and spheres stay as they are at the start, of which a warning is logged. Meshes that move
    alike have a common pivot, the center of all, so that they stay together.
    """
    pairs = list(zip(start.meshes, end.meshes)) if len(start.meshes) == len(end.meshes) else []
    paths = _Paths()
    moves = {i: path for i, (one, other) in enumerate(pairs) if (path := paths.of(one, other)) is not None}
    deforming = len(start.meshes) - len(moves) - sum(_alike(*pair) for pair in pairs)
    if deforming:
        _warn(start.name, f"{deforming} meshes deform, appear or vanish")
    if start.lights != end.lights or not _same_sky(start.environment, end.environment):
        _warn(start.name, "lights or the environment change")
    centers = [np.mean(points, axis=0) for points in paths.points]
    meshes = [mesh for i, mesh in enumerate(start.meshes) if i not in moves]
    moved = [
        Instance(
            start.meshes[i], name=start.meshes[i].name, to_world_end=paths.matrices[path], pivot=_about(centers[path])
        )
        for i, path in moves.items()
    ]
    rests = start.camera == end.camera
    camera = replace(start.camera, end=None) if rests else start.camera.moving_to(end.camera)
    return replace(start, meshes=meshes, instances=[*_moved(start.instances, end.instances), *moved], camera=camera)


@cache
def _warn(name: str, what: str) -> None:
    """Log a warning, once for all frames."""
    log.warning("%s: %s while the shutter is open; they are not blurred", name, what)


def _same_sky(one: Environment, other: Environment) -> bool:
    if one is other:
        return True
    names = [field.name for field in fields(one) if field.name != "image"]
    same_image = one.image is other.image or np.array_equal(one.image, other.image)  # type: ignore[arg-type]
    return same_image and all(getattr(one, name) == getattr(other, name, None) for name in names)


class _Paths:
    """Affine motions of meshes. matrices: (3, 4) each; points: some points at the start that have moved by each."""

    def __init__(self) -> None:
        self.matrices: list[Doubles] = []
        self.points: list[list[Doubles]] = []

    def of(self, start: Mesh, end: Mesh) -> int | None:
        """Return the number of the motion between two poses of a mesh; None if it rests or deforms."""
        if _alike(start, end) or not _same_faces(start, end):
            return None
        step = max(1, len(start.vertices) // SAMPLES)
        points, after = (each.vertices[::step].astype(np.float64) for each in (start, end))
        tolerance = ROUNDING * max(np.abs(points).max(), np.abs(after).max())
        for number, matrix in enumerate(self.matrices):
            if _miss(matrix, points, after) <= tolerance:
                self.points[number].append(points.mean(axis=0))
                return number
        matrix = affine_between(points, after)
        if _miss(matrix, points, after) > tolerance or np.linalg.det(matrix[:, :3]) <= 0:
            return None
        self.matrices.append(matrix)
        self.points.append([points.mean(axis=0)])
        return len(self.matrices) - 1


def affine_between(points: Doubles, after: Doubles) -> Doubles:
    """Return the affine matrix (3, 4) that takes points (n, 3) nearest to others; of points in a plane or on a line the
    one that rotates what is perpendicular, and scales it as the others on average."""
    center, moved = points.mean(axis=0), after.mean(axis=0)
    _, sizes, axes = np.linalg.svd(np.vstack([points - center, np.zeros((3, 3))]), full_matrices=False)
    rank = int((sizes > FLAT * sizes[0]).sum()) if sizes[0] > 0 else 0
    images = np.linalg.lstsq((points - center) @ axes[:rank].T, after - moved, rcond=None)[0]  # of the first axes
    linear = images.T @ axes[:rank]
    if rank < 3:
        turned, stretch, back = np.linalg.svd(linear)
        scale = stretch[:rank].mean() if rank else 1.0
        flips = np.linalg.det(turned) * np.linalg.det(back)
        rest = np.diag([0.0] * rank + [scale] * (2 - rank) + [scale * np.sign(flips)])
        linear = linear + turned @ rest @ back
    return np.column_stack([linear, moved - linear @ center])


def _moved(start: Sequence[Instance], end: Sequence[Instance]) -> list[Instance]:
    """Return the instances at the start, moving to where they are at the end unless these are others."""
    if len(start) != len(end):
        return list(start)
    return [
        replace(one, to_world_end=other.to_world, pivot=None)
        if _alike(one.mesh, other.mesh) and not np.array_equal(one.to_world, other.to_world)
        else one
        for one, other in zip(start, end)
    ]


def _alike(start: Mesh, end: Mesh) -> bool:
    return start is end or (_same_faces(start, end) and np.array_equal(start.vertices, end.vertices))


def _same_faces(start: Mesh, end: Mesh) -> bool:
    same = start.faces is end.faces or np.array_equal(start.faces, end.faces)
    return same and start.vertices.shape == end.vertices.shape


def _miss(matrix: Doubles, points: Doubles, after: Doubles) -> float:
    return float(np.abs(points @ matrix[:, :3].T + matrix[:, 3] - after).max())


def _about(center: Doubles) -> Doubles:
    return np.column_stack([np.eye(3), -center])
