"""Start the next pass before the current one ends, so that workers wait neither for its last tasks nor for the client.

A tile that has all its samples of a pass may receive those of the next one: its pixels without these are kept until the
next pass becomes the current one. So the image at the end of each pass is the same as if all had waited.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..rendering.accumulation.work_queue import WorkPart, WorkQueue


class NextPass:
    """A film (tiles, TILE_PIXELS), some of whose tiles have samples of the pass after the current one.

    work: of that pass, None if none is planned; samples: samples per pixel that it adds.
    """

    def __init__(self, film: NDArray[Any]) -> None:
        self.film = film
        self.work: WorkQueue | None = None
        self.samples = 0

    def plan(self, work: WorkQueue, samples: int) -> None:
        """Plan the next pass: `samples` more for every pixel after the current work."""
        self.work, self.samples = WorkQueue(work.then), samples
        self.work.add_to_all(samples)
        self._before = np.zeros_like(self.film)  # uses memory only where it is written to
        self._begun = np.zeros(len(self.film), bool)

    def begin(self) -> None:
        """Make the planned pass the current one."""
        self.work = None

    def cut(
        self,
        work: WorkQueue,
        most: int,
        least_tiles: int,
        most_tiles: int,
        busy: Sequence[WorkPart],
    ) -> tuple[WorkQueue, WorkPart] | None:
        """Take the next part of the current work, or of the pass after it (see `WorkQueue.cut`)."""
        if part := work.cut(most, least_tiles, most_tiles, None, busy):
            return work, part
        if self.work and (part := self.work.cut(most, least_tiles, most_tiles, None, [*busy, *work.parts])):
            return self.work, part
        return None

    def take(self, work: WorkQueue, tiles: NDArray[np.uint32], pixels: NDArray[Any]) -> None:
        """Store the tiles' pixels with more samples, of the current work or of the pass after it."""
        if work is self.work:
            fresh = tiles[~self._begun[tiles]]
            self._before[fresh], self._begun[fresh] = self.film[fresh], True
        self.film[tiles] = pixels

    def shown(self) -> NDArray[Any]:
        """Return the film without the samples of the next pass."""
        if self.work is None or not self._begun.any():
            return self.film
        return np.where(self._begun[:, None], self._before, self.film)

    def forget(self) -> None:
        """Discard the samples of the planned pass."""
        if self.work is not None:
            self.film[self._begun] = self._before[self._begun]
            self.work = None
