"""Ctrl-C, and the signal by which batch systems end jobs: the first asks for an orderly end, the second ends now."""

from __future__ import annotations

import signal
from collections.abc import Callable
from types import FrameType, TracebackType

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interruptible:
    """While it lasts, the first signal calls `ask` and nothing else; the next raises KeyboardInterrupt."""

    def __init__(self, ask: Callable[[], None]) -> None:
        self.asked, self._ask = False, ask

    def __enter__(self) -> Interruptible:
        for number in SIGNALS:
            signal.signal(number, self._heed)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        for number in SIGNALS:
            signal.signal(number, signal.default_int_handler)

    def _heed(self, number: int, frame: FrameType | None) -> None:
        """Python may call it for a second signal while it is in it for the first."""
        if self.asked:
            raise KeyboardInterrupt
        self.asked = True
        self._ask()
