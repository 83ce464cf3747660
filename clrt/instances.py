"""Ray queries on instances: meshes that stand in the world many times, in the memory of one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .accel.two_level import build_two_levels
from .device.open import open_device
from .errors import SceneError
from .query import IN_FLIGHT, RayQuery, corners
from .scene.scaling import unit_for

#: A transform is singular if it makes a unit of volume smaller than this, measured in its own longest column.
SINGULAR = 1e-12


class InstancedRayQuery(RayQuery):
    """Instances to shoot rays at; everything else as in `RayQuery`, with the hit's `instance` (int32, −1) beside it.

    meshes: pairs of vertices (n, 3) float32 and faces (m, 3) int32. mesh: (k,) which of them each instance is.
    transforms: (k, 3, 4), rows of an affine map from the mesh's frame to the world; mirrored and non-uniform ones too.
    `primitive` counts in the instance's mesh. Of hits at the same t the lowest instance comes first.
    Raises SceneError for other shapes, indices out of range and transforms that are not finite or singular.
    """

    def __init__(self, meshes: Sequence[tuple[ArrayLike, ArrayLike]], mesh: ArrayLike, transforms: ArrayLike, *,
                 device: str | int | None = None, layout: str | None = None, builder: str | None = None,
                 triangle: str = "watertight", in_flight: int = IN_FLIGHT) -> None:
        triangles = [corners(vertices, faces) for vertices, faces in meshes]
        index, to_world = _checked(len(triangles), mesh, transforms)
        unit = unit_for(_size(triangles, index, to_world))
        to_world = to_world * np.array([1, 1, 1, unit])
        opened = open_device(device)
        scaled = [(corner * np.float64(unit)).astype(np.float32) for corner in triangles]
        tree = build_two_levels(opened, layout or opened.layout, builder, scaled, index, to_world)
        self._prepare(opened, tree, sum(map(len, triangles)), unit, triangle, in_flight)


def _checked(meshes: int, mesh: ArrayLike, transforms: ArrayLike) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    index, to_world = np.asarray(mesh), np.asarray(transforms, np.float64)
    if index.ndim != 1 or index.dtype.kind not in "iu" or to_world.shape != (len(index), 3, 4):
        raise SceneError(f"mesh {index.shape} {index.dtype} and transforms {to_world.shape} must have shapes (k,), of "
                         "whole numbers, and (k, 3, 4)")
    outside = (index < 0) | (index >= meshes)
    if outside.any():
        first = int(np.argmax(outside))
        raise SceneError(f"mesh[{first}] = {index[first]}: there are {meshes} meshes")
    with np.errstate(all="ignore"):
        length = np.linalg.norm(to_world[..., :3], axis=1).max(axis=1, initial=0)
        volume = np.abs(np.linalg.det(to_world[..., :3] / np.maximum(length, 1e-300)[:, None, None]))
    bad = ~np.isfinite(to_world).all(axis=(1, 2)) | ~(volume > SINGULAR)
    if bad.any():
        first = int(np.argmax(bad))
        raise SceneError(f"transforms[{first}] = {to_world[first].tolist()} is not finite or flattens the mesh; "
                         "repair it")
    return index.astype(np.int32), to_world


def _size(triangles: Sequence[NDArray[np.float32]], index: NDArray[np.int32], to_world: NDArray[np.float64]) -> float:
    """The largest coordinate that an instance can have in the world."""
    extents = np.array([np.abs(corner).reshape(-1, 3).max(axis=0, initial=0) for corner in triangles]).reshape(-1, 3)
    reach = np.einsum("kij,kj->ki", np.abs(to_world[..., :3]), extents[index]) + np.abs(to_world[..., 3])
    return float(reach.max(initial=0))
