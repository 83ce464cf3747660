"""Whole pictures are worked on some rows at a time, by all cores: what is made of a band stays in their caches."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from ..threads import in_parallel
from .tiles import TILE

#: Pixels of a band, about: so few that what is made of them is taken from memory that is there. Larger arrays come anew
#: from the system each time, which took longer than all sums.
PIXELS = 1 << 15
T = TypeVar("T")


class Unwanted(Exception):
    """Nobody waits any more for what was being made of a picture."""


def bands_of(size: tuple[int, ...]) -> list[slice]:
    """The rows of each band of a picture, (height, width, …), from the top down. No tile is in two."""
    height, width = size[:2]
    step = max(1, PIXELS // (width * TILE)) * TILE
    return [slice(first, min(first + step, height)) for first in range(0, height, step)]


def in_bands(size: tuple[int, ...], work: Callable[[slice], T], unwanted: Callable[[], bool] = lambda: False,
             ) -> list[T]:
    """What `work` returns for the rows of each band of a picture; several run at a time. Unwanted as soon as it is."""
    def wanted(rows: slice) -> T:
        if unwanted():
            raise Unwanted
        return work(rows)

    return in_parallel(wanted, bands_of(size))
