"""Bounded launches: work is cut so that no launch runs long, and waiting never blocks signals.

A watchdog kills launches of 2 s on some systems, and a driver that waits inside a call cannot be interrupted. So a
launch gets as much work as fills TARGET_SECONDS at most, judged by the launches before it (`LaunchSize`), few are in
flight, and their events are polled. One that has not ended after `patience` has hung.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager

import pyopencl as cl

from ..awake import AwakeClock
from ..errors import DeviceError, HungError
from ..threads import Bell
from .callbacks import when_complete
from .contexts import share_no_more
from .driver_errors import driver_errors
from .fork import check_process
from .lending import settle
from .open import Device
from .pulse import VARIABLE, counted_call, note_hang, patience

TARGET_SECONDS = 0.07
#: By how much a launch may be larger than the one before.
GROWTH = 2
#: How much of what was expected before a faster launch is still expected after it.
REMEMBERED = 0.7
#: Launches of less than this part of the work and of the target tell nothing: most of them is what any launch costs.
LEAST_TELLING = 0.25
IN_FLIGHT = 2
#: The longest pause between two looks.
LONGEST_LOOK = 0.1
#: Seconds after which a launch is no short one.
SOON = 2e-4


class LaunchSize:
    """How much work the next launch gets, in units of whatever the caller counts: `units`.

    It goes by the slowest launches of late, not by their mean: some parts of a picture cost more than others, and other
    programs come and go, so that launches that take the target on average would often take twice that.
    """

    def __init__(self, first: int) -> None:
        self.units = first
        self._unit_seconds = 0.0

    def learn(self, work: int, seconds: float) -> None:
        """Hears what a launch of `work` units took."""
        if work < LEAST_TELLING * self.units and seconds < LEAST_TELLING * TARGET_SECONDS:
            return
        took = seconds / work
        self._unit_seconds = max(took, REMEMBERED * self._unit_seconds + (1 - REMEMBERED) * took)
        wanted = TARGET_SECONDS / max(self._unit_seconds, 1e-15)
        self.units = max(1, int(min(wanted, GROWTH * max(work, self.units))))


class Launches:
    """Feeds a queue with launches of adapted size. longest: seconds that a launch took, at most."""

    def __init__(self, first_size: int) -> None:
        self._size = LaunchSize(first_size)
        self._running: deque[tuple[cl.Event, cl.Event, int]] = deque()
        self._wait = Wait()
        self._last = self.longest = 0.0

    def add(self, event: cl.Event, work: int) -> None:
        """Takes in a launch of `work` units that was just enqueued; waits while too many are in flight."""
        self.begin(event, event, work)
        while self.full:
            self._finish_one()

    def begin(self, event: cl.Event, last: cl.Event, work: int) -> None:
        """Takes in a launch that was just enqueued, with the last of what belongs to it; waits for none."""
        if not self._running:
            self._last, self._wait = time.perf_counter(), Wait()
        self._running.append((event, last, work))

    @property
    def size(self) -> int:
        """Units of work that the next one should have."""
        return self._size.units

    @property
    def idle(self) -> bool:
        """Whether none is in flight."""
        return not self._running

    @property
    def full(self) -> bool:
        """Whether as many are in flight as should be."""
        return len(self._running) >= IN_FLIGHT

    def poll(self) -> bool:
        """Whether the first in flight had ended, which then no longer is; DeviceError where it failed or hangs."""
        if not self._running or not self._wait.is_over(self._running[0][1]):
            return False
        self._finish_one()
        return True

    def wait(self) -> None:
        """Waits for every launch."""
        while self._running:
            self._finish_one()

    def _finish_one(self) -> None:
        event, last, work = self._running[0]
        wait_for(last)
        self._running.popleft()
        now = time.perf_counter()
        seconds = run_seconds(event) or now - self._last
        self._last, self._wait = now, Wait()
        self.longest = max(self.longest, seconds)
        self._size.learn(work, seconds)


def run_seconds(event: cl.Event) -> float:
    """How long a launch that has ended ran, by the device's own clock; 0 where it does not tell: for rusticl's all take
    a nanosecond."""
    try:
        nanoseconds = event.profile.end - event.profile.start
    except cl.Error:
        return 0.0
    return 1e-9 * nanoseconds if nanoseconds > 1 else 0.0


def run_kernel(device: Device, kernel: cl.Kernel, groups: int) -> None:
    """Runs a kernel, whose arguments are set, on `groups` groups of the device's size, and waits for it."""
    local = device.local_size
    with calling():
        event = cl.enqueue_nd_range_kernel(device.queue, kernel, (groups * local,), (local,))
    wait_for(event)


@contextmanager
def calling() -> Iterator[None]:
    """Around calls of a driver that should take no time, which are watched; its errors become DeviceErrors."""
    with driver_errors(), counted_call():
        yield


class Wait:
    """The wait for a launch, and how long it has taken so far."""

    def __init__(self) -> None:
        self._clock = AwakeClock()

    def is_over(self, event: cl.Event) -> bool:
        """Whether the event is complete; DeviceError where it failed, HungError once patience is exhausted."""
        with calling():
            status = event.command_execution_status
        if status < 0:
            share_no_more()
            raise DeviceError(f"the device stopped a launch with error {status}")
        if self._clock.look() > patience() and status != cl.command_execution_status.COMPLETE:
            note_hang()
            share_no_more()
            raise HungError(f"the device has not ended a launch in {patience():g} s: its driver hangs, or it is lost; "
                            f"if launches may take that long there, set {VARIABLE} to more")
        return bool(status == cl.command_execution_status.COMPLETE)


def wait_for(event: cl.Event) -> None:
    """Returns when the event is complete, letting signals through; DeviceError where it failed or hangs.

    Asking for an event's status starts nothing: a driver may hold commands back until their queue is flushed. On a CPU
    each look takes time from the launch itself: after the first ones it is the driver that tells.
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
