"""Check ray queries: closest hits, and whether anything is hit before some distance."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..device.open import Device
from ..queries.mesh import RayQuery
from .effort import effort, share
from .findings import Findings
from .star import SQUARES, Doubles, Rays, StarMesh, make_star, rays_from_elsewhere, rays_from_inside

ELSEWHERE = 300
#: Minimum squares along an edge of the surface, and minimum rays from inside, on a slow device.
FEW_SQUARES, FEW_RAYS = 4, 64
#: Error limit: a hit point results from some 30 operations on coordinates, each of which may round.
ROUNDINGS = 30.0


def check_rays(device: Device, findings: Findings) -> None:
    """Check the device's own layout with coherent and shuffled rays, which are traversed in different orders."""
    star = _star(device)
    query, inside = _query(device, star), _rays(device, star)
    for rays in (inside, _shuffled(inside), rays_from_elsewhere(star, share(device, ELSEWHERE, FEW_RAYS))):
        _check_hits(query, star, rays, findings)


def check_binary_tree(device: Device, findings: Findings) -> None:
    """Check the plain binary BVH."""
    star = _star(device)
    _check_hits(_query(device, star, layout="bvh2"), star, _shuffled(_rays(device, star)), findings)


def check_tree_builder(device: Device, findings: Findings) -> None:
    """Check a BVH built on the device: its hits must equal those of one built in numpy, to the bit."""
    star = _star(device)
    rays = _shuffled(_rays(device, star))
    built = _check_hits(_query(device, star, builder="ploc"), star, rays, findings)
    other = _query(device, star, builder="sah").closest_hit(rays.origins, rays.directions)
    findings.expect(built == other, "hits in the BVH built by the device", ("gave", built), ("numpy's", other))


def _star(device: Device) -> StarMesh:
    """Return a surface with as many triangles as suit the device."""
    return make_star(2 * max(FEW_SQUARES // 2, round(SQUARES // 2 * effort(device) ** 0.5)))


def _rays(device: Device, star: StarMesh) -> Rays:
    """Return rays from inside through all parts of each triangle, or an evenly spaced subset for a slow device."""
    rays = rays_from_inside(star)
    n = len(rays.t)
    return rays.take(np.linspace(0, n - 1, share(device, n, FEW_RAYS)).astype(np.int64))


def _shuffled(rays: Rays) -> Rays:
    return rays.take(np.random.default_rng(10).permutation(len(rays.t)))


def _query(device: Device, star: StarMesh, **options: Any) -> RayQuery:
    return RayQuery(star.vertices, star.faces, device=device.info.id, **options)


def _check_hits(query: RayQuery, star: StarMesh, rays: Rays, findings: Findings) -> NDArray[Any]:
    """Check whether, what and where each ray hits, also with rays that end before or behind it; return the hits."""
    hits = query.closest_hit(rays.origins, rays.directions)
    hit = np.isfinite(rays.t)
    shown = ("from", rays.origins), ("along", rays.directions), ("gave", hits)
    findings.expect((hits["primitive"] >= 0) == hit, "whether a ray hits", *shown)
    met = star.faces[np.maximum(hits["primitive"], 0)]
    right = np.all(np.any(met[:, :, None] == rays.corners[:, None, :], axis=1), axis=1)
    findings.expect(right | ~hit, "which triangle a ray hits", *shown)
    tree = f"hit in {query.tree.name} by {query.tree.builder}"
    findings.at_most(ROUNDINGS, _errors(star, rays, hits), tree, "roundings", rays.origins, rays.directions, hits)
    for part, where in ((0.875, "before"), (1.125, "behind")):
        blocked = query.any_hit(rays.origins, rays.directions, part * rays.t)
        first = query.closest_hit(rays.origins, rays.directions, part * rays.t)["primitive"]
        findings.expect(blocked == (hit & (part > 1)), f"any hit of a ray that ends {where} it", *shown)
        findings.expect((first >= 0) == (hit & (part > 1)), f"first hit of a ray that ends {where} it", *shown)
    return hits


def _errors(star: StarMesh, rays: Rays, hits: NDArray[Any]) -> Doubles:
    """Return the distances of the points at t and at (u, v) from the exact hit, (n,), in coordinate roundings."""
    both = np.isfinite(rays.t) & (hits["primitive"] >= 0)
    t, t_exact = np.where(both, hits["t"], 0.0)[:, None], np.where(both, rays.t, 0.0)[:, None]
    u, v = hits["u"].astype(np.float64), hits["v"].astype(np.float64)
    corners = star.vertices[star.faces[np.maximum(hits["primitive"], 0)]]
    inside = np.einsum("nk,nkx->nx", np.stack([1 - u - v, u, v], axis=1), corners)
    along = rays.origins + t_exact * rays.directions
    errors = np.maximum(np.abs((t - t_exact) * rays.directions), np.abs(inside - along) * both[:, None]).max(axis=1)
    return np.asarray(errors / (np.abs(star.vertices).max() * 2.0**-24), np.float64)
