"""Cache misses of a stream of lines, from the times between uses of each line (Denning and Schwartz 1972)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .visits import Ints, Visits, dense, label
from .warps import LINE, VISITED, Warps, loaded

#: Lanes that share a first cache: 20 warps of 32, the most with the registers of queries.
RESIDENT = 640


@dataclass(frozen=True)
class MissCurve:
    """Misses of caches of every size with least-recently-used replacement, for a stream that is taken to repeat.

    late: the fraction of accesses that come later than w = 0, 1 … after the last use of their line; distinct: the mean
    number of lines among w = 1, 2 … accesses, which grows at that rate. A cache holds the lines of the largest w whose
    mean number of lines is at most its capacity.
    """

    late: NDArray[np.float64]
    distinct: NDArray[np.float64]

    def ratio(self, capacity: int) -> float:
        """Return the fraction of accesses that miss a cache of `capacity` lines."""
        window = int(np.searchsorted(self.distinct, capacity, side="right"))
        return float(self.late[window]) if window < len(self.late) else 0.0


def miss_curve(lines: Ints) -> MissCurve:
    """Return the misses of a stream of lines."""
    count = len(lines)
    if not count:
        return MissCurve(np.zeros(0), np.zeros(0))
    order = np.argsort(lines, kind="stable")
    ordered = lines[order]
    first = np.flatnonzero(np.r_[True, ordered[1:] != ordered[:-1]])
    last = np.r_[first[1:], count] - 1
    gaps = np.diff(order, prepend=0)
    gaps[first] = order[first] + count - order[last]
    late = 1 - np.cumsum(np.bincount(gaps, minlength=count + 1)) / count
    return MissCurve(late, np.cumsum(late))


def line_stream(visits: Visits, warps: Warps, layout: str, chosen: NDArray[np.bool_]) -> Ints:
    """Return the lines that passes of the chosen rays, (rays,), touch, each once per pass. As many warps as have
    RESIDENT lanes run together, turn by turn."""
    resident = RESIDENT // warps.width
    seen = np.flatnonzero(chosen[visits.ray])
    warp = warps.of_ray[visits.ray[seen]]
    columns = warp // resident, visits.turn[seen], warp % resident, visits.place[seen], visits.kind[seen]
    passes, bases, first = dense(label(*columns)), np.zeros(len(VISITED), np.int64), 0
    sizes = np.array([loaded(layout, kind) for kind in VISITED])
    for kind in VISITED:
        bases[kind] = first
        highest = visits.index[seen][visits.kind[seen] == kind].max(initial=0)
        first += (int(highest) + 1) * int(sizes[kind].max()) // LINE + 1
    kinds, distance, size = visits.kind[seen], *sizes[visits.kind[seen]].T
    start, loads = visits.index[seen] * distance, size > 0
    ends = np.concatenate([(bases[kinds] + at // LINE)[loads] for at in (start, start + size - 1)])
    return np.unique(label(np.tile(passes[loads], 2), ends)) % (int(ends.max(initial=0)) + 1)
