"""Time in which this process runs: that in which it is suspended (SIGSTOP, a batch system, a laptop's lid) is left out.

No clock of the system's tells that. But who looks at a clock often knows that a long time between two looks was none in
which it could look.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from .threads import BEAT, Event, beside

#: Seconds between two looks that count at most: a busy machine may delay a look.
LONGEST = 1.0


class AwakeClock:
    """Seconds since it was made, and `seconds` before; LONGEST at most count from a look to the next."""

    def __init__(self, seconds: float = 0.0) -> None:
        self.set(seconds)

    def set(self, seconds: float) -> None:
        """It goes on from there."""
        self._last = seconds, time.perf_counter()

    @property
    def seconds(self) -> float:
        """What it shows now."""
        seconds, looked = self._last
        return seconds + min(time.perf_counter() - looked, LONGEST)

    def look(self) -> float:
        """What it shows now, from where the next look counts."""
        self.set(self.seconds)
        return self._last[0]


@contextmanager
def watched_clock(seconds: float = 0.0) -> Iterator[AwakeClock]:
    """A clock that a thread looks at, so that nobody else has to."""
    clock, over = AwakeClock(seconds), Event()

    def watch() -> None:
        while not over.wait(BEAT):
            clock.look()

    beside(watch, daemon=True)
    try:
        yield clock
    finally:
        over.set()


def wait_awake(event: Event, seconds: float) -> bool:
    """Whether the event is set within so many seconds; waits for that."""
    clock = AwakeClock()
    while not event.wait(min(BEAT, seconds)):
        if clock.look() >= seconds:
            return event.is_set()
    return True
