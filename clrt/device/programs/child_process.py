"""Child processes that isolate crashes and hangs of drivers from the process that starts them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import IO


def start_child(
    module: str,
    argument: str,
    output: IO[bytes] | int,
    errors: IO[bytes] | int,
    given: IO[bytes] | int = subprocess.DEVNULL,
    own_group: bool = False,
    **variables: str,
) -> subprocess.Popen[str]:
    """Start `python -m module argument` with this process's module search path, wherever it is started.

    given: its standard input; own_group: whether `end_group` can end it with the processes that it starts. `variables`
    are added to its environment.
    """
    path = os.pathsep.join(os.path.abspath(folder) for folder in sys.path)
    environment = {**os.environ, "PYTHONPATH": path, **variables}
    return subprocess.Popen(
        [sys.executable, "-P", "-m", module, argument],
        stdin=given,
        stdout=output,
        stderr=errors,
        text=True,
        encoding="utf-8",
        env=environment,
        start_new_session=own_group,
    )


def end_child(child: subprocess.Popen[str]) -> None:
    """Kill the child and wait at most 1 s: it may hang in the kernel."""
    child.kill()
    with suppress(subprocess.TimeoutExpired):
        child.wait(1.0)


def end_group(child: subprocess.Popen[str]) -> None:
    """Kill a child that has its own group, with all processes that it started; on Windows only the child."""
    if sys.platform != "win32":
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(child.pid, signal.SIGKILL)
    end_child(child)


def activity(child: subprocess.Popen[str]) -> tuple[float, bool]:
    """Return the CPU time of the child so far in seconds, and whether it is runnable or waits for a disk.

    Returns (0, False) if that is not known (it has ended, or this is not Linux).
    """
    try:
        status = Path(f"/proc/{child.pid}/stat").read_text(encoding="utf-8", errors="replace")
        fields = status.rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK"), fields[0] in "RD"
    except (OSError, IndexError, ValueError):
        return 0.0, False


def told_end(code: int) -> str:
    """Describe how a process ended that should have returned 0."""
    if code < 0:
        return f"the driver crashed with signal {-code} ({signal.strsignal(-code)})"
    return f"the process exited with code {code}"


def last_line(errors: IO[bytes]) -> str:
    """Return the last non-empty line of `errors` for a message, or an empty string."""
    errors.seek(0)
    lines = errors.read().decode(errors="replace").split("\n")
    last = next((line.strip() for line in reversed(lines) if line.strip()), "")
    return f"; its last output: {last}" if last else ""
