"""Ctrl-C, the signal by which batch systems end jobs, and SIGHUP, by which a terminal tells that it has gone: the first
asks for an orderly end, the second ends now, unless it is SIGHUP, of which shell and kernel may each send one."""

from __future__ import annotations

import signal
from collections.abc import Callable
from types import FrameType, TracebackType

NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")     # the last one is Windows' Ctrl-Break
HANG_UP = getattr(signal, "SIGHUP", None)


def signals() -> list[signal.Signals]:
    """Those of them that there are here, without SIGHUP where nohup has this process ignore it."""
    known = [getattr(signal, name) for name in NAMES if hasattr(signal, name)]
    return [each for each in known if each != HANG_UP or signal.getsignal(each) is not signal.SIG_IGN]


def end_by_signals() -> None:
    """Has each of them be what Ctrl-C is."""
    for number in signals():
        signal.signal(number, signal.default_int_handler)


class Interruptible:
    """While it lasts, the first signal calls `ask` and nothing else; the next raises KeyboardInterrupt."""

    def __init__(self, ask: Callable[[], None]) -> None:
        self.asked, self._ask = False, ask

    def __enter__(self) -> Interruptible:
        for number in signals():
            signal.signal(number, self._heed)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        end_by_signals()

    def _heed(self, number: int, frame: FrameType | None) -> None:
        """Python may call it for a second signal while it is in it for the first."""
        if self.asked and number != HANG_UP:
            raise KeyboardInterrupt
        self.asked = True
        self._ask()
