"""Functions that are called as commands complete, by threads of the driver's."""

from __future__ import annotations

import atexit
import time
from collections.abc import Callable

import pyopencl as cl

from ..threads import Event

#: Those that are still to come; and whether no more should.
_expected: set[object] = set()
_python_ends = Event()


def when_complete(event: cl.Event, function: Callable[[], object]) -> None:
    """Has `function` called once the event is complete, or at once where that was before; never while Python ends."""
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
    """One that came while Python ends would abort the process; threads that still wait then do without."""
    _python_ends.set()
    start = time.perf_counter()
    while _expected and time.perf_counter() < start + 1:
        time.sleep(1e-3)
