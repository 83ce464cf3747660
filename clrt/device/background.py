"""Compilers work in the background: signals come through meanwhile, and one that hangs is given up."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import TypeVar

from ..awake import wait_awake
from ..errors import KernelError
from ..threads import Event, beside

T = TypeVar("T")
#: Seconds after which a compiler is slow, and after which it is taken for one that hangs.
SLOW, LIMIT = 15.0, 600.0
_log = logging.getLogger(__name__)
#: Whether the process ends without that Python is taken apart, as that of the command line does (clrt.__main__).
ends_at_once = False


def in_background(where: str, work: Callable[[], T]) -> T:
    """What `work` returns or raises, which is done in a thread; KernelError where it takes longer than LIMIT.

    where: whose compiler it is, for messages. What it holds on to is lost where it hangs, but the process can go on.
    """
    done = Event()

    def run() -> T:
        try:
            return work()
        finally:
            done.set()

    result = beside(run, daemon=ends_at_once)
    if not wait_awake(done, SLOW):
        _log.warning("%s has been compiling a kernel for %g s; it is given up after %g s", where, SLOW, LIMIT)
        if not wait_awake(done, LIMIT - SLOW):
            raise KernelError(f"{where} has been compiling a kernel for {LIMIT:g} s: its compiler hangs, or is far too "
                              "slow. Update the driver, or choose another device (`clrt devices`)")
    return result()
