"""Work queue of an image: which tiles get which samples next, cut into launches. Independent of devices."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..film.tiles import scattered


class WorkPart(NamedTuple):
    """Tiles first … end − 1 of the pending ones, which get `more` samples in addition to the `samples` they have."""

    first: int
    end: int
    samples: int
    more: int

    def meets(self, other: WorkPart) -> bool:
        """Return whether a tile is in both."""
        return self.first < other.end and other.first < self.end


class _Now(NamedTuple):
    """State of `WorkQueue` in a single value: an exception from a signal handler leaves the old or the new state."""

    samples: NDArray[np.int64]
    then: NDArray[np.int64]
    tiles: NDArray[np.uint32]
    parts: tuple[WorkPart, ...]


class WorkQueue:
    """Samples rendered so far, and the pending work, which must be rendered before more is chosen.

    samples: (rows, columns) samples per pixel of each tile, or those before the pending work; then: the same after it.
    tiles: uint32 numbers of the pending tiles, in their order on the device. parts: what is still pending.
    """

    def __init__(
        self,
        samples: NDArray[np.int64],
        then: NDArray[np.int64] | None = None,
        tiles: NDArray[np.uint32] | None = None,
        parts: Iterable[WorkPart] = (),
    ) -> None:
        self._now = _Now(
            samples, samples if then is None else then, np.zeros(0, np.uint32) if tiles is None else tiles, tuple(parts)
        )

    @property
    def samples(self) -> NDArray[np.int64]:
        """See `WorkQueue`."""
        return self._now.samples

    @property
    def then(self) -> NDArray[np.int64]:
        """See `WorkQueue`."""
        return self._now.then

    @property
    def tiles(self) -> NDArray[np.uint32]:
        """See `WorkQueue`."""
        return self._now.tiles

    @property
    def parts(self) -> tuple[WorkPart, ...]:
        """See `WorkQueue`."""
        return self._now.parts

    def take(self, tiles: NDArray[np.integer[Any]], parts: Iterable[WorkPart]) -> None:
        """Add work for these tiles; none may be pending yet."""
        parts, then = tuple(parts), self.samples.copy()
        for part in parts:
            then.ravel()[tiles[part.first : part.end]] += part.more
        self._now = _Now(self.samples, then, tiles.astype(np.uint32), parts)

    def add_to_all(self, samples: int) -> None:
        """Add `samples` more samples per pixel for every tile to the pending work; all must have the same number."""
        every = scattered(self.samples.size)
        self.take(every, [WorkPart(0, len(every), int(self.samples[0, 0]), samples)])

    def double(self, tiles: NDArray[np.intp]) -> None:
        """Add a doubling of these tiles' samples to the pending work; tiles are numbered as in `samples`."""
        samples, places = self.samples.ravel()[tiles], np.argsort(scattered(self.samples.size))
        order = np.lexsort((places[tiles], samples))
        levels, firsts = (found.tolist() for found in np.unique(samples[order], return_index=True))
        self.take(
            tiles[order],
            [
                WorkPart(first, end, level, level)
                for first, end, level in zip(firsts, [*firsts[1:], len(tiles)], levels)
            ],
        )

    def cut(
        self,
        most: int,
        least_tiles: int,
        most_tiles: int | None = None,
        most_samples: int | None = None,
        busy: Sequence[WorkPart] = (),
    ) -> WorkPart | None:
        """Remove and return the next part of the pending work, of about `most` tiles times samples per pixel: at least
        `least_tiles` tiles, at most `most_tiles` and `most_samples` per pixel, and none among the `busy`. Return None
        if nothing is left for now.

        The rest of few tiles with many samples is put last, so that all tiles progress together.
        """
        found = self._first_free(busy)
        if found is None:
            return None
        place, first, free_end = found
        part = self.parts[place]
        more = min(part.more, most_samples or part.more)
        end = min(free_end, first + min(max(least_tiles, most // more), most_tiles or part.end))
        share = WorkPart(first, end, part.samples, min(more, max(1, most // (end - first))))
        rest = [piece for piece in (part._replace(end=first), part._replace(first=end)) if piece.first < piece.end]
        left = [*self.parts[:place], *rest, *self.parts[place + 1 :]]
        if share.more < part.more:
            _put_last(left, WorkPart(first, end, part.samples + share.more, part.more - share.more))
        self._now = self._now._replace(parts=tuple(left))
        return share

    def _first_free(self, busy: Sequence[WorkPart]) -> tuple[int, int, int] | None:
        """Return the index of a pending part, and its first range of tiles that are not busy or in an earlier part."""
        taken = np.zeros(len(self.tiles) + 1, bool)
        taken[-1] = True
        for part in busy:
            taken[part.first : part.end] = True
        for place, part in enumerate(self.parts):
            first = part.first + int(taken[part.first : part.end].argmin())
            if not taken[first]:
                return place, first, min(part.end, first + int(taken[first:].argmax()))
            taken[part.first : part.end] = True
        return None

    def give_back(self, share: WorkPart) -> None:
        """Return a share that was not rendered to the pending work."""
        self._now = self._now._replace(parts=(share, *self.parts))

    def settle(self) -> None:
        """Update `samples` once everything that was cut is rendered, if nothing is pending."""
        if not self.parts:
            self._now = self._now._replace(samples=self.then)

    def take_stock(self, found: NDArray[np.int64]) -> None:
        """Set the pending work to the samples missing from those found, (rows, columns) of each tile's pixels,
        regardless of what was cut; nothing may be in flight."""
        has, then = found.ravel()[self.tiles], self.then.ravel()[self.tiles]
        ends = [*(np.flatnonzero((np.diff(has) != 0) | (np.diff(then) != 0)) + 1).tolist(), len(has)]
        parts = [
            WorkPart(first, end, int(has[first]), int(then[first] - has[first]))
            for first, end in zip([0, *ends], ends)
            if first < end and has[first] < then[first]
        ]
        self._now = self._now._replace(parts=tuple(parts))
        self.settle()

    @property
    def left(self) -> int:
        """Pending work, as the sum of tiles times samples per pixel."""
        return sum((part.end - part.first) * part.more for part in self.parts)


def _put_last(parts: list[WorkPart], rest: WorkPart) -> None:
    """Insert after all parts, but before later ones of the same tiles, which exist if a share was given back."""
    parts.insert(next((i for i, part in enumerate(parts) if part.meets(rest)), len(parts)), rest)
