"""Parallel processing of whole images in bands of rows: the intermediate results of a band stay in the CPU caches."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from ...threads import in_parallel
from ..cancellation import NEVER, CancellationToken
from .tiles import TILE

#: Approximate pixels per band: small enough for intermediate arrays to reuse memory already allocated. Larger ones are
#: newly mapped by the system each time, which took longer than all sums.
PIXELS = 1 << 15
T = TypeVar("T")


def bands_of(size: tuple[int, ...]) -> list[slice]:
    """Return the rows of each band of an image, (height, width, …), from the top down. Bands do not split tiles."""
    height, width = size[:2]
    step = max(1, PIXELS // (width * TILE)) * TILE
    return [slice(first, min(first + step, height)) for first in range(0, height, step)]


def in_bands(size: tuple[int, ...], work: Callable[[slice], T], token: CancellationToken = NEVER) -> list[T]:
    """Return the results of `work` for the rows of each band, run in parallel; the token is checked before each."""

    def checked(rows: slice) -> T:
        token.check()
        return work(rows)

    return in_parallel(checked, bands_of(size))
