"""Results that a child process prints while it runs, one JSON object per line."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable, Iterator
from queue import Empty, SimpleQueue
from typing import IO, Any

from ...threads import BEAT, beside


def child_results(child: subprocess.Popen[str], is_over: Callable[[], bool]) -> Iterator[dict[str, Any]]:
    """Yield the child's results until it ends. Raises Empty once `is_over`, and never waits for a process that hangs.

    The child's standard output must be a pipe.
    """
    lines: SimpleQueue[str] = SimpleQueue()

    assert child.stdout is not None
    output: IO[str] = child.stdout

    def listen() -> None:
        for line in output:
            lines.put(line)
        lines.put("")

    beside(listen, daemon=True)
    while not is_over():
        try:
            line = lines.get(timeout=BEAT)
        except Empty:
            continue
        if not line.endswith("\n"):
            return
        yield json.loads(line)
    raise Empty
