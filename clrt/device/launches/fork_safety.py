"""Detect the use of OpenCL after a fork: a child lacks the threads that serve its parent's devices, and would hang."""

from __future__ import annotations

import os

from ...errors import UsageError

_process = 0


def check_process() -> None:
    """Raise UsageError in a process that was forked from one in which this was called before."""
    global _process
    _process = _process or os.getpid()
    if is_forked():
        raise UsageError(
            "this process was forked from one that had used OpenCL, which is not supported: start it with "
            "multiprocessing's spawn method, or use clrt only in child processes"
        )


def is_forked() -> bool:
    """Return whether this process was forked from one that uses OpenCL."""
    return _process not in (0, os.getpid())
