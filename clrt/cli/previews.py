"""Previews: the image so far, written to its files every few seconds while it renders (`--preview-every`)."""

from __future__ import annotations

import logging
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import OutputError

if TYPE_CHECKING:
    from ..output.image import Image
    from ..rendering.renderer import Renderer, State
    from .outputs import Outputs

#: Maximum fraction of the time that previews take, as a divisor: slow disks get fewer.
SHARE = 10


class Previews:
    """Previews of one image. every: seconds of rendering between two; None for none.

    They are written atomically, without AOVs, and not denoised. A file that cannot be written is reported once: the
    final image may still be written elsewhere.
    """

    def __init__(self, results: Outputs, every: float | None) -> None:
        self._results, self._every = results, every
        self._next = every or 0.0
        self._failed: set[Path] = set()

    def show(self, renderer: Renderer, state: State) -> None:
        """Write a preview of this state if one is due."""
        if self._every is None or state.seconds < self._next:
            return
        from ..api import image_of

        start = time.perf_counter()
        image = image_of(renderer, state)
        self._write(replace(image, report=image.report | self._results.header, aovs={}))
        self._next = state.seconds + max(self._every, SHARE * (time.perf_counter() - start))

    def _write(self, image: Image) -> None:
        for path in self._results.pictures:
            try:
                image.save(path, view=self._results.view, exposure=self._results.exposure)
            except OutputError as error:
                if path not in self._failed:
                    logging.getLogger(__name__).warning("%s; the render continues without previews there", error)
                self._failed.add(path)
