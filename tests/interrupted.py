"""Raises an exception at a given line, as a signal handler can at any point of the program."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import FrameType
from typing import Any


class Interrupted(BaseException):
    """Exception that stands for a KeyboardInterrupt, which `except Exception` does not catch."""


def run(call: Callable[[], object], files: tuple[str, ...], last: int = -1) -> int:
    """Call `call` and return how many lines it ran of files whose paths begin with `files`. Stop it with Interrupted at
    line number `last` of these; a result of `last` or more means that it was interrupted."""
    count = 0

    def trace(frame: FrameType, event: str, argument: Any) -> Any:
        nonlocal count
        if not frame.f_code.co_filename.startswith(files):
            return None
        count += event == "line"
        if event == "line" and count == last:
            raise Interrupted
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        call()
    except Interrupted:
        pass
    finally:
        sys.settrace(before)
    return count
