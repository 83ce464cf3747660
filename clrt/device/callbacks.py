"""Functions called when commands complete, from threads of the driver."""

from __future__ import annotations

import atexit
import time
from collections.abc import Callable

import pyopencl as cl

from ..threads import Event

#: Pending callbacks, and whether Python is shutting down.
_expected: set[object] = set()
_python_ends = Event()


def when_complete(event: cl.Event, function: Callable[[], object]) -> None:
    """Have `function` called once the event is complete, or at once if it already is; never while Python shuts down."""
    token = object()

    def called(_: int) -> None:
        function()
        _expected.discard(token)

    _expected.add(token)
    if _python_ends.is_set():
        _expected.clear()
    else:
        event.set_callback(cl.command_execution_status.COMPLETE, called)


@atexit.register
def _await_them() -> None:
    """Wait up to 1 s for pending callbacks: one that runs during Python's shutdown would abort the process.

    Threads that still wait for one must then poll.
    """
    _python_ends.set()
    start = time.perf_counter()
    while _expected and time.perf_counter() < start + 1:
        time.sleep(1e-3)
