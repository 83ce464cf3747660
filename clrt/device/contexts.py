"""One shared context per device, and the programs built in it.

Each context takes time and memory (with PoCL a compiler of a hundred megabytes), and compilers retain memory for every
program (PoCL 3 a quarter of a megabyte) until it ends. So a context is reused, but not after it has compiled
MOST_COMPILED programs, or after any failure: a lost device needs a new one. All contexts of PoCL that exist at the same
time share one compiler (its pocl_llvm_utils.cc), so what a worn context has retained is freed only if it ends before
the next is created.
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
class SharedContext:
    """A context and its programs.

    programs: those used last, by key. ahead: events that are set when another process has compiled a program, by key.
    compiled: how many programs were compiled in the context.
    """

    context: Context
    programs: dict[str, cl.Program] = field(default_factory=dict)
    ahead: dict[str, Event] = field(default_factory=dict)
    compiled: int = 0

    @property
    def worn(self) -> bool:
        """Return whether the device should be reopened with a new context."""
        return self.compiled >= MOST_COMPILED


#: Contexts for reuse, by device.
_shared: dict[int, SharedContext] = {}


def shared_by(device: cl.Device) -> SharedContext:
    """Return the shared context of the device, a new one if there is none or it is worn."""
    if device.int_ptr in _shared and _shared[device.int_ptr].worn:
        del _shared[device.int_ptr]
    if device.int_ptr not in _shared:
        _shared[device.int_ptr] = SharedContext(Context([device]))
    return _shared[device.int_ptr]


def share_no_more() -> None:
    """Forget all shared contexts after a failure: devices opened from now on get new ones."""
    _shared.clear()


@atexit.register
def _end_with_the_process() -> None:
    """Keep contexts alive until the process ends: PoCL 3 aborts when a context ends in which a program was damaged."""
    for shared in _shared.values():
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(shared))
