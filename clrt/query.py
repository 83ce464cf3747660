"""Ray queries on a mesh."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .accel.build import build_tree
from .accel.kernels import HitTests
from .accel.layouts import Layout
from .accel.refit import Refitter, can_refit
from .device.open import Device, open_device
from .errors import SceneError
from .float_errors import with_default_errors
from .scene.mesh_arrays import finite_points, mesh_arrays, sphere_array
from .scene.ray_arrays import Rays
from .scene.scaling import Frame, frame_around
from .tree_query import TreeQuery


class RayQuery(TreeQuery):
    """Triangles, and maybe spheres, to shoot rays at; how rays are given and answered is in `TreeQuery`, its base.

    vertices: (n, 3) float32, or float64 if far from the origin; faces: (m, 3) int32; spheres: (s, 4) float32, centre
    and radius, the primitives m … m + s − 1, with u = v = 0. Answers depend on none of the first four choices:
    device: a number, an id, a part of a name, "cpu" or "gpu", see `clrt.devices()`; None takes the best.
    layout: "bvh8", "bvh2", "cwbvh", "packs" or "list" (no tree); None takes bvh8 on CPUs and cwbvh on GPUs.
    builder: "sah" or "midpoint" in numpy, "ploc" or "reinsertion" on the device; None takes sah for small meshes and
    ploc for large ones.
    traversal: "single", "packet" or "pool", of bvh8 alone: see `TreeQuery`.
    triangle: "watertight", or "moller_trumbore", "precomputed", "baldwin_weber", which let rays through between
    triangles. box: "robust" or "plain"; sphere: "robust" or "textbook".

    Raises SceneError for arrays of other shapes, numbers that are not finite, indices out of range and radii that are
    not above 0, and UsageError for other choices.
    """

    @with_default_errors
    def __init__(self, vertices: ArrayLike, faces: ArrayLike, *, spheres: ArrayLike | None = None,
                 device: str | int | None = None, layout: str | None = None, builder: str | None = None,
                 triangle: str = "watertight", box: str = "robust", sphere: str = "robust",
                 traversal: str | None = None) -> None:
        """Builds the tree: see the class."""
        points, self._faces = mesh_arrays(vertices, faces)
        self._spheres = sphere_array(np.zeros((0, 4)) if spheres is None else spheres)
        tests, opened = HitTests(triangle, box, sphere), open_device(device)
        self._vertices, self._builder = len(points), builder
        self._layout = opened.layout if layout is None else layout
        tree, frame = self._built(opened, points, triangle)
        super().__init__(opened, tree, (len(self._faces), len(self._spheres)), frame, tests, traversal, device)
        self._refitter: Refitter | None = None
        self._moving: NDArray[np.floating] | None = None

    def __getstate__(self) -> dict[str, Any]:
        """See TreeQuery."""
        return {**super().__getstate__(), "_refitter": None}

    @with_default_errors
    def refit(self, vertices: ArrayLike) -> None:
        """Moves the vertices, (n, 3) and as many as before; faces and spheres stay. SceneError for others.

        The tree stays, too, and gets new boxes. That is much faster than a new tree, but the more neighbours part, the
        slower rays become; of that `tree.sah_cost` knows nothing. A new tree is built where there is no other way (the
        layouts list and cwbvh, triangles that are not stored as corners, spheres), and where the mesh grows or shrinks
        about a millionfold or moves far away.
        """
        points = finite_points(vertices)
        if len(points) != self._vertices:
            raise SceneError(f"vertices {points.shape}: the mesh has {self._vertices}; for another make another query")
        if not can_refit(self.tree) or not self._comfortable(points):
            self._refitter = None
            self._use(*self._built(self.device, points, self._tests.triangle))
            self._moving = None
            return
        if self._refitter is None:
            self._refitter = Refitter(self.device, self.tree, self._faces, len(points))
        self._moving = points
        self._refitter.refit(self.frame.points(points))
        self._moving = None

    def _ask(self, name: str, rays: Rays, answers: NDArray[Any]) -> NDArray[Any]:
        """See `TreeQuery`; a refit that was interrupted is done first."""
        if self._moving is not None:
            self.refit(self._moving)
        return super()._ask(name, rays, answers)

    def _built(self, device: Device, points: NDArray[np.floating], triangle: str) -> tuple[Layout, Frame]:
        """A new tree for that test of triangles, and its frame."""
        frame = frame_around(*_bounds(points[self._faces], self._spheres))
        spheres = np.hstack([frame.points(self._spheres[:, :3]), self._spheres[:, 3:] * np.float32(frame.unit)])
        corners = frame.points(points)[self._faces]
        return build_tree(device, self._layout, self._builder, corners, spheres, triangle), frame

    def _comfortable(self, points: NDArray[np.floating]) -> bool:
        """Whether the tree's frame still suits the mesh."""
        moved = self.frame.points(points)
        if frame_around(*_bounds(moved[:, None], self._spheres)) == Frame():
            return True
        return frame_around(*_bounds(moved[self._faces], self._spheres)) == Frame()  # vertices of no face do not count


def _bounds(triangles: NDArray[np.floating], spheres: NDArray[np.float32]) -> tuple[NDArray[np.floating], ...]:
    """Low and high corner (3,) of the box around triangles (m, k, 3) and spheres (s, 4); inverted around nothing."""
    points, balls = triangles.reshape(-1, 3), spheres.astype(np.float64)
    ends = np.concatenate([points, balls[:, :3] - balls[:, 3:], balls[:, :3] + balls[:, 3:]])
    return ends.min(axis=0, initial=np.inf), ends.max(axis=0, initial=-np.inf)
