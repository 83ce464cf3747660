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
from .queries.mesh import RayQuery
from .scene.fields.number_arrays import real_array
from .scene.geometry.ray_arrays import ray_arrays

__all__ = ["RayMeshIntersector"]

Bools = NDArray[np.bool_]
Doubles = NDArray[np.float64]
Indices = NDArray[np.int64]
#: Hits of a ray count as one location if they are closer than this fraction of the mesh's size.
_SAME = 1e-8
#: Hits on triangles that share a vertex and face the same way count as one if closer than this fraction of size and
#: distance: in float32 a ray through an edge hits both, though in float64 it may cross a plane outside its triangle.
_NEAR = 1e-6
#: Rays start this fraction of the mesh's size, or of their distance, before their origins, which may lie on the mesh.
_BACK = 1e-6
#: Sine of the angle to a plane below which a ray is grazing.
_GRAZING = 1e-4


class _Rays(NamedTuple):
    """origins, directions (n, 3); size (n,): mesh size or distance, if larger, in units of the direction's length."""

    origins: Doubles
    directions: Doubles
    size: Doubles

    def of(self, chosen: Indices) -> _Rays:
        """Return a selection of the rays."""
        return _Rays(self.origins[chosen], self.directions[chosen], self.size[chosen])

    def begins(self) -> Doubles:
        """Return the origins (n, 3) used on the device."""
        return np.asarray(self.origins - _BACK * self.size[:, None] * np.nan_to_num(self.directions))


class _Hits(NamedTuple):
    """triangle, ray (m,) and t (m,), sorted by ray and t."""

    triangle: Indices
    ray: Indices
    t: Doubles

    def chosen(self, by: NDArray[Any]) -> _Hits:
        """Return a selection or reordering of the hits."""
        return _Hits(self.triangle[by], self.ray[by], self.t[by])


class RayMeshIntersector:
    """Ray queries on one mesh in its current state: the first call, and the first after a change, builds a BVH.

    mesh: a trimesh.Trimesh. scale_to_box: for compatibility with trimesh's Embree engine, which loses hits without it;
    ignored, as rays and meshes are always translated and scaled for float32. device: see `clrt devices`. Rays are as in
    `RayQuery`: origins and directions are (n, 3), or (3,) for all. Raises UsageError if `mesh` is not a mesh, and if
    the shapes of rays or points do not match.
    """

    def __init__(self, mesh: Any, scale_to_box: bool = True, *, device: str | int | None = None) -> None:
        """Build nothing yet: a trimesh primitive creates its faces on first access."""
        if not (hasattr(type(mesh), "vertices") and hasattr(type(mesh), "faces")):
            raise UsageError(
                f"mesh is a {type(mesh).__name__} and has no faces; give a trimesh.Trimesh, for a Scene scene.to_mesh()"
            )
        self.mesh = mesh
        self._device = device
        self._built: tuple[int, RayQuery] | None = None

    @property
    def query(self) -> RayQuery:
        """Return the query for the mesh in its current state."""
        now = hash(self.mesh)
        if self._built is None or self._built[0] != now:
            self._built = now, RayQuery(self.mesh.vertices, self.mesh.faces, device=self._device)
        return self._built[1]

    @with_default_errors
    def intersects_id(
        self,
        ray_origins: ArrayLike,
        ray_directions: ArrayLike,
        multiple_hits: bool = True,
        max_hits: int | None = None,
        return_locations: bool = False,
    ) -> tuple[Any, ...]:
        """Return index_tri, index_ray (m,) int64, sorted along each ray; optionally locations (m, 3) float64.

        Returns one triangle per location where a ray hits the mesh; an edge, a vertex and coincident surfaces are one
        location. multiple_hits: all locations, or `max_hits` if given; otherwise the first one.
        """
        rays = self._rays(ray_origins, ray_directions)
        hits = self._all(rays, max_hits) if multiple_hits else self._first(rays)
        if not return_locations:
            return hits.triangle, hits.ray
        t = hits.t[:, None]
        return hits.triangle, hits.ray, rays.origins[hits.ray] + t * rays.directions[hits.ray]

    def intersects_location(
        self, ray_origins: ArrayLike, ray_directions: ArrayLike, multiple_hits: bool = True, max_hits: int | None = None
    ) -> tuple[Doubles, Indices, Indices]:
        """Return locations (m, 3) float64, index_ray (m,) int64, index_tri (m,) int64: see `intersects_id`."""
        triangle, ray, locations = self.intersects_id(
            ray_origins, ray_directions, multiple_hits=multiple_hits, max_hits=max_hits, return_locations=True
        )
        return locations, ray, triangle

    @with_default_errors
    def intersects_first(self, ray_origins: ArrayLike, ray_directions: ArrayLike) -> Indices:
        """Return (n,) int64: the first triangle that each ray hits, −1 for a miss."""
        rays = self._rays(ray_origins, ray_directions)
        hits = self._first(rays)
        found = np.full(len(rays.size), -1, np.int64)
        found[hits.ray] = hits.triangle
        return found

    def intersects_any(self, ray_origins: ArrayLike, ray_directions: ArrayLike) -> Bools:
        """Return (n,) bool: whether each ray hits anything."""
        return self.intersects_first(ray_origins, ray_directions) >= 0

    @with_default_errors
    def contains_points(self, points: ArrayLike) -> Bools:
        """Return (n,) bool: whether points (n, 3) are inside, by trimesh's rule: an odd number of hits both ways."""
        places = real_array("points", points)
        if places.ndim != 2 or places.shape[1] != 3:
            raise UsageError(f"points {places.shape} must have the shape (n, 3)")
        # A local import, since the imported module has the same name as this one.
        from trimesh.ray.ray_util import contains_points

        return np.asarray(contains_points(self, places), np.bool_)

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without the query, which a copy in another process builds anew."""
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
        """Return the first hit of each ray that hits the mesh."""
        found = self.query.closest_hit(rays.begins(), rays.directions)
        t = found["t"] - _BACK * rays.size
        met, close = found["primitive"] >= 0, t < 2 * _BACK * rays.size  # perhaps before the origin
        ray, others = np.flatnonzero(met & ~close), np.flatnonzero(met & close)
        hits = self._located(rays, found["primitive"][ray], ray, t[ray])
        if not len(others):
            return hits
        again = self._all(rays.of(others), 1)
        both = _Hits(*(np.append(a, b) for a, b in zip(hits, again._replace(ray=others[again.ray]))))
        return both.chosen(np.argsort(both.ray))

    def _all(self, rays: _Rays, most: int | None) -> _Hits:
        """Return one hit per location along each ray, up to `most` of them."""
        ray, found = self.query.all_hits(rays.begins(), rays.directions, max_hits=len(self.mesh.faces) or 1)
        hits = self._located(rays, found["primitive"], ray, found["t"] - _BACK * rays.size[ray])
        hits = hits.chosen(np.lexsort((hits.t, hits.ray)))
        hits = hits.chosen(hits.t >= -_SAME * rays.size[hits.ray])
        hits = hits.chosen(self._places(rays, hits))
        if most is None:
            return hits
        return hits.chosen(np.arange(len(hits.ray)) - np.searchsorted(hits.ray, hits.ray) < most)

    def _located(self, rays: _Rays, triangle: NDArray[np.int32], ray: Indices, near: Doubles) -> _Hits:
        """Compute hits with t in float64, at the planes of the triangles that rays hit; `near` is the float32 t.

        That is kept for grazing rays: the rounding to float32 would move their intersection with the plane far away.
        """
        corners = np.asarray(self.mesh.vertices, np.float64)[np.asarray(self.mesh.faces)[triangle]]
        origins, directions, _ = rays.of(ray)
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        approach = (normals * directions).sum(axis=1)
        steep = np.abs(approach) > _GRAZING * np.linalg.norm(normals, axis=1) * np.linalg.norm(directions, axis=1)
        t = np.divide((normals * (corners[:, 0] - origins)).sum(axis=1), approach, out=near, where=steep)
        return _Hits(triangle.astype(np.int64), ray, t)

    def _places(self, rays: _Rays, hits: _Hits) -> Bools:
        """Return (m,) which hits are at a different location than the one before."""
        new, apart, size = np.ones(len(hits.ray), np.bool_), np.diff(hits.t), rays.size[hits.ray[1:]]
        corners = np.asarray(self.mesh.faces)[hits.triangle]
        normals = np.asarray(self.mesh.face_normals)[hits.triangle]
        enters = (normals * rays.directions[hits.ray]).sum(axis=1) < 0
        edge = (corners[1:, :, None] == corners[:-1, None, :]).any(axis=(1, 2)) & (enters[1:] == enters[:-1])
        new[1:] = (np.diff(hits.ray) > 0) | (apart > np.where(edge, _NEAR, _SAME) * size)
        return new
