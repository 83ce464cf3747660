"""Tone mapping in a background thread, so that no view transform blocks the window."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import ClrtError
from ..live.snapshot import Snapshot
from ..output.data_images import shown_data
from ..output.view_transform import transparent_levels
from ..threads import Condition, beside


@dataclass(frozen=True)
class DisplaySettings:
    """Display settings: a view transform (docs/colour.md) after a gain of 2^exposure."""

    view: str = "srgb"
    exposure: float = 0.0


@dataclass(frozen=True, eq=False)
class ToneMapped:
    """rgba: (height, width, 4) uint8 of a snapshot with `look` applied; error: why that failed, with black pixels."""

    snapshot: Snapshot
    look: DisplaySettings
    rgba: NDArray[np.uint8]
    error: str | None = None


class ToneMapper:
    """Background tone mapper. Only the latest request is processed next; older pending ones are dropped."""

    def __init__(self) -> None:
        self._asked: tuple[Snapshot, DisplaySettings] | None = None
        self._changed, self._closed = Condition(), False
        self.newest: ToneMapped | None = None
        self._wait_for_end = beside(self._run, daemon=True)

    def ask(self, snapshot: Snapshot, look: DisplaySettings) -> None:
        """Request tone mapping of a snapshot, unless it is already the latest request."""
        if self._asked is None or self._asked[0] is not snapshot or self._asked[1] != look:
            self._asked = snapshot, look
            self._changed.notify()

    def close(self) -> None:
        """Stop the thread."""
        self._closed = True
        self._changed.notify()
        self._wait_for_end()

    def _run(self) -> None:
        done = None
        while True:
            self._changed.wait_for(lambda: self._closed or self._asked is not done)
            done = self._asked
            if self._closed or done is None:
                return
            self.newest = tone_mapped(*done)


def tone_mapped(snapshot: Snapshot, look: DisplaySettings) -> ToneMapped:
    """Return the image as `clrt render --view --exposure` writes it to a .png."""
    data, error = shown_data(snapshot.scene.render.integrator, snapshot.pixels), None
    try:
        shown = snapshot.shown if data is None else data
        if snapshot.alpha is not None:
            shown = np.concatenate([shown, snapshot.alpha[..., None]], axis=2)
        view, exposure = (look.view, look.exposure) if data is None else ("raw", 0.0)
        levels = transparent_levels(shown, view, exposure, np.uint8)
    except ClrtError as problem:
        levels, error = np.zeros(snapshot.pixels.shape, np.uint8), str(problem)
    opaque = np.full((*levels.shape[:2], 4 - levels.shape[2]), 255, np.uint8)
    return ToneMapped(snapshot, look, np.concatenate([levels, opaque], axis=2), error)
