"""Compilers work in the background: signals come through meanwhile, and one that hangs is given up."""

from __future__ import annotations

import atexit
import logging
import threading
from collections.abc import Callable
from typing import TypeVar

from ..awake import wait_awake
from ..errors import KernelError

T = TypeVar("T")
#: Seconds after which a compiler is slow, and after which it is taken for one that hangs.
SLOW, LIMIT = 15.0, 600.0
_log = logging.getLogger(__name__)
#: Whether the process ends without that Python is taken apart, as that of the command line does (clrt.__main__).
ends_at_once = False
_compiling: set[threading.Thread] = set()


def in_background(where: str, work: Callable[[], T]) -> T:
    """What `work` returns or raises, which is done in a thread; KernelError where it takes longer than LIMIT.

    where: whose compiler it is, for messages. What it holds on to is lost where it hangs, but the process can go on.
    """
    results, errors, done = list[T](), list[BaseException](), threading.Event()

    def run() -> None:
        try:
            results.append(work())
        except BaseException as error:  # whatever it is, it belongs to who waits
            errors.append(error)
        _compiling.discard(thread)
        done.set()

    thread = threading.Thread(target=run, daemon=True, name="clrt compiles")
    _compiling.add(thread)
    thread.start()
    if not wait_awake(done, SLOW):
        _log.warning("%s has been compiling a kernel for %g s; it is given up after %g s", where, SLOW, LIMIT)
        if not wait_awake(done, LIMIT - SLOW):
            raise KernelError(f"{where} has been compiling a kernel for {LIMIT:g} s: its compiler hangs, or is far too "
                              "slow. Update the driver, or choose another device (`clrt devices`)")
    if errors:
        raise errors[0]
    return results[0]


@atexit.register
def _await_compilers() -> None:
    """One that nobody waits for any more would, coming back while Python ends, abort the process."""
    for thread in [] if ends_at_once else list(_compiling):
        thread.join(SLOW)
