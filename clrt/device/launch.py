"""Bounded launches: work is cut so that no launch runs long, and waiting never blocks signals.

A watchdog kills launches of 2 s on some systems, and a driver that waits inside a call cannot be interrupted. So a
launch gets as much work as fills about TARGET_SECONDS, judged by the launches before it, few are in flight, and their
events are polled.
"""

from __future__ import annotations

import time
from collections import deque

import pyopencl as cl

from ..errors import DeviceError
from .fork import check_process
from .open import Device

TARGET_SECONDS = 0.08
IN_FLIGHT = 2


class Launches:
    """Feeds a queue with launches of adapted size. Sizes are in units of work, whatever the caller counts."""

    def __init__(self, first_size: int) -> None:
        self.size = first_size
        self._running: deque[tuple[cl.Event, int]] = deque()
        self._last = 0.0

    def add(self, event: cl.Event, work: int) -> None:
        """Takes in a launch of `work` units that was just enqueued; waits while too many are in flight."""
        if not self._running:
            self._last = time.perf_counter()
        self._running.append((event, work))
        while len(self._running) >= IN_FLIGHT:
            self._finish_one()

    def wait(self) -> None:
        """Waits for every launch."""
        while self._running:
            self._finish_one()

    def _finish_one(self) -> None:
        event, work = self._running[0]
        wait_for(event)
        self._running.popleft()
        now = time.perf_counter()
        seconds, self._last = now - self._last, now
        wanted = work * TARGET_SECONDS / max(seconds, 1e-6)
        self.size = max(1, int(min(wanted, 2 * max(work, self.size))))


def run_kernel(device: Device, kernel: cl.Kernel, groups: int) -> None:
    """Runs a kernel, whose arguments are set, on `groups` groups of the device's size, and waits for it."""
    local = device.local_size
    wait_for(cl.enqueue_nd_range_kernel(device.queue, kernel, (groups * local,), (local,)))


def wait_for(event: cl.Event) -> None:
    """Returns when the event is complete, letting signals through; DeviceError where it failed.

    Asking for an event's status starts nothing: a driver may hold commands back until their queue is flushed.
    """
    check_process()
    event.command_queue.flush()
    start, pause = time.perf_counter(), 1e-5
    while (status := event.command_execution_status) > cl.command_execution_status.COMPLETE:
        time.sleep(pause)
        pause = max(1e-5, min(2e-3, (time.perf_counter() - start) / 50))
    if status < 0:
        raise DeviceError(f"the device stopped a launch with error {status}")
