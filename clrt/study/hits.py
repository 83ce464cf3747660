"""Whether answers depend on what they must not (the tree's layout and builder, the traversal, the device), and
whether float64 says the same."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..accel.kernels import BUILDER_NAMES, TREELESS, TREES
from ..device.discover import choose, find_devices
from ..errors import ClrtError, UsageError
from ..query import RayQuery
from ..tree_query import TRAVERSALS
from .aimed import all_rays, rays_of_kinds
from .exact import UNDECIDED, areas, closest_bounds
from .rays import Rays, differing, every
from .shapes import icosphere, soup
from .workloads import Mesh, bumpy_ball


class Effort(NamedTuple):
    """rays: of each kind; subdivisions: of the meshes; soup: its triangles.

    list_tests, exact_tests: most rays times triangles without a tree and in float64; where all rays would be more, as
    many are taken evenly out of them.
    """

    rays: int
    subdivisions: int
    soup: int
    list_tests: int
    exact_tests: int


FULL, QUICK = Effort(1 << 18, 6, 3000, 1 << 28, 1 << 29), Effort(1 << 12, 3, 300, 1 << 23, 1 << 23)


class Case(NamedTuple):
    """A mesh; closed: all rays from its inside hit it."""

    name: str
    mesh: Mesh
    closed: bool


class Way(NamedTuple):
    """How rays are answered. device: an index."""

    device: int
    layout: str
    builder: str
    traversal: str


def measure_hits(*, quick: bool = False, device: str | int | None = None) -> Iterator[dict[str, Any]]:
    """The figures of `clrt bench hits`, mesh by mesh: see `measure_case`. device: left out, all but simulators."""
    devices = [choose(device)[0].index] if device is not None else [
        info.index for info, _ in find_devices() if info.usable and info.type != "simulator"]
    effort = QUICK if quick else FULL
    for case in (Case("icosphere", icosphere(effort.subdivisions), True),
                 Case("bumpy ball", bumpy_ball(effort.subdivisions), True), Case("soup", soup(effort.soup), False)):
        yield measure_case(case, devices, effort)


def measure_case(case: Case, devices: list[int], effort: Effort) -> dict[str, Any]:
    """Of one mesh `ways`, `exact`, escaped: rays from its inside that hit nothing; flat: hits where there is no area.

    ways: of each, how many rays it answered (`rays`), and for how many of each kind (`differ`) t, primitive, u and v
    are not bit by bit the first way's, or any_hit is not what they say; or the `error` it ended in. exact: how many of
    the first way's answers float64 was asked for (`rays`), for how many of these only one is possible (`decided`), and
    how many are impossible (`wrong`).
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
            continue    # not every builder makes every layout
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
        result |= {"exact": _checked(case.mesh, rays, first, -(-len(names) * triangles // effort.exact_tests)),
                   "escaped": int(np.sum(inside & (first["primitive"] < 0))) if case.closed else None,
                   "flat": int(np.sum(_on_flat(case.mesh, first)))}
    return result


def _ways(devices: list[int]) -> Iterator[Way]:
    """The first one is what all others are compared with."""
    for device in devices:
        for layout in TREES:
            for builder in ("sah",) if layout in TREELESS else BUILDER_NAMES:
                for traversal in TRAVERSALS if layout == "bvh8" else ("single",):
                    yield Way(device, layout, builder, traversal)


def _answers(mesh: Mesh, way: Way, rays: Rays) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    query = RayQuery(*mesh, device=way.device, layout=way.layout, builder=way.builder, traversal=way.traversal)
    return query.closest_hit(*rays), query.any_hit(*rays)


def _checked(mesh: Mesh, rays: Rays, hits: NDArray[Any], step: int) -> dict[str, int]:
    """Of one ray of `step`; hits on what has no area, which float64 never meets, are counted apart."""
    some, found = every(step, rays), hits[::step]
    bounds = closest_bounds(*mesh, some)
    return {"rays": len(bounds.low), "decided": int(np.sum(bounds.primitive != UNDECIDED)),
            "wrong": int(np.sum(bounds.wrong(some, found) & ~_on_flat(mesh, found)))}


def _on_flat(mesh: Mesh, hits: NDArray[Any]) -> NDArray[np.bool_]:
    """Which hits are on triangles whose corners lie in one line: they close the seam between their neighbours."""
    flat = np.append(areas(mesh[0][mesh[1]].astype(np.float64)) == 0, False)
    return np.asarray(flat[hits["primitive"]])
