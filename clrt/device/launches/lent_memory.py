"""Host memory lent to a device: this table owns it until every command that may use it has completed.

A buffer on a CPU may be a numpy array itself, and a copy may run in the background. OpenCL retains buffers for commands
in flight, but not the host memory behind them; and the code that waits for a command may be left at any line, by an
exception, a signal or garbage collection. So when a lent buffer is destroyed, a marker is enqueued after the commands
that may use it (all queues are in-order), and its array is released when that marker completes. Nothing here waits for
a launch.
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

from ..open import Device
from .event_callbacks import when_complete
from .fork_safety import is_forked

#: Seconds in which an idle queue completes a marker.
SOON = 2e-4


class LentBuffer(cl.Buffer):
    """A buffer that wraps a numpy array, and its loan."""

    loan: _Loan


class _Loan(weakref.ref[LentBuffer]):
    """A weak reference to a lent buffer that owns its array, and the marker to complete once the buffer is gone."""

    def __new__(cls, buffer: LentBuffer, array: NDArray[Any], queue: cl.CommandQueue) -> _Loan:
        return super().__new__(cls, buffer, _begin_return)

    def __init__(self, buffer: LentBuffer, array: NDArray[Any], queue: cl.CommandQueue) -> None:
        self._array, self._queue = array, queue
        self.marker: cl.Event | None = None

    def is_over(self) -> bool:
        """Return whether no command can use the array any more."""
        if self() is not None:
            return False
        if self.marker is None:
            self.marker = cl.enqueue_marker(self._queue)
            self._queue.flush()
        return _has_ended(self.marker)


class _Copy:
    """A copy in the background. Its event refers to the array, and destroying it before the copy ends would block."""

    def __init__(self, event: cl.Event) -> None:
        self._event = event

    def is_over(self) -> bool:
        """Return whether the copy has ended."""
        return _has_ended(self._event)


#: All loans and copies, by id.
_lent: dict[int, _Loan | _Copy] = {}


def lend(device: Device, array: NDArray[Any], access: int) -> LentBuffer:
    """Return a buffer that wraps the contiguous array, with `access` of mem_flags. The array must then not change."""
    buffer = LentBuffer(device.context, access | cl.mem_flags.USE_HOST_PTR, hostbuf=array)
    buffer.loan = _Loan(buffer, array, device.queue)
    _lent[id(buffer.loan)] = buffer.loan  # before any command can use it, in case of an interrupt
    return buffer


def take_back(*buffers: cl.Buffer) -> None:
    """End the loans of those buffers that are lent. All commands that use them must have completed."""
    for buffer in buffers:
        if isinstance(buffer, LentBuffer):
            _lent.pop(id(buffer.loan), None)


def begin_copy(device: Device, target: Any, source: Any) -> cl.Event:
    """Enqueue a copy between a buffer and a contiguous array, in either direction.

    The array belongs to the device until the event is complete.
    """
    event = cl.enqueue_copy(device.queue, target, source, is_blocking=False)
    copy = _Copy(event)
    _lent[id(copy)] = copy
    return event


def settle() -> None:
    """Release all arrays whose commands have completed."""
    if is_forked():
        return
    for number, each in list(_lent.items()):
        with suppress(cl.Error):  # the device was lost: keep the array
            if each.is_over():
                _lent.pop(number, None)


def _begin_return(loan: _Loan) -> None:
    """Return the array of a destroyed buffer: at once on an idle queue, else when its marker completes."""
    if id(loan) not in _lent or is_forked():
        return
    end = time.perf_counter() + SOON
    with suppress(cl.Error):
        while not loan.is_over():
            if loan.marker and time.perf_counter() > end:
                return when_complete(loan.marker, settle)
        _lent.pop(id(loan), None)


def _has_ended(event: cl.Event) -> bool:
    """Return whether a command has completed or failed."""
    return bool(event.command_execution_status <= cl.command_execution_status.COMPLETE)


@atexit.register
def _keep_for_good() -> None:
    """Keep all arrays alive at exit: commands may be in flight, and destroyed buffers no longer run Python code."""
    kept = [*_lent.values(), *(each() for each in _lent.values() if isinstance(each, _Loan))]
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(kept))
