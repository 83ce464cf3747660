"""Whether hits are independent of BVH layout, builder, traversal and device, and agree with float64."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...accel.methods import TREELESS
from ...accel.traversal_kernels import BUILDER_NAMES, TREES
from ...device.discovery.discover import choose, find_devices
from ...errors import ClrtError, UsageError
from ...queries.mesh import RayQuery
from ...queries.query_program import TRAVERSALS
from ..rays.hard_meshes import icosphere, soup
from ..rays.ray_speed import Rays, differing, every
from ..rays.workloads import Mesh, bumpy_ball
from .aimed_rays import all_rays, rays_of_kinds
from .exact_hits import UNDECIDED, areas, closest_bounds


class Effort(NamedTuple):
    """Extent of a measurement. rays: per kind; subdivisions: of the meshes; soup: its number of triangles.

    list_tests, exact_tests: most rays times triangles for brute force and for float64; beyond that, an evenly spaced
    subset of the rays is used.
    """

    rays: int
    subdivisions: int
    soup: int
    list_tests: int
    exact_tests: int


FULL, QUICK = Effort(1 << 18, 6, 3000, 1 << 28, 1 << 29), Effort(1 << 12, 3, 300, 1 << 23, 1 << 23)


class Case(NamedTuple):
    """A mesh. closed: all rays from its inside hit it."""

    name: str
    mesh: Mesh
    closed: bool


class Way(NamedTuple):
    """Configuration of a query. device: an index."""

    device: int
    layout: str
    builder: str
    traversal: str


def measure_hits(*, quick: bool = False, device: str | int | None = None) -> Iterator[dict[str, Any]]:
    """Yield the results of `clrt bench hits` by mesh: see `measure_case`. device: default all except simulators."""
    devices = (
        [choose(device)[0].index]
        if device is not None
        else [info.index for info, _ in find_devices() if info.usable and info.type != "simulator"]
    )
    effort = QUICK if quick else FULL
    for case in cases(effort):
        yield measure_case(case, devices, effort)


def cases(effort: Effort) -> Iterator[Case]:
    """Yield the meshes of this extent."""
    yield Case("icosphere", icosphere(effort.subdivisions), True)
    yield Case("bumpy ball", bumpy_ball(effort.subdivisions), True)
    yield Case("soup", soup(effort.soup), False)


def measure_case(case: Case, devices: list[int], effort: Effort) -> dict[str, Any]:
    """Measure one mesh: `ways`, `exact`; escaped: rays from its inside that miss; flat: hits on triangles of zero area.

    ways: for each configuration the number of rays (`rays`), and by kind (`differ`) for how many of them t, primitive,
    u and v are not bitwise equal to the first configuration's, or any_hit contradicts them; or the `error` that
    occurred. exact: how many of the first configuration's hits were compared with float64 (`rays`), how many of these
    have a single possible result (`decided`), and how many are impossible (`wrong`). digests: SHA-256 of the rays and
    of the first configuration's hits, to compare with another machine's.
    """
    kinds = rays_of_kinds(*case.mesh, effort.rays)
    rays, triangles = all_rays(kinds), len(case.mesh[1])
    names = np.repeat(np.arange(len(kinds)), effort.rays)
    first, ways = None, []
    for way in _ways(devices):
        step = -(-len(names) * triangles // effort.list_tests) if way.layout in TREELESS else 1
        try:
            hits, blocked = _answers(case.mesh, way, every(step, rays))
        except UsageError:
            continue  # not every builder supports every layout
        except ClrtError as error:
            ways.append({**way._asdict(), "error": str(error)})
            continue
        first = hits if first is None else first
        changed = differing(first[::step], hits) | (blocked != (hits["primitive"] >= 0))
        differ = np.bincount(names[::step][changed], minlength=len(kinds))
        ways.append({**way._asdict(), "rays": len(hits), "differ": dict(zip(kinds, differ.tolist()))})
    result = {"mesh": case.name, "triangles": triangles, "kinds": list(kinds), "rays": len(names), "ways": ways}
    if first is not None:
        inside = np.isin(names, [list(kinds).index(kind) for kind in ("vertices", "edges")])
        result |= {
            "exact": _checked(case.mesh, rays, first, -(-len(names) * triangles // effort.exact_tests)),
            "escaped": int(np.sum(inside & (first["primitive"] < 0))) if case.closed else None,
            "flat": int(np.sum(_on_flat(case.mesh, first))),
            "digests": {"rays": _digest(*case.mesh, *rays), "hits": _digest(first)},
        }
    return result


def _ways(devices: list[int]) -> Iterator[Way]:
    """Yield all configurations; the first is the reference of the others."""
    for device in devices:
        for layout in TREES:
            for builder in ("sah",) if layout in TREELESS else BUILDER_NAMES:
                for traversal in TRAVERSALS if layout == "bvh8" else ("single",):
                    yield Way(device, layout, builder, traversal)


def _answers(mesh: Mesh, way: Way, rays: Rays) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    query = RayQuery(*mesh, device=way.device, layout=way.layout, builder=way.builder, traversal=way.traversal)
    return query.closest_hit(*rays), query.any_hit(*rays)


def _checked(mesh: Mesh, rays: Rays, hits: NDArray[Any], step: int) -> dict[str, int]:
    """Check every step-th ray. Hits on zero-area triangles, which float64 never reports, are counted separately."""
    some, found = every(step, rays), hits[::step]
    bounds = closest_bounds(*mesh, some)
    return {
        "rays": len(bounds.low),
        "decided": int(np.sum(bounds.primitive != UNDECIDED)),
        "wrong": int(np.sum(bounds.wrong(some, found) & ~_on_flat(mesh, found))),
    }


def _digest(*arrays: NDArray[Any]) -> str:
    digest = hashlib.sha256()
    for array in arrays:
        digest.update(array.tobytes())
    return digest.hexdigest()


def _on_flat(mesh: Mesh, hits: NDArray[Any]) -> NDArray[np.bool_]:
    """Return which hits are on triangles with collinear vertices: they close the seam between their neighbors."""
    flat = np.append(areas(mesh[0][mesh[1]].astype(np.float64)) == 0, False)
    return np.asarray(flat[hits["primitive"]])
