"""Ray queries on a triangle mesh."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..accel.build import build_tree
from ..accel.layouts import Layout
from ..accel.methods import HitTests
from ..accel.refit import Refitter, can_refit
from ..device.open import Device, open_device
from ..errors import SceneError, UsageError
from ..float_errors import with_default_errors
from ..scene.fields.keywords import with_known_keywords
from ..scene.geometry.mesh_arrays import finite_points, mesh_arrays, sphere_array
from ..scene.geometry.ray_arrays import Rays
from ..scene.geometry.scaling import SceneFrame, frame_around
from .base import TreeQuery


class RayQuery(TreeQuery):
    """Triangles and spheres to intersect with rays; `TreeQuery`, the base class, describes rays and hits.

    - vertices: (n, 3) float32, or float64 if far from the origin; faces: (m, 3) int32; or a mesh or scene of
      trimesh alone
    - spheres: (s, 4) float32, center and radius, the primitives m … m + s − 1, with u = v = 0

    Choices that do not affect the results:

    - device: a number, an id, a part of a name, "cpu" or "gpu", see `clrt.devices()`; None selects the best
    - layout: "bvh8", "bvh2", "cwbvh", "packs" or "list" (brute force); None selects bvh8 on CPUs and cwbvh on GPUs
    - builder: "sah" or "midpoint" in numpy, "ploc" or "reinsertion" on the device; None selects sah for small meshes
      and ploc for large ones
    - traversal: "single", "packet" or "pool", for bvh8 only

    Intersection tests:

    - triangle: "watertight", or "moller_trumbore", "precomputed", "baldwin_weber", which may miss at shared edges
    - box: "robust" or "plain"; sphere: "robust" or "textbook"

    Raises SceneError for arrays of other shapes, numbers that are not finite, indices out of range and radii that are
    not above 0, and UsageError for other choices.
    """

    @with_known_keywords
    @with_default_errors
    def __init__(
        self,
        vertices: ArrayLike,
        faces: ArrayLike | None = None,
        *,
        spheres: ArrayLike | None = None,
        device: str | int | None = None,
        layout: str | None = None,
        builder: str | None = None,
        triangle: str = "watertight",
        box: str = "robust",
        sphere: str = "robust",
        traversal: str | None = None,
    ) -> None:
        """Build the BVH; see the class."""
        if faces is None and hasattr(vertices, "to_mesh"):  # a scene of trimesh
            vertices = vertices.to_mesh()
        if faces is None and hasattr(vertices, "faces"):
            vertices, faces = vertices.vertices, vertices.faces  # type: ignore[union-attr]
        elif faces is None:
            raise UsageError("faces is missing; give vertices and faces, or a mesh of trimesh")
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
        """Move the vertices, (n, 3), as many as before; faces and spheres stay. Raises SceneError for other arrays.

        The BVH's topology is kept and its boxes are recomputed. That is much faster than a rebuild, but traversal slows
        down as neighbors move apart, which `tree.sah_cost` does not reflect. The BVH is rebuilt if refitting is not
        supported (the layouts list and cwbvh, triangles that are not stored as corners, spheres), and if the mesh grows
        or shrinks about a millionfold or moves far away.
        """
        points = finite_points(vertices)
        if len(points) != self._vertices:
            raise SceneError(f"vertices {points.shape}: the mesh has {self._vertices}; create a new query for another")
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
        """See `TreeQuery`; first completes a refit that was interrupted."""
        if self._moving is not None:
            self.refit(self._moving)
        return super()._ask(name, rays, answers)

    def _built(self, device: Device, points: NDArray[np.floating], triangle: str) -> tuple[Layout, SceneFrame]:
        """Build a BVH for that triangle test, and return it with its frame."""
        frame = frame_around(*_bounds(points[self._faces], self._spheres))
        spheres = np.hstack([frame.points(self._spheres[:, :3]), self._spheres[:, 3:] * np.float32(frame.unit)])
        corners = frame.points(points)[self._faces]
        return build_tree(device, self._layout, self._builder, corners, spheres, triangle), frame

    def _comfortable(self, points: NDArray[np.floating]) -> bool:
        """Return whether the BVH's frame still suits the mesh."""
        moved = self.frame.points(points)
        if frame_around(*_bounds(moved[:, None], self._spheres)) == SceneFrame():
            return True
        # Ignores vertices without a face.
        return frame_around(*_bounds(moved[self._faces], self._spheres)) == SceneFrame()


def _bounds(triangles: NDArray[np.floating], spheres: NDArray[np.float32]) -> tuple[NDArray[np.floating], ...]:
    """Return the bounding box, corners (3,), of triangles (m, k, 3) and spheres (s, 4); inverted if there are none."""
    points, balls = triangles.reshape(-1, 3), spheres.astype(np.float64)
    ends = np.concatenate([points, balls[:, :3] - balls[:, 3:], balls[:, :3] + balls[:, 3:]])
    return ends.min(axis=0, initial=np.inf), ends.max(axis=0, initial=-np.inf)
