"""The vertices that faces use."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.integer[Any]]


def used_indices(indices: Indices) -> tuple[Indices, Indices]:
    """Return the distinct indices, ascending, and the number of each index, (n,), among them, as `np.unique` does, but
    from a table, without sorting."""
    least = int(indices.min(initial=0))
    span = int(indices.max(initial=0)) - least + 1
    if span > 8 * len(indices):
        return np.unique(indices, return_inverse=True)
    offsets = indices - indices.dtype.type(least) if least else indices
    used = np.zeros(span, np.bool_)
    used[offsets] = True
    distinct = np.flatnonzero(used).astype(indices.dtype) + indices.dtype.type(least)
    if used.all():
        return distinct, offsets
    return distinct, (np.cumsum(used, dtype=indices.dtype) - indices.dtype.type(1))[offsets]
