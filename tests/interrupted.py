"""An exception at a given line, as a signal's handler raises it wherever the program is."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import FrameType
from typing import Any


class Interrupted(Exception):
    """As if a signal had come."""


def run(call: Callable[[], object], files: tuple[str, ...], last: int = -1) -> int:
    """Calls it up to its line of this number, counted over all that it runs of files whose paths begin so; how many
    there were. As many as `last`, or more: it was interrupted there."""
    count = 0

    def trace(frame: FrameType, event: str, argument: Any) -> Any:
        nonlocal count
        if not frame.f_code.co_filename.startswith(files):
            return None
        count += event == "line"
        if event == "line" and count == last:
            raise Interrupted
        return trace

    sys.settrace(trace)
    try:
        call()
    except Interrupted:
        pass
    finally:
        sys.settrace(None)
    return count
