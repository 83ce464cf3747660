"""Which tiles get which samples next: the work in hand, which is cut into launches. Knows nothing of devices."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .tiles import scattered


class Part(NamedTuple):
    """Tiles first … end − 1 of those in hand get `more` samples beside the `samples` they have."""

    first: int
    end: int
    samples: int
    more: int

    def meets(self, other: Part) -> bool:
        """Whether a tile is in both."""
        return self.first < other.end and other.first < self.end


class _Now(NamedTuple):
    """What `Work` knows, in one value: an exception out of a signal's handler leaves all of it as it was, or as it is
    to be."""

    samples: NDArray[np.int64]
    then: NDArray[np.int64]
    tiles: NDArray[np.uint32]
    parts: tuple[Part, ...]


class Work:
    """What has been rendered, and what is to be rendered before anything else is chosen.

    samples: (rows, columns) that the pixels of each tile have, or had before the work in hand; then: what they will
    have after it. tiles: uint32 numbers of those in hand, in their order on the device. parts: what is left in hand.
    """

    def __init__(self, samples: NDArray[np.int64], then: NDArray[np.int64] | None = None,
                 tiles: NDArray[np.uint32] | None = None, parts: Iterable[Part] = ()) -> None:
        self._now = _Now(samples, samples if then is None else then,
                         np.zeros(0, np.uint32) if tiles is None else tiles, tuple(parts))

    @property
    def samples(self) -> NDArray[np.int64]:
        """See above."""
        return self._now.samples

    @property
    def then(self) -> NDArray[np.int64]:
        """See above."""
        return self._now.then

    @property
    def tiles(self) -> NDArray[np.uint32]:
        """See above."""
        return self._now.tiles

    @property
    def parts(self) -> tuple[Part, ...]:
        """See above."""
        return self._now.parts

    def take(self, tiles: NDArray[np.integer[Any]], parts: Iterable[Part]) -> None:
        """Takes these tiles in hand; there must be none."""
        parts, then = tuple(parts), self.samples.copy()
        for part in parts:
            then.ravel()[tiles[part.first:part.end]] += part.more
        self._now = _Now(self.samples, then, tiles.astype(np.uint32), parts)

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
        rest = [piece for piece in (part._replace(end=first), part._replace(first=end)) if piece.first < piece.end]
        left = [*self.parts[:place], *rest, *self.parts[place + 1:]]
        if share.more < part.more:
            _put_last(left, Part(first, end, part.samples + share.more, part.more - share.more))
        self._now = self._now._replace(parts=tuple(left))
        return share

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
        self._now = self._now._replace(parts=(share, *self.parts))

    def settle(self) -> None:
        """Once all that was cut is rendered: where nothing is left in hand, all tiles have their samples."""
        if not self.parts:
            self._now = self._now._replace(samples=self.then)

    def take_stock(self, found: NDArray[np.int64]) -> None:
        """Has in hand what is not among the samples found, (rows, columns) of each tile's pixels, whatever became of
        what was cut; nothing may be in flight."""
        has, then = found.ravel()[self.tiles], self.then.ravel()[self.tiles]
        ends = [*(np.flatnonzero((np.diff(has) != 0) | (np.diff(then) != 0)) + 1).tolist(), len(has)]
        parts = [Part(first, end, int(has[first]), int(then[first] - has[first]))
                 for first, end in zip([0, *ends], ends) if first < end and has[first] < then[first]]
        self._now = self._now._replace(parts=tuple(parts))
        self.settle()

    @property
    def left(self) -> int:
        """Samples of a tile's pixels that are in hand."""
        return sum((part.end - part.first) * part.more for part in self.parts)


def _put_last(parts: list[Part], rest: Part) -> None:
    """Behind all in hand but what the same tiles get after it, which is there where a share was given back."""
    parts.insert(next((i for i, part in enumerate(parts) if part.meets(rest)), len(parts)), rest)
