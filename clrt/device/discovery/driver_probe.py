"""Probe whether drivers can be loaded, each in a child process, as one may crash or hang the process that loads it.

`python -m clrt.device.discovery.driver_probe LIBRARY` is that process. It does everything that listing devices
does, and prints the fault.
"""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from typing import IO

from ...awake import AwakeClock
from ..driver_caches import no_room
from ..programs.child_process import activity, end_child, last_line, start_child, told_end
from .describe_device import describe, size_of
from .loader import devices_of, load

#: Time limit of all probes together in seconds. A slow start of many GPUs is not a hang.
LIMIT = 7.0
#: On a busy machine the limit may be extended up to PATIENCE times, as long as a probe computes, or waits for a
#: processor or a disk, at least once in IDLE seconds.
PATIENCE, IDLE = 10.0, 2.0


def probe(libraries: Sequence[str], limit: float = LIMIT) -> list[str]:
    """Return the fault of each driver, empty if there is none. All are probed at the same time."""
    with tempfile.TemporaryDirectory(prefix="clrt-probes-") as folder:  # for files that crashed probes leave behind
        return _probe(libraries, limit, folder)


def _probe(libraries: Sequence[str], limit: float, folder: str) -> list[str]:
    logs = [(tempfile.TemporaryFile(), tempfile.TemporaryFile()) for _ in libraries]
    children = [start_child(__name__, library, *log, TMPDIR=folder) for library, log in zip(libraries, logs)]
    try:
        _wait(children, limit)
        return [_fault(child, *log, limit) for child, log in zip(children, logs)]
    finally:
        for child, log in zip(children, logs):
            end_child(child)
            for file in log:
                file.close()


def _wait(children: Sequence[subprocess.Popen[str]], limit: float) -> None:
    """Wait until all children have ended, are idle after the limit, or have used the whole limit as CPU time each."""
    clock = AwakeClock()
    busy = {child: (0.0, 0.0) for child in children}  # CPU time of each, and when it was last active
    while busy:
        time.sleep(0.02)
        now = clock.look()
        for child, (before, since) in list(busy.items()):
            seconds, waits = activity(child)
            busy[child] = before, since = (seconds, now) if seconds > before or waits else (before, since)
            late = now > limit and (now - since > min(IDLE, limit) or before > limit)
            if child.poll() is not None or late or now > PATIENCE * limit:
                del busy[child]


def _fault(child: subprocess.Popen[str], output: IO[bytes], errors: IO[bytes], limit: float) -> str:
    code = child.poll()
    if code is None:
        return f"it hangs: no answer in {limit:g} s"
    if code:
        return "; ".join(filter(None, [told_end(code) + last_line(errors), no_room()]))
    output.seek(0)
    return output.read().decode(errors="replace").strip()


def main() -> None:
    """Load the driver that the first argument names and print its fault. Its own output goes to standard error."""
    with os.fdopen(os.dup(1), "w", encoding="utf-8") as result:
        os.dup2(2, 1)
        _no_core_dump()
        result.write(_what_is_wrong(sys.argv[1]))
    os._exit(0)  # some drivers crash when they are unloaded


def _what_is_wrong(library: str) -> str:
    platforms = load([library])
    for platform in platforms:
        for device in devices_of(platform):
            describe(device), size_of(device)
    if platforms:
        return ""
    try:
        ctypes.CDLL(library)
    except OSError as error:
        return f"it cannot be loaded: {error}"
    return "it provides no platform, probably because its hardware is missing"


def _no_core_dump() -> None:
    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))


if __name__ == "__main__":
    main()
