"""Distinct combinations of indices, numbered without sorting them all."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]


def distinct(rows: NDArray[np.integer[Any]]) -> tuple[Ints, Ints]:
    """Return each row's number, (n,), among the distinct rows, and these, (k, 3), in ascending order.

    rows: (n, 3), not negative. In most models nearly all vertices occur in one combination only, found by a table; the
    others are sorted.
    """
    vertices, vertex = _used(rows[:, 0])
    others, factor = rows[:, 1].astype(np.int64), int(rows[:, 2].max(initial=0)) + 1
    pairs = others * factor + rows[:, 2]
    pair_of = np.zeros(len(vertices), np.int64)
    pair_of[vertex] = pairs
    several = np.zeros(len(vertices), np.bool_)
    several[vertex[pair_of[vertex] != pairs]] = True
    sorted_rows = np.flatnonzero(several[vertex])
    found, rank = _distinct_pairs(vertex[sorted_rows], pairs[sorted_rows])
    counts = np.ones(len(vertices), np.int64)
    counts[several] = np.bincount(found[0], minlength=len(vertices))[several]
    place = np.repeat(np.arange(len(vertices)), counts)
    pair_of = pair_of[place]
    places_of_several = np.flatnonzero(several[place])
    pair_of[places_of_several] = found[1]
    numbers = (np.cumsum(counts) - counts)[vertex]
    numbers[sorted_rows] = places_of_several[rank]
    return numbers, np.stack([vertices[place], pair_of // factor, pair_of % factor], axis=1)


def _used(indices: NDArray[np.integer[Any]]) -> tuple[Ints, Ints]:
    """Return the distinct indices, ascending, and the number of each index among them."""
    least = int(indices.min(initial=0))
    span = int(indices.max(initial=0)) - least + 1
    if span > 8 * len(indices):
        return np.unique(indices, return_inverse=True)
    used = np.zeros(span, np.bool_)
    used[indices - least] = True
    return np.flatnonzero(used) + least, (np.cumsum(used) - 1)[indices - least]


def _distinct_pairs(first: Ints, second: Ints) -> tuple[Ints, Ints]:
    """Return the distinct pairs, (2, k), ascending, and the number of each pair among them."""
    seconds, number = np.unique(second, return_inverse=True)
    keys = first * len(seconds) + number
    order = np.argsort(keys)
    ordered = keys[order]
    new = np.diff(ordered, prepend=-1) > 0
    rank = np.empty_like(order)
    rank[order] = np.cumsum(new) - 1
    kept = order[new]
    return np.stack([first[kept], second[kept]]), rank
