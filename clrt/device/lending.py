"""Memory of the host that is lent to a device: this table owns it until every command that may use it has completed.

A buffer on a CPU may be a numpy array itself, and a copy may run in the background. OpenCL retains buffers for commands
in flight, but not the memory behind them; and whoever waits for a command may be gone at any line, by an exception, a
signal or garbage collection. So when a lent buffer dies, a marker is enqueued behind the commands that may use it (all
queues run in order), and its array is let go when that marker completes. Nothing here waits for a launch.
"""

from __future__ import annotations

import atexit
import ctypes
import time
import weakref
from contextlib import suppress
from typing import Any

import pyopencl as cl
from numpy.typing import NDArray

from .callbacks import when_complete
from .fork import is_forked
from .open import Device

#: Seconds in which an idle queue completes a marker.
SOON = 2e-4


class LentBuffer(cl.Buffer):
    """A buffer that is a numpy array itself, and its loan."""

    loan: _Loan


class _Loan(weakref.ref[LentBuffer]):
    """A reference to a lent buffer that owns the array behind it, and the marker that must complete once it is dead."""

    def __new__(cls, buffer: LentBuffer, array: NDArray[Any], queue: cl.CommandQueue) -> _Loan:
        return super().__new__(cls, buffer, _begin_return)

    def __init__(self, buffer: LentBuffer, array: NDArray[Any], queue: cl.CommandQueue) -> None:
        self._array, self._queue = array, queue
        self.marker: cl.Event | None = None

    def is_over(self) -> bool:
        """Whether no command can use the array any more."""
        if self() is not None:
            return False
        if self.marker is None:
            self.marker = cl.enqueue_marker(self._queue)
            self._queue.flush()
        return _has_ended(self.marker)


class _Copy:
    """A copy in the background. Its event refers to the array, and would block where it dies before the copy ends."""

    def __init__(self, event: cl.Event) -> None:
        self._event = event

    def is_over(self) -> bool:
        """Whether it has ended."""
        return _has_ended(self._event)


#: By id, all that is lent.
_lent: dict[int, _Loan | _Copy] = {}


def lend(device: Device, array: NDArray[Any], access: int) -> LentBuffer:
    """A buffer that is the array (contiguous), with `access` of mem_flags. Nobody may write to the array meanwhile."""
    buffer = LentBuffer(device.context, access | cl.mem_flags.USE_HOST_PTR, hostbuf=array)
    buffer.loan = _Loan(buffer, array, device.queue)
    _lent[id(buffer.loan)] = buffer.loan    # before any command can use it, whatever interrupts this
    return buffer


def take_back(*buffers: cl.Buffer) -> None:
    """Ends the loans of those buffers that are lent. All commands that use them must have completed."""
    for buffer in buffers:
        if isinstance(buffer, LentBuffer):
            _lent.pop(id(buffer.loan), None)


def begin_copy(device: Device, target: Any, source: Any) -> cl.Event:
    """Enqueues a copy from a buffer to a contiguous array, or the other way; the array is the device's until the event
    is complete."""
    event = cl.enqueue_copy(device.queue, target, source, is_blocking=False)
    copy = _Copy(event)
    _lent[id(copy)] = copy
    return event


def settle() -> None:
    """Lets go of everything whose commands have completed."""
    if is_forked():
        return
    for number, each in list(_lent.items()):
        with suppress(cl.Error):    # of a device that is lost: it is kept
            if each.is_over():
                _lent.pop(number, None)


def _begin_return(loan: _Loan) -> None:
    """Called as a lent buffer dies: on an idle queue its loan ends now."""
    if id(loan) not in _lent or is_forked():
        return
    end = time.perf_counter() + SOON
    with suppress(cl.Error):
        while not loan.is_over():
            if loan.marker and time.perf_counter() > end:
                return when_complete(loan.marker, settle)
        _lent.pop(id(loan), None)


def _has_ended(event: cl.Event) -> bool:
    """Whether a command has completed or failed."""
    return bool(event.command_execution_status <= cl.command_execution_status.COMPLETE)


@atexit.register
def _keep_for_good() -> None:
    """Commands may be in flight as Python ends; then no line of it runs any more for buffers that die."""
    kept = [*_lent.values(), *(each() for each in _lent.values() if isinstance(each, _Loan))]
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(kept))
