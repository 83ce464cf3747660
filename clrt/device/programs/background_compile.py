"""Run compilers in a background thread, so that signals are handled meanwhile and a hung compiler can be abandoned."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import TypeVar

from ...awake import wait_awake
from ...errors import KernelError
from ...threads import Event, beside

T = TypeVar("T")
#: Seconds after which a compiler counts as slow, and after which it counts as hung.
SLOW, LIMIT = 15.0, 600.0
_log = logging.getLogger(__name__)
#: Whether the process exits without Python's shutdown, as the command line's does (clrt.__main__).
ends_at_once = False


def in_background(where: str, work: Callable[[], T]) -> T:
    """Return or raise what `work` does, run in a thread. Raises KernelError if it takes longer than LIMIT.

    where: the device whose compiler runs, for messages. If it hangs, its thread and resources leak, but the process can
    go on.
    """
    done = Event()

    def run() -> T:
        try:
            return work()
        finally:
            done.set()

    result = beside(run, daemon=ends_at_once)
    if not wait_awake(done, SLOW):
        _log.warning("%s has been compiling a kernel for %g s; the limit is %g s", where, SLOW, LIMIT)
        if not wait_awake(done, LIMIT - SLOW):
            raise KernelError(
                f"{where} has been compiling a kernel for {LIMIT:g} s: its compiler hangs, or is far too "
                "slow; update the driver, or choose another device (`clrt devices`)"
            )
    return result()
