"""Handling of Ctrl-C, termination signals of batch systems, and SIGHUP, which is sent when a terminal closes: the first
requests an orderly end, the second ends immediately, unless it is SIGHUP, as shell and kernel may both send one."""

from __future__ import annotations

import signal
from collections.abc import Callable
from types import FrameType, TracebackType

NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")  # the last one is Windows' Ctrl-Break
HANG_UP = getattr(signal, "SIGHUP", None)


def signals() -> list[signal.Signals]:
    """Return those of NAMES that the platform has, without SIGHUP if nohup made this process ignore it."""
    known = [getattr(signal, name) for name in NAMES if hasattr(signal, name)]
    return [each for each in known if each != HANG_UP or signal.getsignal(each) is not signal.SIG_IGN]


def end_by_signals() -> None:
    """Make each of these signals raise KeyboardInterrupt, like Ctrl-C."""
    for number in signals():
        signal.signal(number, signal.default_int_handler)


class Interruptible:
    """Context in which the first signal only calls `ask`; the next one raises KeyboardInterrupt."""

    def __init__(self, ask: Callable[[], None]) -> None:
        self.asked, self._ask = False, ask

    def __enter__(self) -> Interruptible:
        for number in signals():
            signal.signal(number, self._heed)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        end_by_signals()

    def _heed(self, number: int, frame: FrameType | None) -> None:
        """Handle a signal. Python may call this for a second signal while the first call is in progress."""
        if self.asked and number != HANG_UP:
            raise KeyboardInterrupt
        self.asked = True
        self._ask()
