"""Clock that does not count the time in which the process is suspended (SIGSTOP, a batch system, a laptop's lid).

No system clock provides that. But if a thread reads the clock often, a long interval between two readings means that
the process could not run.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from .threads import BEAT, Event, beside

#: Seconds that count at most between two readings; a busy machine may delay a reading.
LONGEST = 1.0


class AwakeClock:
    """Seconds since it was created, plus `seconds`; each interval between `look` calls counts LONGEST at most."""

    def __init__(self, seconds: float = 0.0) -> None:
        self.set(seconds)

    def set(self, seconds: float) -> None:
        """Set the clock to this value."""
        self._last = seconds, time.perf_counter()

    @property
    def seconds(self) -> float:
        """Return the current value."""
        seconds, looked = self._last
        return seconds + min(time.perf_counter() - looked, LONGEST)

    def look(self) -> float:
        """Return the current value, and start a new interval."""
        self.set(self.seconds)
        return self._last[0]


@contextmanager
def watched_clock(seconds: float = 0.0) -> Iterator[AwakeClock]:
    """Provide a clock that a thread reads regularly, so that callers need not."""
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
    """Wait until the event is set or this many seconds have passed; return whether it is set."""
    clock = AwakeClock()
    while not event.wait(min(BEAT, seconds)):
        if clock.look() >= seconds:
            return event.is_set()
    return True
