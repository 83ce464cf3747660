"""Functions that are called as commands complete, by threads of the driver's."""

from __future__ import annotations

import atexit
import time
from collections.abc import Callable
from weakref import ref

import pyopencl as cl

from ..threads import LAST_WAIT, Event

#: Those that are still to come or under way; and whether no more should.
_expected: set[ref[Callable[[int], None]]] = set()
_python_ends = Event()


def when_complete(event: cl.Event, function: Callable[[], object]) -> None:
    """Has `function` called once the event is complete, or at once where that was before; never while Python ends."""
    def called(_: int) -> None:
        function()

    # The driver's thread lets go of `called` as the last thing for which it holds Python's lock; a line of Python that
    # noted its end could be followed by the end of Python.
    _expected.add(ref(called, _expected.discard))
    if not _python_ends.is_set():
        event.set_callback(cl.command_execution_status.COMPLETE, called)


@atexit.register
def _await_them() -> None:
    """One that came while Python ends would abort the process: so all are waited for as long as any still come.
    Threads that wait for one that does not come do without."""
    _python_ends.set()
    left, end = len(_expected), time.monotonic() + LAST_WAIT
    while _expected and time.monotonic() < end:
        if len(_expected) < left:
            left, end = len(_expected), time.monotonic() + LAST_WAIT
        time.sleep(1e-3)
