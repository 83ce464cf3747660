"""Memory and processor time of this process and of those that it has started."""

from __future__ import annotations

import os
import sys
import time
from contextlib import suppress
from pathlib import Path

#: Written to clear_refs, it makes the present memory the peak (Linux, Documentation/filesystems/proc.rst).
RESET_PEAK = "5"


def peak_bytes() -> int | None:
    """Return this process's peak memory; None if the system does not report it.

    On Linux, /proc is more accurate than getrusage, which includes the parent's peak.
    """
    if (peak := _status("self", "VmHWM")) is not None:
        return peak
    try:
        from resource import RUSAGE_SELF, getrusage
    except ImportError:
        return None
    return getrusage(RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def reset_peak() -> int | None:
    """Return this process's present memory, and make it the peak; None, without effect, elsewhere than on Linux."""
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text(RESET_PEAK)
        return _status("self", "VmRSS")
    return None


def children_peak_bytes() -> int:
    """Return the sum of the peaks of the running child processes; 0 elsewhere than on Linux."""
    return sum(_status(child, "VmHWM") or 0 for child in _children())


def cpu_seconds() -> float:
    """Return the processor time of this process and, on Linux, of its running child processes."""
    ticks = 0
    for child in _children():
        with suppress(OSError):
            fields = Path(f"/proc/{child}/stat").read_text().rpartition(")")[2].split()
            ticks += int(fields[11]) + int(fields[12])
    return time.process_time() + (ticks / os.sysconf("SC_CLK_TCK") if ticks else 0)


def _children() -> list[str]:
    with suppress(OSError):
        return [child for each in Path("/proc/self/task").glob("*/children") for child in each.read_text().split()]
    return []


def _status(process: str, key: str) -> int | None:
    with suppress(OSError, StopIteration):
        lines = Path(f"/proc/{process}/status").read_text().splitlines()
        return next(1024 * int(line.split()[1]) for line in lines if line.startswith(f"{key}:"))
    return None
