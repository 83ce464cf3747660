"""Ray queries for trimesh's meshes: `mesh.ray = clrt.trimesh.RayMeshIntersector(mesh)`.

Same methods, shapes and dtypes as trimesh's own ray engines. Several hits of a ray are found without moving its
origin, so none is lost between surfaces that lie close together.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import UsageError
from .query import RayQuery
from .scene.numbers import real_array

__all__ = ["RayMeshIntersector"]

Doubles = NDArray[np.float64]
Indices = NDArray[np.int64]
#: Rays of `contains_points` go both ways along this direction, in which meshes made by hand have no edges or faces.
_PROBE = np.sqrt([1 / 6, 2 / 6, 3 / 6])
#: Hits of a ray are one location if they are closer than this part of the mesh's size: float32 hardly tells them apart.
_SAME = 1e-8
#: Sine of the angle to a plane below which a ray grazes it.
_GRAZING = 1e-4


class RayMeshIntersector:
    """Answers for one mesh as it is when it is asked: after a change the next call builds a new tree.

    mesh: a trimesh.Trimesh. device: see `clrt devices`. Rays are as in `RayQuery`: origins and directions are (n, 3),
    or (3,) for all. UsageError for what is no mesh and for rays and points that do not fit.
    """

    def __init__(self, mesh: Any, *, device: str | int | None = None) -> None:
        """Builds the tree: see the class."""
        if not (hasattr(mesh, "vertices") and hasattr(mesh, "faces")):
            raise UsageError(f"mesh is a {type(mesh).__name__} and has no faces; give a trimesh.Trimesh, of a Scene "
                             "scene.to_mesh()")
        self.mesh = mesh
        self._device = device
        self._built = hash(mesh), RayQuery(mesh.vertices, mesh.faces, device=device)

    @property
    def query(self) -> RayQuery:
        """The query that answers, of the mesh as it is now."""
        now = hash(self.mesh)
        if self._built[0] != now:
            self._built = now, RayQuery(self.mesh.vertices, self.mesh.faces, device=self._device)
        return self._built[1]

    def intersects_id(self, ray_origins: ArrayLike, ray_directions: ArrayLike, *, multiple_hits: bool = True,
                      max_hits: int | None = None, return_locations: bool = False) -> tuple[Any, ...]:
        """index_tri (m,) int64, index_ray (m,) int64, along each ray; if asked for, locations (m, 3) float64.

        All triangles that a ray meets, up to `max_hits` of them if that is given, or the first one alone. With
        locations there is one of them for each point: a ray through an edge or a corner counts once.
        """
        query = self.query
        most = (len(self.mesh.faces) or 1) if max_hits is None else max_hits
        ray, hits = query.all_hits(ray_origins, ray_directions, max_hits=most if multiple_hits else 1)
        triangle = hits["primitive"].astype(np.int64)
        if not return_locations:
            return triangle, ray
        corners = np.asarray(self.mesh.vertices, np.float64)[np.asarray(self.mesh.faces)[triangle]]
        origins, directions = (np.atleast_2d(np.asarray(each, np.float64)) for each in (ray_origins, ray_directions))
        origins, directions = origins[ray % len(origins)], directions[ray % len(directions)]
        t = _distances(origins, directions, corners, hits["t"])
        order = np.lexsort((t, ray))
        triangle, ray, locations = triangle[order], ray[order], (origins + t[:, None] * directions)[order]
        steps = np.linalg.norm(np.diff(locations, axis=0), axis=1)
        new = np.ones(len(ray), np.bool_)
        new[1:] = (np.diff(ray) > 0) | (steps > _SAME * self.mesh.scale)
        return triangle[new], ray[new], locations[new]

    def intersects_location(self, ray_origins: ArrayLike, ray_directions: ArrayLike, multiple_hits: bool = True, *,
                            max_hits: int | None = None) -> tuple[Doubles, Indices, Indices]:
        """locations (m, 3) float64, index_ray (m,) int64, index_tri (m,) int64: see `intersects_id`."""
        triangle, ray, locations = self.intersects_id(ray_origins, ray_directions, multiple_hits=multiple_hits,
                                                      max_hits=max_hits, return_locations=True)
        return locations, ray, triangle

    def intersects_first(self, ray_origins: ArrayLike, ray_directions: ArrayLike) -> Indices:
        """(n,) int64: the first triangle that each ray meets, −1 where it meets none."""
        return np.asarray(self.query.closest_hit(ray_origins, ray_directions)["primitive"], np.int64)

    def intersects_any(self, ray_origins: ArrayLike, ray_directions: ArrayLike) -> NDArray[np.bool_]:
        """(n,) bool: whether each ray meets anything."""
        return self.query.any_hit(ray_origins, ray_directions)

    def contains_points(self, points: ArrayLike) -> NDArray[np.bool_]:
        """(n,) bool: whether points (n, 3) are inside: an odd number of hits both ways."""
        places = real_array("points", points)
        if places.ndim != 2 or places.shape[1] != 3:
            raise UsageError(f"points {places.shape} must have the shape (n, 3)")
        odd = [np.bincount(self.intersects_id(places, direction)[1], minlength=len(places)) % 2 == 1
               for direction in (_PROBE, -_PROBE)]
        return np.asarray(odd[0] & odd[1])

    def __getstate__(self) -> dict[str, Any]:
        """A copy for another process builds its own tree there."""
        return self.__dict__ | {"_built": (None, None)}


def _distances(origins: Doubles, directions: Doubles, corners: Doubles, near: NDArray[np.float32]) -> Doubles:
    """(m,) t at which rays that meet triangles (m, 3, 3) pass their planes, in float64; `near` is what float32 says.

    That stays where a ray grazes: moved by the rounding of float32, it would pass the plane somewhere else.
    """
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    approach = (normals * directions).sum(axis=1)
    steep = np.abs(approach) > _GRAZING * np.linalg.norm(normals, axis=1) * np.linalg.norm(directions, axis=1)
    t = near.astype(np.float64)
    np.divide((normals * (corners[:, 0] - origins)).sum(axis=1), approach, out=t, where=steep)
    return t
