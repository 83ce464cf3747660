"""Bounded launches: work is split so that no launch runs long, and waiting never blocks signals.

On some systems a watchdog kills launches of 2 s, and a driver that waits inside a call cannot be interrupted. So a
launch gets at most as much work as fills TARGET_SECONDS, estimated from previous launches (`LaunchSize`), few are in
flight, and their events are polled. A launch that has not ended after `patience` has hung.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

import pyopencl as cl

from ...awake import AwakeClock
from ...errors import DeviceError, HungError
from ...threads import Bell
from ..contexts import share_no_more
from ..driver_errors import driver_errors
from ..open import Device
from .event_callbacks import when_complete
from .fork_safety import check_process
from .hang_watchdog import VARIABLE, counted_call, note_hang, patience
from .lent_memory import settle

TARGET_SECONDS = 0.07
#: Maximum growth of a launch relative to the previous one.
GROWTH = 2
#: Weight of the previous estimate of time per unit after a faster launch.
REMEMBERED = 0.7
#: Launches below this fraction of both the work and the target are not used as estimates: fixed launch overhead
#: dominates.
LEAST_TELLING = 0.25
IN_FLIGHT = 2
#: Maximum polling interval in seconds.
LONGEST_LOOK = 0.1
#: Seconds after which polling gives way to the driver's callback.
SOON = 2e-4


class LaunchEvents(NamedTuple):
    """Events of the first and the last kernel of a launch; the same if it has one."""

    first: cl.Event
    last: cl.Event

    @property
    def seconds(self) -> float:
        """Return the run time of a finished launch by the device's clock, or 0 if it is not available.

        With rusticl all launches take a nanosecond.
        """
        try:
            nanoseconds = self.last.profile.end - self.first.profile.start
        except cl.Error:
            return 0.0
        return 1e-9 * nanoseconds if nanoseconds > 1 else 0.0


def run_seconds(event: cl.Event) -> float:
    """Return the run time of a finished kernel, see `LaunchEvents`."""
    return LaunchEvents(event, event).seconds


class LaunchSize:
    """Adaptive size of the next launch: `units`, in the caller's units of work.

    It is at most `most`. It follows the slowest recent launches, not their mean: the cost varies across an image, and
    other programs compete for the device, so launches that take the target time on average would often take twice that.
    """

    def __init__(self, first: int, most: int | None = None) -> None:
        self.units, self._most = first, most
        self._unit_seconds = 0.0

    def learn(self, work: int, seconds: float) -> None:
        """Update the size from a launch of `work` units that took `seconds`."""
        if work < LEAST_TELLING * self.units and seconds < LEAST_TELLING * TARGET_SECONDS:
            return
        took = seconds / work
        self._unit_seconds = max(took, REMEMBERED * self._unit_seconds + (1 - REMEMBERED) * took)
        wanted = TARGET_SECONDS / max(self._unit_seconds, 1e-15)
        self.units = max(1, int(min(wanted, GROWTH * max(work, self.units), self._most or wanted)))


class Launches:
    """Launches in flight on a queue, of adaptive size. longest: the longest launch so far, in seconds."""

    def __init__(self, first_size: int, most: int | None = None) -> None:
        self._size = LaunchSize(first_size, most)
        self._running: deque[tuple[LaunchEvents, cl.Event, int]] = deque()
        self._wait = Wait()
        self._last = self.longest = 0.0

    def add(self, events: LaunchEvents, work: int) -> None:
        """Register a launch of `work` units that was just enqueued; wait while too many are in flight."""
        self.begin(events, events.last, work)
        while self.full:
            self._finish_one()

    def begin(self, events: LaunchEvents, last: cl.Event, work: int) -> None:
        """Register a launch that was just enqueued, and the last event that belongs to it, without waiting."""
        if not self._running:
            self._last, self._wait = time.perf_counter(), Wait()
        self._running.append((events, last, work))

    @property
    def size(self) -> int:
        """Return the units of work for the next launch."""
        return self._size.units

    @property
    def idle(self) -> bool:
        """Return whether no launch is in flight."""
        return not self._running

    @property
    def full(self) -> bool:
        """Return whether IN_FLIGHT launches are in flight."""
        return len(self._running) >= IN_FLIGHT

    def poll(self) -> bool:
        """Retire the first launch in flight if it ended; return whether it did. DeviceError if it failed or hung."""
        if not self._running or not self._wait.is_over(self._running[0][1]):
            return False
        self._finish_one()
        return True

    def wait(self) -> None:
        """Wait for all launches."""
        while self._running:
            self._finish_one()

    def _finish_one(self) -> None:
        events, last, work = self._running[0]
        wait_for(last)
        self._running.popleft()
        now = time.perf_counter()
        seconds = events.seconds or now - self._last
        self._last, self._wait = now, Wait()
        self.longest = max(self.longest, seconds)
        self._size.learn(work, seconds)


def run_kernel(device: Device, kernel: cl.Kernel, groups: int) -> None:
    """Run a kernel whose arguments are set on `groups` work-groups of the device's `local_size`, and wait for it."""
    local = device.local_size
    with calling():
        event = cl.enqueue_nd_range_kernel(device.queue, kernel, (groups * local,), (local,))
    wait_for(event)


@contextmanager
def calling() -> Iterator[None]:
    """Convert the errors of driver calls that should return at once, and watch them for hangs."""
    with driver_errors(), counted_call():
        yield


class Wait:
    """Wait for a launch, with the time that it has taken so far."""

    def __init__(self) -> None:
        self._clock = AwakeClock()

    def is_over(self, event: cl.Event) -> bool:
        """Return whether the event is complete. Raises DeviceError if it failed, and HungError after `patience`."""
        with calling():
            status = event.command_execution_status
        if status < 0:
            share_no_more()
            raise DeviceError(f"the device stopped a launch with error {status}")
        if self._clock.look() > patience() and status != cl.command_execution_status.COMPLETE:
            note_hang()
            share_no_more()
            raise HungError(
                f"the device has not finished a launch in {patience():g} s: its driver hangs, or it is "
                f"lost; if launches may take that long, set {VARIABLE} to more seconds"
            )
        return bool(status == cl.command_execution_status.COMPLETE)


def wait_for(event: cl.Event) -> None:
    """Wait until the event is complete, handling signals meanwhile. Raises DeviceError if it failed or hangs.

    The queue is flushed first, as querying an event's status does not submit its command. On a CPU, polling slows down
    the launch itself, so after a short time the driver's callback ends the wait.
    """
    check_process()
    with calling():
        event.command_queue.flush()
    start, wait = time.perf_counter(), Wait()
    while not wait.is_over(event):
        if time.perf_counter() - start > SOON:
            _wait_long(event, wait)
            break
        time.sleep(1e-5)
    settle()


def _wait_long(event: cl.Event, wait: Wait) -> None:
    ended, pause = Bell(), SOON
    with calling():
        when_complete(event, ended.ring)
    while not wait.is_over(event):
        ended.wait(pause)
        pause = min(2 * pause, LONGEST_LOOK)
