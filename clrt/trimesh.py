"""Ray queries for trimesh's meshes: `mesh.ray = clrt.trimesh.RayMeshIntersector(mesh)`.

Same methods, shapes and dtypes as trimesh's own ray engines. Several hits of a ray are found without moving its
origin, so none is lost between surfaces that lie close together.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .query import RayQuery

Doubles = NDArray[np.float64]
Indices = NDArray[np.int64]
#: Rays of `contains_points` go both ways along this direction, in which meshes made by hand have no edges or faces.
PROBE = np.sqrt([1 / 6, 2 / 6, 3 / 6])


class RayMeshIntersector:
    """Answers for one mesh, which must not change. device: see `clrt devices`."""

    def __init__(self, mesh: Any, *, device: str | int | None = None) -> None:
        self.mesh = mesh
        self.query = RayQuery(mesh.vertices, mesh.faces, device=device)

    def intersects_id(self, ray_origins: ArrayLike, ray_directions: ArrayLike, multiple_hits: bool = True,
                      max_hits: int = 100, return_locations: bool = False) -> tuple[Any, ...]:
        """index_tri (m,) int64, index_ray (m,) int64 and, if asked for, locations (m, 3) float64.

        All hits of every ray up to `max_hits`, or the first ones alone.
        """
        origins, directions = (np.asarray(a, np.float64).reshape(-1, 3) for a in (ray_origins, ray_directions))
        ray, hits = self.query.all_hits(origins, directions, max_hits=max_hits if multiple_hits else 1)
        triangle = hits["primitive"].astype(np.int64)
        return (triangle, ray, self._locations(triangle, hits)) if return_locations else (triangle, ray)

    def intersects_location(self, ray_origins: ArrayLike, ray_directions: ArrayLike,
                            multiple_hits: bool = True) -> tuple[Doubles, Indices, Indices]:
        """locations (m, 3) float64, index_ray (m,) int64, index_tri (m,) int64."""
        triangle, ray, locations = self.intersects_id(ray_origins, ray_directions, multiple_hits, return_locations=True)
        return locations, ray, triangle

    def intersects_first(self, ray_origins: ArrayLike, ray_directions: ArrayLike) -> Indices:
        """(n,) int64: the first triangle that each ray meets, −1 where it meets none."""
        return np.asarray(self.query.closest_hit(ray_origins, ray_directions)["primitive"], np.int64)

    def intersects_any(self, ray_origins: ArrayLike, ray_directions: ArrayLike) -> NDArray[np.bool_]:
        """(n,) bool: whether each ray meets anything."""
        return self.query.any_hit(ray_origins, ray_directions)

    def contains_points(self, points: ArrayLike) -> NDArray[np.bool_]:
        """(n,) bool: whether points (n, 3) are inside: an odd number of hits both ways."""
        points = np.asarray(points, np.float64).reshape(-1, 3)
        odd = [np.bincount(self.query.all_hits(points, direction)[0], minlength=len(points)) % 2 == 1
               for direction in (PROBE, -PROBE)]
        return np.asarray(odd[0] & odd[1])

    def _locations(self, triangle: Indices, hits: NDArray[Any]) -> Doubles:
        """(m, 3) float64 points on the triangles."""
        corners = np.asarray(self.mesh.vertices, np.float64)[np.asarray(self.mesh.faces)[triangle]]
        u, v = hits["u"].astype(np.float64)[:, None], hits["v"].astype(np.float64)[:, None]
        return np.asarray((1 - u - v) * corners[:, 0] + u * corners[:, 1] + v * corners[:, 2])
