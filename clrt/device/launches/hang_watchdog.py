"""Hang watchdog: counters of driver calls in memory that a guard in another process can watch (cli/guard.py).

Waiting for a launch ends after `patience` (launch.py). But a driver may also hang inside a call, and then no Python
code runs until it returns: pyopencl releases the GIL only in calls that are meant to wait. So each call is counted when
it begins and when it ends; a process that shares this memory detects a hang by an odd count that does not change.
"""

from __future__ import annotations

import mmap
import os
from collections.abc import Iterator
from contextlib import contextmanager

from ...errors import UsageError

#: Seconds after which a launch or a call counts as hung; they should take a tenth of a second. The variable overrides
#: it, and 0 disables the watchdog.
HANG_SECONDS, VARIABLE = 60.0, "CLRT_HANG_SECONDS"

#: Factor on that time for a program's first launch, at which many drivers compile.
WARM_UP = 10

#: Calls begun and ended; simulators in use; whether any hung; warm-ups in progress. Shared with forked processes.
_counts = memoryview(mmap.mmap(-1, 32)).cast("q")
CALLS, UNWATCHED, HUNG, WARMING = 0, 1, 2, 3


def patience() -> float:
    """Return the seconds that a launch or a call may take; infinite if the watchdog is off."""
    try:
        seconds = float(os.environ.get(VARIABLE) or HANG_SECONDS)
        if not 0 <= seconds < float("inf"):
            raise ValueError
    except ValueError:
        raise UsageError(f"{VARIABLE} is {os.environ[VARIABLE]!r}; it must be a number of seconds, or 0") from None
    watched = seconds > 0 and not _counts[UNWATCHED]
    return seconds * (WARM_UP if _counts[WARMING] else 1) if watched else float("inf")


def call_in_progress() -> int:
    """Return a number that identifies the call in progress; 0 if there is none, or it is not watched."""
    calls = _counts[CALLS]
    return calls if calls % 2 and not (_counts[UNWATCHED] or _counts[WARMING]) else 0


@contextmanager
def counted_call() -> Iterator[None]:
    """Count driver calls that should return at once; nested uses have no effect."""
    outermost = 1 - _counts[CALLS] % 2
    _counts[CALLS] += outermost
    try:
        yield
    finally:
        _counts[CALLS] += outermost


def note_hang() -> None:
    """Record that a device has hung: its driver may even prevent this process from exiting normally."""
    _counts[HUNG] = 1


def has_hung() -> bool:
    """Return whether a hang was recorded."""
    return bool(_counts[HUNG])


def take_any_time() -> None:
    """Disable the watchdog from now on, for slow simulators."""
    _counts[UNWATCHED] += 1


@contextmanager
def warming_up() -> Iterator[None]:
    """Mark the first launch of a program, whose calls are not watched: see background_compile.py."""
    _counts[WARMING] += 1
    try:
        yield
    finally:
        _counts[WARMING] -= 1
