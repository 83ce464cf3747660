"""A pass that begins before the one in work has ended, so that workers wait neither for its last tasks nor for the
client.

A tile that has its samples of a pass may get those of the next one: its pixels without these are kept until that one is
in work. So the picture at the end of each pass is what it would be if all had waited.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..rendering.work import Part, Work


class Ahead:
    """A film (tiles, TILE_PIXELS), some of whose tiles have samples of the pass that follows the one in work.

    work: of that pass, None where none is known; samples: that it adds to every pixel.
    """

    def __init__(self, film: NDArray[Any]) -> None:
        self.film = film
        self.work: Work | None = None
        self.samples = 0

    def plan(self, work: Work, samples: int) -> None:
        """After the work in hand every pixel gets so many more."""
        self.work, self.samples = Work(work.then), samples
        self.work.add_to_all(samples)
        self._before = np.zeros_like(self.film)    # which takes memory as far as it is written to
        self._begun = np.zeros(len(self.film), bool)

    def begin(self) -> None:
        """Its work is the pass in work from now on."""
        self.work = None

    def cut(self, work: Work, most: int, least_tiles: int, most_tiles: int, busy: Sequence[Part],
            ) -> tuple[Work, Part] | None:
        """Takes out of hand what is next of the work, or of what follows it (see `Work.cut`)."""
        if part := work.cut(most, least_tiles, most_tiles, None, busy):
            return work, part
        if self.work and (part := self.work.cut(most, least_tiles, most_tiles, None, [*busy, *work.parts])):
            return self.work, part
        return None

    def take(self, work: Work, tiles: NDArray[np.uint32], pixels: NDArray[Any]) -> None:
        """Takes the tiles' pixels with more samples, which are of the work in hand or of what follows it."""
        if work is self.work:
            fresh = tiles[~self._begun[tiles]]
            self._before[fresh], self._begun[fresh] = self.film[fresh], True
        self.film[tiles] = pixels

    def shown(self) -> NDArray[Any]:
        """The film without the samples of what follows."""
        if self.work is None or not self._begun.any():
            return self.film
        return np.where(self._begun[:, None], self._before, self.film)

    def forget(self) -> None:
        """Something else follows."""
        if self.work is not None:
            self.film[self._begun] = self._before[self._begun]
            self.work = None
