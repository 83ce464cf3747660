"""Which tiles get which samples next: the work in hand, which is cut into launches. Knows nothing of devices."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


class Part(NamedTuple):
    """Tiles first … end − 1 of those in hand get `more` samples beside the `samples` they have."""

    first: int
    end: int
    samples: int
    more: int


class Work:
    """What has been rendered, and what is to be rendered before anything else is chosen.

    samples: (rows, columns) that the pixels of each tile have, or had before the work in hand; then: what they will
    have after it. tiles: uint32 numbers of those in hand, in their order on the device.
    """

    def __init__(self, samples: NDArray[np.int64]) -> None:
        self.samples = self.then = samples
        self.tiles = np.zeros(0, np.uint32)
        self.parts: deque[Part] = deque()

    def take(self, tiles: NDArray[np.integer[Any]], parts: Iterable[Part]) -> None:
        """Takes these tiles in hand; there must be none."""
        self.tiles = tiles.astype(np.uint32)
        self.parts.extend(parts)
        self.then = self.samples.copy()
        for part in self.parts:
            self.then.ravel()[tiles[part.first:part.end]] += part.more

    def shorten(self, most: int) -> None:
        """Leaves the first part at most so many samples; the rest of them are another part, behind it."""
        part = self.parts[0]
        if part.more > most:
            self.parts[0] = part._replace(samples=part.samples + most, more=part.more - most)
            self.parts.appendleft(part._replace(more=most))

    def cut(self, tiles: int) -> Part:
        """Takes at most so many tiles out of hand, of the first part. With the last of them all have their samples."""
        part = self.parts.popleft()
        share = part._replace(end=min(part.end, part.first + tiles))
        if share.end < part.end:
            self.parts.appendleft(part._replace(first=share.end))
        if not self.parts:
            self.samples = self.then
        return share
