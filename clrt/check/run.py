"""Checks a device in a process of its own: a driver that crashes or hangs is then a failed check and nothing more."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from datetime import datetime, timezone
from queue import Empty, SimpleQueue
from threading import Thread
from typing import IO, Any

from ..device.discover import DeviceInfo
from ..device.sources import kernel_digest
from ..device.verdicts import Verdict


def check_device(info: DeviceInfo, limit: float, on_part: Callable[[str], None] = lambda part: None) -> Verdict:
    """Checks the device for at most `limit` seconds; `on_part` hears the name of each part as it begins."""
    start, kernels = time.monotonic(), kernel_digest()
    part, failures, figures = "starting", list[str](), dict[str, float | str]()
    with tempfile.TemporaryFile() as errors:
        child = _start(info, errors)
        try:
            for told in _told(child, start + limit):
                if "begins" in told:
                    part = told["begins"]
                    on_part(part)
                else:
                    failures += [f"{part}: {failure}" for failure in told["failures"]]
                    figures |= told["figures"]
            if child.wait(max(0.0, start + limit - time.monotonic())):
                failures.append(f"{part}: {_end(child.returncode)}{_last_line(errors)}")
        except (Empty, subprocess.TimeoutExpired):
            failures.append(f"{part}: it did not finish in {limit:g} s")
        finally:
            child.kill()
            with suppress(subprocess.TimeoutExpired):
                child.wait(1.0)
    when = datetime.now(timezone.utc).isoformat(timespec="seconds")
    return Verdict(not failures, failures, when, round(time.monotonic() - start, 1), kernels, figures)


def _start(info: DeviceInfo, errors: IO[bytes]) -> subprocess.Popen[str]:
    """The process, which finds the same modules as this one wherever it is started."""
    path = os.pathsep.join(os.path.abspath(folder) for folder in sys.path)
    return subprocess.Popen([sys.executable, "-P", "-m", f"{__package__}.child", info.id], stdin=subprocess.DEVNULL,
                            stdout=subprocess.PIPE, stderr=errors, text=True, encoding="utf-8",
                            env={**os.environ, "PYTHONPATH": path})


def _told(child: subprocess.Popen[str], deadline: float) -> Iterator[dict[str, Any]]:
    """What the child tells until it ends; raises Empty at the deadline. Nothing here waits for a process that hangs."""
    lines: SimpleQueue[str] = SimpleQueue()

    def listen(output: IO[str]) -> None:
        for line in output:
            lines.put(line)
        lines.put("")

    assert child.stdout is not None
    Thread(target=listen, args=(child.stdout,), daemon=True).start()
    while (line := lines.get(timeout=max(0.0, deadline - time.monotonic()))).endswith("\n"):
        yield json.loads(line)


def _end(code: int) -> str:
    """How a process ended that should have returned 0."""
    if code < 0:
        return f"the driver crashed with signal {-code} ({signal.strsignal(-code)})"
    return f"the process ended with code {code}"


def _last_line(errors: IO[bytes]) -> str:
    """The last that was written, which says what was wrong if anything does."""
    errors.seek(0)
    lines = errors.read().decode(errors="replace").split("\n")
    last = next((line.strip() for line in reversed(lines) if line.strip()), "")
    return f"; it said: {last}" if last else ""
