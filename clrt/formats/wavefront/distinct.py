"""Distinct combinations of indices, numbered without sorting them all."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..used_indices import used_indices

Ints = NDArray[np.int64]
Indices = NDArray[np.integer[Any]]


def distinct(rows: Indices) -> tuple[Indices, Indices]:
    """Return each row's number, (n,), among the distinct rows, and these, (k, 3), in ascending order.

    rows: (n, 3), not negative. In most models nearly all vertices occur in one combination only, found by a table; the
    others are sorted.
    """
    vertices, vertex = used_indices(rows[:, 0])
    several, others = np.zeros(len(vertices), np.bool_), list[Indices]()
    for column in rows.T[1:]:
        other = np.zeros(len(vertices), column.dtype)
        other[vertex] = column
        several[vertex[other[vertex] != column]] = True
        others.append(other)
    every = np.stack([vertices, *others], axis=1)
    if not several.any():
        return vertex, every
    sorted_rows = np.flatnonzero(several[vertex])
    number, second, third = vertex[sorted_rows], *rows[sorted_rows, 1:].T.astype(np.int64)
    factor = int(third.max()) + 1
    (first, pair), rank = _distinct_pairs(number.astype(np.int64), second * factor + third)
    counts = np.ones(len(vertices), np.int64)
    counts[several] = np.bincount(first, minlength=len(vertices))[several]
    place = np.repeat(np.arange(len(vertices)), counts)
    places_of_several = np.flatnonzero(several[place])
    every = every[place]
    every[places_of_several, 1:] = np.stack([pair // factor, pair % factor], axis=1)
    numbers = (np.cumsum(counts) - counts)[vertex]
    numbers[sorted_rows] = places_of_several[rank]
    return numbers, every


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
