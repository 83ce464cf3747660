"""Ray queries for trimesh's meshes: `mesh.ray = clrt.trimesh.RayMeshIntersector(mesh)`.

Same methods, shapes and dtypes as trimesh's own ray engines. Several hits of a ray are found without moving its
origin, so none is lost between surfaces that lie close together.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import UsageError
from .float_errors import with_default_errors
from .query import RayQuery
from .scene.numbers import real_array
from .scene.ray_arrays import ray_arrays

__all__ = ["RayMeshIntersector"]

Bools = NDArray[np.bool_]
Doubles = NDArray[np.float64]
Indices = NDArray[np.int64]
#: Hits of a ray are one location if they are closer than this part of the mesh's size.
_SAME = 1e-8
#: So are, closer than this part of it and of their distance, those on triangles that share a corner and face alike:
#: float32 takes a ray through an edge to meet both, though in float64 it may meet the plane of one beside the edge.
_NEAR = 1e-6
#: Rays begin so much of the mesh's size, or of their distance, before their origins, which may lie on the mesh.
_BACK = 1e-6
#: Sine of the angle to a plane below which a ray grazes it.
_GRAZING = 1e-4


class _Rays(NamedTuple):
    """origins, directions (n, 3); in lengths of a direction: the size (n,) of the mesh or, if larger, how far it is."""

    origins: Doubles
    directions: Doubles
    size: Doubles

    def of(self, chosen: Indices) -> _Rays:
        """Some of them."""
        return _Rays(self.origins[chosen], self.directions[chosen], self.size[chosen])

    def begins(self) -> Doubles:
        """(n, 3) of the rays on the device."""
        return np.asarray(self.origins - _BACK * self.size[:, None] * np.nan_to_num(self.directions))


class _Hits(NamedTuple):
    """triangle, ray (m,) and t (m,), sorted by ray and t."""

    triangle: Indices
    ray: Indices
    t: Doubles

    def chosen(self, by: NDArray[Any]) -> _Hits:
        """Those, or in that order."""
        return _Hits(self.triangle[by], self.ray[by], self.t[by])


class RayMeshIntersector:
    """Answers for one mesh as it is when it is asked: the first call, and the first after a change, builds a tree.

    mesh: a trimesh.Trimesh. scale_to_box: of trimesh's Embree engine, which loses hits without; rays and meshes are
    always moved and scaled for float32, so either will do. device: see `clrt devices`. Rays are as in `RayQuery`:
    origins and directions are (n, 3), or (3,) for all. UsageError for what is no mesh and for rays and points that do
    not fit.
    """

    def __init__(self, mesh: Any, scale_to_box: bool = True, *, device: str | int | None = None) -> None:
        """Builds nothing yet: a primitive has no faces before it is asked for them."""
        if not (hasattr(type(mesh), "vertices") and hasattr(type(mesh), "faces")):
            raise UsageError(f"mesh is a {type(mesh).__name__} and has no faces; give a trimesh.Trimesh, of a Scene "
                             "scene.to_mesh()")
        self.mesh = mesh
        self._device = device
        self._built: tuple[int, RayQuery] | None = None

    @property
    def query(self) -> RayQuery:
        """The query that answers, of the mesh as it is now."""
        now = hash(self.mesh)
        if self._built is None or self._built[0] != now:
            self._built = now, RayQuery(self.mesh.vertices, self.mesh.faces, device=self._device)
        return self._built[1]

    @with_default_errors
    def intersects_id(self, ray_origins: ArrayLike, ray_directions: ArrayLike, multiple_hits: bool = True,
                      max_hits: int | None = None, return_locations: bool = False) -> tuple[Any, ...]:
        """index_tri (m,) int64, index_ray (m,) int64, along each ray; if asked for, locations (m, 3) float64.

        One triangle of each place where a ray meets the mesh, an edge, a corner and surfaces that coincide being one,
        and up to `max_hits` of them if that is given; or of the first place alone.
        """
        rays = self._rays(ray_origins, ray_directions)
        hits = self._all(rays, max_hits) if multiple_hits else self._first(rays)
        if not return_locations:
            return hits.triangle, hits.ray
        t = hits.t[:, None]
        return hits.triangle, hits.ray, rays.origins[hits.ray] + t * rays.directions[hits.ray]

    def intersects_location(self, ray_origins: ArrayLike, ray_directions: ArrayLike, multiple_hits: bool = True,
                            max_hits: int | None = None) -> tuple[Doubles, Indices, Indices]:
        """locations (m, 3) float64, index_ray (m,) int64, index_tri (m,) int64: see `intersects_id`."""
        triangle, ray, locations = self.intersects_id(ray_origins, ray_directions, multiple_hits=multiple_hits,
                                                      max_hits=max_hits, return_locations=True)
        return locations, ray, triangle

    @with_default_errors
    def intersects_first(self, ray_origins: ArrayLike, ray_directions: ArrayLike) -> Indices:
        """(n,) int64: the first triangle that each ray meets, −1 where it meets none."""
        rays = self._rays(ray_origins, ray_directions)
        hits = self._first(rays)
        found = np.full(len(rays.size), -1, np.int64)
        found[hits.ray] = hits.triangle
        return found

    def intersects_any(self, ray_origins: ArrayLike, ray_directions: ArrayLike) -> Bools:
        """(n,) bool: whether each ray meets anything."""
        return self.intersects_first(ray_origins, ray_directions) >= 0

    @with_default_errors
    def contains_points(self, points: ArrayLike) -> Bools:
        """(n,) bool: whether points (n, 3) are inside, by trimesh's own rule: an odd number of places both ways."""
        places = real_array("points", points)
        if places.ndim != 2 or places.shape[1] != 3:
            raise UsageError(f"points {places.shape} must have the shape (n, 3)")
        # Here, not above: the module that is imported is of the same name as this one.
        from trimesh.ray.ray_util import contains_points

        return np.asarray(contains_points(self, places), np.bool_)

    def __getstate__(self) -> dict[str, Any]:
        """A copy for another process builds its own tree there."""
        return self.__dict__ | {"_built": None}

    def _rays(self, ray_origins: ArrayLike, ray_directions: ArrayLike) -> _Rays:
        origins, directions, _ = ray_arrays(ray_origins, ray_directions, np.inf)
        origins, directions = np.asarray(origins, np.float64), np.asarray(directions, np.float64)
        low, high = self.mesh.bounds if len(self.mesh.faces) else np.zeros((2, 3))
        size = np.maximum(np.linalg.norm(origins - (low + high) / 2, axis=1), np.linalg.norm(high - low))
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            lengths = size / np.linalg.norm(directions, axis=1)
        return _Rays(origins, directions, np.where(np.isfinite(lengths), lengths, 0.0))

    def _first(self, rays: _Rays) -> _Hits:
        """Of each ray that meets the mesh."""
        found = self.query.closest_hit(rays.begins(), rays.directions)
        t = found["t"] - _BACK * rays.size
        met, close = found["primitive"] >= 0, t < 2 * _BACK * rays.size      # maybe before the origin
        ray, others = np.flatnonzero(met & ~close), np.flatnonzero(met & close)
        hits = self._located(rays, found["primitive"][ray], ray, t[ray])
        if not len(others):
            return hits
        again = self._all(rays.of(others), 1)
        both = _Hits(*(np.append(a, b) for a, b in zip(hits, again._replace(ray=others[again.ray]))))
        return both.chosen(np.argsort(both.ray))

    def _all(self, rays: _Rays, most: int | None) -> _Hits:
        """Of each place that a ray meets, up to `most` of them."""
        ray, found = self.query.all_hits(rays.begins(), rays.directions, max_hits=len(self.mesh.faces) or 1)
        hits = self._located(rays, found["primitive"], ray, found["t"] - _BACK * rays.size[ray])
        hits = hits.chosen(np.lexsort((hits.t, hits.ray)))
        hits = hits.chosen(hits.t >= -_SAME * rays.size[hits.ray])
        hits = hits.chosen(self._places(rays, hits))
        if most is None:
            return hits
        return hits.chosen(np.arange(len(hits.ray)) - np.searchsorted(hits.ray, hits.ray) < most)

    def _located(self, rays: _Rays, triangle: NDArray[np.int32], ray: Indices, near: Doubles) -> _Hits:
        """At t where rays pass the planes of the triangles they meet, in float64; `near` is what float32 says.

        That stays where a ray grazes: moved by the rounding of float32, it would pass the plane somewhere else.
        """
        corners = np.asarray(self.mesh.vertices, np.float64)[np.asarray(self.mesh.faces)[triangle]]
        origins, directions, _ = rays.of(ray)
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        approach = (normals * directions).sum(axis=1)
        steep = np.abs(approach) > _GRAZING * np.linalg.norm(normals, axis=1) * np.linalg.norm(directions, axis=1)
        t = np.divide((normals * (corners[:, 0] - origins)).sum(axis=1), approach, out=near, where=steep)
        return _Hits(triangle.astype(np.int64), ray, t)

    def _places(self, rays: _Rays, hits: _Hits) -> Bools:
        """(m,) which hits are not where the one before is."""
        new, apart, size = np.ones(len(hits.ray), np.bool_), np.diff(hits.t), rays.size[hits.ray[1:]]
        corners = np.asarray(self.mesh.faces)[hits.triangle]
        normals = np.asarray(self.mesh.face_normals)[hits.triangle]
        enters = (normals * rays.directions[hits.ray]).sum(axis=1) < 0
        edge = (corners[1:, :, None] == corners[:-1, None, :]).any(axis=(1, 2)) & (enters[1:] == enters[:-1])
        new[1:] = (np.diff(hits.ray) > 0) | (apart > np.where(edge, _NEAR, _SAME) * size)
        return new
