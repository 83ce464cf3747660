"""Whether a driver answers: kept in memory that a guard in another process can watch (cli/guard.py).

Waiting for a launch ends after the patience that there is (launch.py). But a driver may also hang in a call, and then
no line of Python runs until it returns: pyopencl lets other threads run only in calls that are meant to wait. So each
call is counted as it begins and as it ends, and who shares this memory sees an odd count that stands still.
"""

from __future__ import annotations

import mmap
import os
from collections.abc import Iterator
from contextlib import contextmanager

from ..errors import UsageError

#: How long a launch, or a call, may take before it counts as hung; they should take a tenth of a second. The variable
#: changes it, and 0 turns it off.
HANG_SECONDS, VARIABLE = 60.0, "CLRT_HANG_SECONDS"

#: Many drivers compile at the first launch, which may take so many times as long.
WARM_UP = 10

#: Calls begun and ended; simulators in use; whether any hung; warm-ups. A fork shares it.
_counts = memoryview(mmap.mmap(-1, 32)).cast("q")
CALLS, UNWATCHED, HUNG, WARMING = 0, 1, 2, 3


def patience() -> float:
    """Seconds that a launch or a call may take; infinite where that is not watched."""
    try:
        seconds = float(os.environ.get(VARIABLE) or HANG_SECONDS)
        if not 0 <= seconds < float("inf"):
            raise ValueError
    except ValueError:
        raise UsageError(f"{VARIABLE} is {os.environ[VARIABLE]!r}; it must be a number of seconds, or 0") from None
    watched = seconds > 0 and not _counts[UNWATCHED]
    return seconds * (WARM_UP if _counts[WARMING] else 1) if watched else float("inf")


def call_in_progress() -> int:
    """A number that is the same as long as the same call goes on; 0 where there is none, or none that is watched."""
    calls = _counts[CALLS]
    return calls if calls % 2 and not (_counts[UNWATCHED] or _counts[WARMING]) else 0


@contextmanager
def counted_call() -> Iterator[None]:
    """Around calls of a driver that should take no time; within another one it does nothing."""
    outermost = 1 - _counts[CALLS] % 2
    _counts[CALLS] += outermost
    try:
        yield
    finally:
        _counts[CALLS] += outermost


def note_hang() -> None:
    """A device does not answer: its driver may not even let this process end in the usual way."""
    _counts[HUNG] = 1


def has_hung() -> bool:
    """Whether that was noted."""
    return bool(_counts[HUNG])


def take_any_time() -> None:
    """From now on nothing is watched: simulators are slow."""
    _counts[UNWATCHED] += 1


@contextmanager
def warming_up() -> Iterator[None]:
    """Around the first launch of a program. Its calls are not watched: see background.py."""
    _counts[WARMING] += 1
    try:
        yield
    finally:
        _counts[WARMING] -= 1
