"""Functions called when commands complete, from threads of the driver."""

from __future__ import annotations

import atexit
import time
from collections.abc import Callable
from weakref import ref

import pyopencl as cl

from ...threads import LAST_WAIT, Event

#: Pending callbacks, and whether Python is shutting down.
_expected: set[ref[Callable[[int], None]]] = set()
_python_ends = Event()


def when_complete(event: cl.Event, function: Callable[[], object]) -> None:
    """Have `function` called once the event is complete, or at once if it already is; never while Python shuts down."""

    def called(_: int) -> None:
        function()

    # The driver's thread releases `called` as its last action that holds the GIL; if Python code removed it from the
    # set, Python could end before that thread is done.
    _expected.add(ref(called, _expected.discard))
    if not _python_ends.is_set():
        event.set_callback(cl.command_execution_status.COMPLETE, called)


@atexit.register
def _await_them() -> None:
    """Wait for pending callbacks as long as any still arrive: one that runs during Python's shutdown would abort the
    process. Threads that wait for one that never arrives must then poll."""
    _python_ends.set()
    left, end = len(_expected), time.monotonic() + LAST_WAIT
    while _expected and time.monotonic() < end:
        if len(_expected) < left:
            left, end = len(_expected), time.monotonic() + LAST_WAIT
        time.sleep(1e-3)
