"""Ray queries on instances of meshes that share the meshes' memory."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..accel.layouts import Layout
from ..accel.methods import HitTests
from ..accel.two_level import TwoLevelBvh
from ..device.open import open_device
from ..errors import SceneError
from ..float_errors import with_default_errors
from ..scene.fields.keywords import with_known_keywords
from ..scene.fields.number_arrays import real_array, whole_array
from ..scene.geometry.mesh_arrays import mesh_arrays
from ..scene.geometry.scaling import SceneFrame, frame_around, unit_for
from ..scene.geometry.transform_faults import transform_faults
from .base import TreeQuery

Doubles = NDArray[np.float64]


class InstancedRayQuery(TreeQuery):
    """Instanced meshes to intersect with rays, as in `TreeQuery`; hits also have an `instance` (int32, −1 for a miss).

    - meshes: a list of pairs, vertices (n, 3) float32 and faces (m, 3) int32
    - mesh: (k,) each instance's index into it
    - transforms: (k, 3, 4), rows of an affine map from the mesh's frame to the world, which may mirror and scale axes
      differently
    - device, layout, builder, triangle, box: as in `RayQuery`; the layout list does not support instances

    `primitive` is an index into the instance's mesh. Of hits at the same t the lowest instance comes first.

    Raises SceneError for other shapes, indices out of range and transforms that are not finite or singular, and
    UsageError for other choices.
    """

    @with_known_keywords
    @with_default_errors
    def __init__(
        self,
        meshes: Sequence[tuple[ArrayLike, ArrayLike]],
        mesh: ArrayLike,
        transforms: ArrayLike,
        *,
        device: str | int | None = None,
        layout: str | None = None,
        builder: str | None = None,
        triangle: str = "watertight",
        box: str = "robust",
        traversal: str | None = None,
    ) -> None:
        """Build the BVHs; see the class."""
        triangles = _meshes(meshes)
        self._mesh = _indices(mesh, len(triangles))
        self._extents = np.array(
            [np.abs(mesh_corners).reshape(-1, 3).max(axis=0, initial=0) for mesh_corners in triangles], np.float64
        ).reshape(-1, 3)
        self._units = np.array([unit_for(largest) for largest in self._extents.max(axis=1).tolist()])
        to_world = _matrices(transforms, len(self._mesh))
        tests, opened = HitTests(triangle, box), open_device(device)
        self._levels = TwoLevelBvh(
            opened,
            opened.layout if layout is None else layout,
            builder,
            [(mesh_corners * unit).astype(np.float32) for mesh_corners, unit in zip(triangles, self._units)],
            self._mesh,
            triangle,
        )
        tree, frame = self._placed(to_world)
        super().__init__(opened, tree, (sum(map(len, triangles)), 0), frame, tests, traversal, device)

    def __getstate__(self) -> dict[str, Any]:
        """See TreeQuery."""
        return {**super().__getstate__(), "_levels": self._levels.on(None, {})}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """See TreeQuery."""
        super().__setstate__(state)
        self._levels = self._levels.on(self.device, dict(self.tree.buffers))

    @with_default_errors
    def move(self, transforms: ArrayLike) -> None:
        """Move the instances to other transforms (k, 3, 4); raises SceneError as before.

        The meshes' BVHs are kept; only the small one over the instances is rebuilt.
        """
        self._use(*self._placed(_matrices(transforms, len(self._mesh))))

    def _placed(self, to_world: Doubles) -> tuple[Layout, SceneFrame]:
        """Build the BVH over the instances, and return it with the world's frame; each mesh has its own length unit."""
        reach = np.einsum("kij,kj->ki", np.abs(to_world[..., :3]), self._extents[self._mesh])
        low, high = to_world[..., 3] - reach, to_world[..., 3] + reach
        frame = frame_around(low.min(axis=0, initial=np.inf), high.max(axis=0, initial=-np.inf))
        placed = to_world.copy()
        placed[..., 3] -= frame.center
        placed *= frame.unit
        placed[..., :3] /= self._units[self._mesh][:, None, None]
        return self._levels.place(placed), frame


def _meshes(meshes: Sequence[tuple[ArrayLike, ArrayLike]]) -> list[NDArray[np.floating]]:
    """Return each mesh's triangle corners (m, 3, 3)."""
    if not isinstance(meshes, list | tuple):
        raise SceneError(f"meshes is a {type(meshes).__name__}; write a list of pairs, [(vertices, faces), …]")
    triangles = []
    for i, pair in enumerate(meshes):
        if not (isinstance(pair, list | tuple) and len(pair) == 2):
            raise SceneError(f"meshes[{i}] is not a pair (vertices, faces); write a list of pairs, [(vertices, faces)]")
        try:
            points, faces = mesh_arrays(*pair)
        except SceneError as error:
            raise SceneError([f"meshes[{i}]: {problem}" for problem in error.problems]) from None
        triangles.append(points[faces])
    return triangles


def _indices(mesh: ArrayLike, meshes: int) -> NDArray[np.int32]:
    index = whole_array("mesh", mesh, SceneError)
    if index.ndim != 1:
        raise SceneError(f"mesh {index.shape} must have the shape (k,): the mesh index of each instance")
    outside = (index < 0) | (index >= meshes)
    if outside.any():
        first = int(np.argmax(outside))
        raise SceneError(f"mesh[{first}] = {index[first]}: there are {meshes} meshes, counted from 0")
    return index.astype(np.int32)


def _matrices(transforms: ArrayLike, instances: int) -> Doubles:
    to_world = real_array("transforms", transforms, SceneError).astype(np.float64)
    if to_world.shape != (instances, 3, 4):
        rows = "; drop the last row: transforms[:, :3]" * (to_world.shape == (instances, 4, 4))
        raise SceneError(f"transforms {to_world.shape} must have the shape ({instances}, 3, 4), one per instance{rows}")
    faults = transform_faults(to_world)
    firsts = {fault: (int(np.argmax(wrong)), int(wrong.sum())) for fault, wrong in faults.items() if wrong.any()}
    if firsts:
        raise SceneError(
            [
                f"transforms[{first}] = {to_world[first].tolist()} {fault}; repair it"
                + f" and {count - 1} more like it" * (count > 1)
                for fault, (first, count) in firsts.items()
            ]
        )
    return to_world
