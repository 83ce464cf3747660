"""Processes of our own for what a driver may crash or hang in; the process that starts one goes on."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import IO


def start_child(module: str, argument: str, output: IO[bytes] | int, errors: IO[bytes] | int,
                given: IO[bytes] | int = subprocess.DEVNULL, **variables: str) -> subprocess.Popen[str]:
    """`python -m module argument`, which finds the same modules as this process wherever it is started; given: its
    standard input; `variables` are added to its environment."""
    path = os.pathsep.join(os.path.abspath(folder) for folder in sys.path)
    environment = {**os.environ, "PYTHONPATH": path, **variables}
    return subprocess.Popen([sys.executable, "-P", "-m", module, argument], stdin=given, stdout=output, stderr=errors,
                            text=True, encoding="utf-8", env=environment)


def end_child(child: subprocess.Popen[str]) -> None:
    """Kills it, and does not wait for one that hangs in the kernel."""
    child.kill()
    with suppress(subprocess.TimeoutExpired):
        child.wait(1.0)


def activity(child: subprocess.Popen[str]) -> tuple[float, bool]:
    """The processor time that it took so far, and whether it wants more, or waits for a disk; (0, False) where that is
    not known (it has ended, or this is not Linux)."""
    try:
        status = Path(f"/proc/{child.pid}/stat").read_text(encoding="utf-8", errors="replace")
        fields = status.rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK"), fields[0] in "RD"
    except (OSError, IndexError, ValueError):
        return 0.0, False


def told_end(code: int) -> str:
    """How a process ended that should have returned 0."""
    if code < 0:
        return f"the driver crashed with signal {-code} ({signal.strsignal(-code)})"
    return f"the process ended with code {code}"


def last_line(errors: IO[bytes]) -> str:
    """The last that was written, which says what was wrong if anything does."""
    errors.seek(0)
    lines = errors.read().decode(errors="replace").split("\n")
    last = next((line.strip() for line in reversed(lines) if line.strip()), "")
    return f"; it said: {last}" if last else ""
