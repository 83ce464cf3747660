"""Whole pictures are worked on some rows at a time, by all cores: what is made of a band stays in their caches."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from .tiles import TILE

#: So few that what is made of them, of the widest screens, is taken from memory that is there: larger arrays come anew
#: from the system each time, which took longer than all sums. And no tile is in two bands.
ROWS = TILE
T = TypeVar("T")


def in_bands(height: int, work: Callable[[slice], T]) -> list[T]:
    """What `work` returns for the rows of each band, from the top down; several run at a time."""
    bands = [slice(first, min(first + ROWS, height)) for first in range(0, height, ROWS)]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(work, bands))
