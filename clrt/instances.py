"""Ray queries on instances: meshes that stand in the world many times, in the memory of one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .accel.layouts import Layout
from .accel.two_level import TwoLevels
from .device.open import open_device
from .errors import SceneError
from .tree_query import TreeQuery
from .scene.mesh_arrays import mesh_arrays
from .scene.scaling import unit_for

Doubles = NDArray[np.float64]
#: A transform is singular if it makes a unit of volume smaller than this, measured in its own longest column.
SINGULAR = 1e-12


class InstancedRayQuery(TreeQuery):
    """Instances to shoot rays at, as in `TreeQuery`, with the hit's `instance` (int32, −1) beside the others.

    meshes: pairs of vertices (n, 3) float32 and faces (m, 3) int32. mesh: (k,) which of them each instance is.
    transforms: (k, 3, 4), rows of an affine map from the mesh's frame to the world; mirrored and non-uniform ones too.
    device, layout, builder, triangle: as in `RayQuery`; the layout list has no instances.
    `primitive` counts in the instance's mesh. Of hits at the same t the lowest instance comes first.
    Raises SceneError for other shapes, indices out of range and transforms that are not finite or singular.
    """

    def __init__(self, meshes: Sequence[tuple[ArrayLike, ArrayLike]], mesh: ArrayLike, transforms: ArrayLike, *,
                 device: str | int | None = None, layout: str | None = None, builder: str | None = None,
                 triangle: str = "watertight", traversal: str | None = None) -> None:
        triangles = [points[faces] for points, faces in (mesh_arrays(*each) for each in meshes)]
        self._mesh = _indices(mesh, len(triangles))
        self._extents = np.array([np.abs(mesh_corners).reshape(-1, 3).max(axis=0, initial=0)
                                  for mesh_corners in triangles], np.float64).reshape(-1, 3)
        self._units = np.array([unit_for(largest) for largest in self._extents.max(axis=1).tolist()])
        to_world = _matrices(transforms, len(self._mesh))
        opened = open_device(device)
        self._levels = TwoLevels(opened, layout or opened.layout, builder,
                                 [(mesh_corners * unit).astype(np.float32)
                                  for mesh_corners, unit in zip(triangles, self._units)], self._mesh)
        tree, unit = self._placed(to_world)
        super().__init__(opened, tree, sum(map(len, triangles)), unit, triangle, traversal)

    def move(self, transforms: ArrayLike) -> None:
        """Puts the same instances elsewhere: transforms (k, 3, 4) as before, SceneError likewise.

        The trees of the meshes stay; what is built anew is the small one over the instances.
        """
        self._use(*self._placed(_matrices(transforms, len(self._mesh))))

    def _placed(self, to_world: Doubles) -> tuple[Layout, float]:
        """The tree, and the unit of the world's lengths. Those of each mesh have one of their own."""
        reach = np.einsum("kij,kj->ki", np.abs(to_world[..., :3]), self._extents[self._mesh]) + np.abs(to_world[..., 3])
        unit = unit_for(float(reach.max(initial=0)))
        scaled = unit * to_world
        scaled[..., :3] /= self._units[self._mesh][:, None, None]
        return self._levels.place(scaled), unit


def _indices(mesh: ArrayLike, meshes: int) -> NDArray[np.int32]:
    index = np.asarray(mesh)
    if index.ndim != 1 or (index.size and index.dtype.kind not in "iu"):
        raise SceneError(f"mesh {index.shape} {index.dtype} must have the shape (k,), of whole numbers")
    outside = (index < 0) | (index >= meshes)
    if outside.any():
        first = int(np.argmax(outside))
        raise SceneError(f"mesh[{first}] = {index[first]}: there are {meshes} meshes")
    return index.astype(np.int32)


def _matrices(transforms: ArrayLike, instances: int) -> Doubles:
    to_world = np.asarray(transforms, np.float64)
    if to_world.shape != (instances, 3, 4):
        raise SceneError(f"transforms {to_world.shape} must have the shape ({instances}, 3, 4), one an instance")
    with np.errstate(all="ignore"):
        length = np.linalg.norm(to_world[..., :3], axis=1).max(axis=1, initial=0)
        volume = np.abs(np.linalg.det(to_world[..., :3] / np.maximum(length, 1e-300)[:, None, None]))
    bad = ~np.isfinite(to_world).all(axis=(1, 2)) | ~(volume > SINGULAR)
    if bad.any():
        first = int(np.argmax(bad))
        raise SceneError(f"transforms[{first}] = {to_world[first].tolist()} is not finite or flattens the mesh; "
                         "repair it")
    return to_world
