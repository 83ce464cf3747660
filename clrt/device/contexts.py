"""One context a device, shared by all that is opened on it, and the programs that were built in it.

Each takes time and memory (with PoCL a compiler of a hundred megabytes), and compilers keep something of every program
(PoCL 3 a quarter of a megabyte) until it ends. So it is used again, but not once it compiled MOST_COMPILED programs, or
anything has failed: a device that was lost needs another. All contexts of PoCL that there are at a time share one
compiler (its pocl_llvm_utils.cc), so what a worn one has kept is freed only if it ends before the next begins.
"""

from __future__ import annotations

import atexit
import ctypes
from dataclasses import dataclass, field

import pyopencl as cl
from pyopencl import Context

from ..threads import Event

MOST_COMPILED = 40


@dataclass(eq=False)
class Shared:
    """A context; programs: those of it that were used last, by their key; ahead: of what another process
    compiles, whether it is done; compiled: how many programs were compiled in it."""

    context: Context
    programs: dict[str, cl.Program] = field(default_factory=dict)
    ahead: dict[str, Event] = field(default_factory=dict)
    compiled: int = 0

    @property
    def worn(self) -> bool:
        """Whether its device should be opened anew."""
        return self.compiled >= MOST_COMPILED


#: By device, those that are opened again.
_shared: dict[int, Shared] = {}


def shared_by(device: cl.Device) -> Shared:
    """The context to open it with."""
    if device.int_ptr in _shared and _shared[device.int_ptr].worn:
        del _shared[device.int_ptr]
    if device.int_ptr not in _shared:
        _shared[device.int_ptr] = Shared(Context([device]))
    return _shared[device.int_ptr]


def share_no_more() -> None:
    """Something failed: what is opened from now on has contexts of its own."""
    _shared.clear()


@atexit.register
def _end_with_the_process() -> None:
    """PoCL 3 aborts where a context ends in which a program was damaged, and then all work is done."""
    for shared in _shared.values():
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(shared))
