"""Warps in lockstep: which lanes work together in the megakernel and in queues, and what their passes load.

A pass is one execution of a body of code by a warp: all lanes that are at it run together, the others idle. Lanes are
together at the turns of their traversals: at turn k all lanes that are in their k-th turn visit a node, then all that
test a first primitive do so, then all that test a second one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...accel.cwbvh import CWBVH_NODE
from ...accel.layouts import BVH2_NODE, LEAF_SPHERE, LEAF_TRIANGLE
from ...accel.two_level import INSTANCE
from .visits import CONNECT, EXTEND, INSTANCES, LEAVES, NODES, SPHERES, TESTS, Ints, Visits, dense, label

#: Bytes of a cache line, and of the pieces of a record that lanes load one after another.
LINE, PIECE = 128, 16
#: Bits of a material's code that are its type.
TYPE_BITS = 15
VISITED = (NODES, LEAVES, TESTS, SPHERES, INSTANCES)


@dataclass(frozen=True)
class Warps:
    """Warps of all rays and shaded surfaces: lanes with the same number run in lockstep. Warps with neighboring numbers
    run at about the same time. width: lanes of a warp."""

    width: int
    of_ray: Ints
    of_surface: Ints


@dataclass(frozen=True)
class Passes:
    """Passes of one kind. lanes: those that work, over all passes; lines: distinct cache lines, over all loads of a
    piece; touched: distinct lines of whole records."""

    passes: int = 0
    lanes: int = 0
    lines: int = 0
    touched: int = 0

    def utilisation(self, width: int) -> float:
        """Return the fraction of lanes that work."""
        return self.lanes / (width * self.passes) if self.passes else 1.0


def in_paths(visits: Visits, width: int, position: Ints | None = None) -> Warps:
    """Return the warps of a megakernel: `width` paths next to each other, whose segments are in lockstep.

    position: of each path; by default in the order recorded.
    """
    place = np.arange(visits.paths) if position is None else position
    warp = place // width
    return Warps(
        width,
        dense(label(visits.segment, visits.stage, visits.number, warp[visits.path])),
        dense(label(visits.shaded_segment, warp[visits.shaded_path])),
    )


def in_queues(visits: Visits, width: int, position: Ints | None = None, *, by_material: bool = False) -> Warps:
    """Return the warps of queues: of each segment, the rays to extend, surfaces to shade and rays to lights are
    compacted, in their order. by_material: surfaces are sorted by type of material, and stay in that order."""
    place = np.arange(visits.paths) if position is None else position.copy()
    of_ray, of_surface = np.zeros(visits.rays, np.int64), np.zeros(len(visits.material), np.int64)
    first = 0
    for segment in range(int(visits.segment.max(initial=-1)) + 1):
        first = _fill(of_ray, (visits.segment == segment) & (visits.stage == EXTEND), visits, place, width, first)
        chosen = np.flatnonzero(visits.shaded_segment == segment)
        shaded = visits.shaded_path[chosen]
        if by_material:
            order = np.lexsort((place[shaded], visits.material[chosen] & TYPE_BITS))
            place[shaded[order]] = np.arange(len(order))
        ranks = np.empty(len(chosen), np.int64)
        ranks[np.argsort(place[shaded])] = np.arange(len(chosen))
        of_surface[chosen] = segment * visits.paths + ranks // width
        first = _fill(of_ray, (visits.segment == segment) & (visits.stage == CONNECT), visits, place, width, first)
    return Warps(width, dense(of_ray), dense(of_surface))


def _fill(warps: Ints, chosen: NDArray[np.bool_], visits: Visits, place: Ints, width: int, first: int) -> int:
    """Number the warps of a queue of the chosen rays from `first` on; return the next number. A path's rays of a stage
    follow each other in its lane."""
    path, number = visits.path[chosen], visits.number[chosen]
    queued = np.unique(path)
    ranks = np.zeros(visits.paths, np.int64)
    ranks[queued[np.argsort(place[queued])]] = np.arange(len(queued))
    warps[chosen] = first + label(ranks[path] // width, number)
    return first + int(label(ranks[path] // width, number).max(initial=-1)) + 1


def traversal_passes(visits: Visits, warps: Warps, layout: str, chosen: NDArray[np.bool_]) -> dict[int, Passes]:
    """Return the passes of the chosen rays, (rays,), by kind of visit."""
    seen = chosen[visits.ray]
    columns = warps.of_ray[visits.ray[seen]], visits.turn[seen], visits.place[seen], visits.kind[seen]
    _, first, passes = np.unique(label(*columns), return_index=True, return_inverse=True)
    kind, index, result = visits.kind[seen], visits.index[seen], {}
    for each in VISITED:
        own = kind == each
        distance, size = loaded(layout, each)
        starts = index[own] * distance
        pieces = [label(passes[own], (starts + at) // LINE) for at in range(0, size, PIECE)]
        result[each] = Passes(
            int(np.count_nonzero(kind[first] == each)),
            int(np.count_nonzero(own)),
            sum(len(np.unique(piece)) for piece in pieces),
            len(np.unique(np.concatenate(pieces[:1] + pieces[-1:]))) if pieces else 0,
        )
    return result


def shading_passes(visits: Visits, warps: Warps) -> Passes:
    """Return the passes of shading: a warp runs once for each type of material that its lanes meet."""
    types = label(warps.of_surface, visits.material & TYPE_BITS)
    return Passes(len(np.unique(types)), len(types), 0, 0)


def loaded(layout: str, kind: int) -> tuple[int, int]:
    """Return the distance in bytes between records and the bytes that a visit loads: for bvh2 both children's nodes,
    and nothing more for a leaf."""
    if kind == NODES:
        return (CWBVH_NODE.itemsize,) * 2 if layout == "cwbvh" else (BVH2_NODE.itemsize, 2 * BVH2_NODE.itemsize)
    record = {TESTS: LEAF_TRIANGLE, SPHERES: LEAF_SPHERE, INSTANCES: INSTANCE}.get(kind)
    return (record.itemsize,) * 2 if record is not None else (0, 0)
