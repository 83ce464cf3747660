"""Ray queries on a mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .accel.build import build_tree
from .accel.layouts import Layout
from .accel.refit import Refitter, can_refit
from .device.open import Device, open_device
from .errors import SceneError
from .scene.mesh_arrays import finite_points, mesh_arrays
from .scene.scaling import unit_for
from .tree_query import TreeQuery


class RayQuery(TreeQuery):
    """Triangles to shoot rays at; all about the rays is in `TreeQuery`.

    vertices: (n, 3) float32; faces: (m, 3) int32. device, layout, builder, triangle: as in `Renderer`.
    Raises SceneError for arrays of other shapes, vertices that are not finite and indices out of range.
    """

    def __init__(self, vertices: ArrayLike, faces: ArrayLike, *, device: str | int | None = None,
                 layout: str | None = None, builder: str | None = None, triangle: str = "watertight",
                 traversal: str | None = None) -> None:
        points, self._faces = mesh_arrays(vertices, faces)
        opened = open_device(device)
        self._vertices, self._layout, self._builder = len(points), layout or opened.layout, builder
        tree, unit = self._built(opened, points)
        super().__init__(opened, tree, len(self._faces), unit, triangle, traversal)
        self._refitter: Refitter | None = None

    def refit(self, vertices: ArrayLike) -> None:
        """Moves the vertices, (n, 3) and as many as before; the faces stay. SceneError for other shapes and numbers.

        The tree stays, too, and gets new boxes. That is much faster than a new tree, but the more neighbours part, the
        slower rays become; of that `tree.sah_cost` knows nothing. A new tree is built where the layout has no other
        way (list, cwbvh), and where the mesh grows or shrinks about a millionfold.
        """
        points = finite_points(vertices)
        if len(points) != self._vertices:
            raise SceneError(f"vertices {points.shape}: the mesh has {self._vertices}; for another make another query")
        if not can_refit(self.tree) or not self._comfortable(points):
            self._refitter = None
            self._use(*self._built(self.device, points))
            return
        if self._refitter is None:
            self._refitter = Refitter(self.device, self.tree, self._faces, len(points))
        self._refitter.refit(_times(points, self.unit))

    def _built(self, device: Device, points: NDArray[np.float32]) -> tuple[Layout, float]:
        """A new tree, and the unit of its lengths."""
        triangles = points[self._faces]
        unit = unit_for(_largest(triangles))
        return build_tree(device, self._layout, self._builder, _times(triangles, unit)), unit

    def _comfortable(self, points: NDArray[np.float32]) -> bool:
        """Whether the tree's unit still suits the mesh."""
        if unit_for(_largest(points) * self.unit) == 1:
            return True
        return unit_for(_largest(points[self._faces]) * self.unit) == 1  # vertices that no face uses do not count


def _largest(points: NDArray[np.float32]) -> float:
    return float(max(points.max(initial=0), -points.min(initial=0)))


def _times(points: NDArray[np.float32], unit: float) -> NDArray[np.float32]:
    with np.errstate(over="ignore"):
        return points if unit == 1 else (points * np.float64(unit)).astype(np.float32)
