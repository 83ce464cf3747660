"""Which tiles get which samples next: the work in hand, which is cut into launches. Knows nothing of devices."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .tiles import scattered, tile_pixels


class Part(NamedTuple):
    """Tiles first … end − 1 of those in hand get `more` samples beside the `samples` they have."""

    first: int
    end: int
    samples: int
    more: int

    def meets(self, other: Part) -> bool:
        """Whether a tile is in both."""
        return self.first < other.end and other.first < self.end


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

    def add_to_all(self, samples: int) -> None:
        """Takes it in hand that every tile gets so many more; all must have as many."""
        every = scattered(self.samples.size)
        self.take(every, [Part(0, len(every), int(self.samples[0, 0]), samples)])

    def double(self, tiles: NDArray[np.intp]) -> None:
        """Takes it in hand that these tiles get as many samples as they have, by their number in `samples`."""
        samples, places = self.samples.ravel()[tiles], np.argsort(scattered(self.samples.size))
        order = np.lexsort((places[tiles], samples))
        levels, firsts = (found.tolist() for found in np.unique(samples[order], return_index=True))
        self.take(tiles[order], [Part(first, end, level, level) for first, end, level
                                 in zip(firsts, [*firsts[1:], len(tiles)], levels)])

    def cut(self, most: int, least_tiles: int, most_tiles: int | None = None, most_samples: int | None = None,
            busy: Sequence[Part] = ()) -> Part | None:
        """Takes out of hand what is next, about `most` samples of a tile's pixels: of `least_tiles` tiles at least, of
        `most_tiles` and `most_samples` a pixel at most, and of none that are among the `busy`. None where there is
        nothing left for now.

        What few tiles of many samples leave comes last, so that all tiles come along together.
        """
        found = self._first_free(busy)
        if found is None:
            return None
        place, first, free_end = found
        part = self.parts[place]
        more = min(part.more, most_samples or part.more)
        end = min(free_end, first + min(max(least_tiles, most // more), most_tiles or part.end))
        share = Part(first, end, part.samples, min(more, max(1, most // (end - first))))
        del self.parts[place]
        if end < part.end:
            self.parts.insert(place, part._replace(first=end))
        if part.first < first:
            self.parts.insert(place, part._replace(end=first))
        if share.more < part.more:
            self._put_last(Part(first, end, part.samples + share.more, part.more - share.more))
        return share

    def _put_last(self, rest: Part) -> None:
        """Behind all in hand but what the same tiles get after it, which is there where a share was given back."""
        place = next((i for i, part in enumerate(self.parts) if part.meets(rest)), len(self.parts))
        self.parts.insert(place, rest)

    def _first_free(self, busy: Sequence[Part]) -> tuple[int, int, int] | None:
        """The place in hand of a part, and the first stretch of its tiles, none of which is busy or comes before."""
        taken = np.zeros(len(self.tiles) + 1, bool)
        taken[-1] = True
        for part in busy:
            taken[part.first:part.end] = True
        for place, part in enumerate(self.parts):
            first = part.first + int(taken[part.first:part.end].argmin())
            if not taken[first]:
                return place, first, min(part.end, first + int(taken[first:].argmax()))
            taken[part.first:part.end] = True
        return None

    def give_back(self, share: Part) -> None:
        """Takes a share in hand again, which was not rendered."""
        self.parts.appendleft(share)

    def settle(self) -> None:
        """Once all that was cut is rendered: where nothing is left in hand, all tiles have their samples."""
        if not self.parts:
            self.samples = self.then

    def rendered(self, size: tuple[int, int]) -> int:
        """Samples that all pixels of a picture of (width, height) have by now."""
        now = self.then.copy()
        for part in self.parts:
            now.ravel()[self.tiles[part.first:part.end]] -= part.more
        return int(np.sum(now * tile_pixels(size)))

    @property
    def left(self) -> int:
        """Samples of a tile's pixels that are in hand."""
        return sum((part.end - part.first) * part.more for part in self.parts)
