"""Check a device in a child process, so that a driver that crashes or hangs only fails the check."""

from __future__ import annotations

import json
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from queue import Empty, SimpleQueue
from typing import IO, Any

from ..awake import AwakeClock
from ..device.device_info import DeviceInfo, Verdict
from ..device.programs.child_process import end_child, last_line, start_child, told_end
from ..device.programs.kernel_files import kernel_digest
from ..errors import DeviceError
from ..threads import BEAT, beside

#: Time limit in seconds that suffices for any device that responds: exceeding a lower one is not a failure.
LIMIT = 300.0


def check_device(info: DeviceInfo, limit: float, on_part: Callable[[str], None] = lambda part: None) -> Verdict:
    """Check the device for at most `limit` seconds; `on_part` is called with the name of each part as it begins.

    Raises DeviceError if there was no failure before a limit below LIMIT expired.
    """
    clock, kernels = AwakeClock(), kernel_digest()
    part, failures, figures = "starting", list[str](), dict[str, float | str]()
    with tempfile.TemporaryFile() as errors:
        child = start_child(f"{__package__}.check_process", info.id, subprocess.PIPE, errors)
        try:
            for told in _told(child, clock, limit):
                if "begins" in told:
                    part = told["begins"]
                    on_part(part)
                else:
                    failures += [f"{part}: {failure}" for failure in told["failures"]]
                    figures |= told["figures"]
            if child.wait(max(0.0, limit - clock.seconds)):
                failures.append(f"{part}: {told_end(child.returncode)}{last_line(errors)}")
        except (Empty, subprocess.TimeoutExpired):
            if limit < LIMIT and not failures:
                raise DeviceError(
                    f"{info.name} cannot be checked: {part} did not finish in {limit:g} s; raise "
                    f"--limit ({LIMIT:g} is the default)"
                ) from None
            failures.append(f"{part}: it did not finish in {limit:g} s")
        finally:
            end_child(child)
    when = datetime.now(UTC).isoformat(timespec="seconds")
    return Verdict(not failures, failures, when, round(clock.seconds, 1), kernels, figures)


def _told(child: subprocess.Popen[str], clock: AwakeClock, limit: float) -> Iterator[dict[str, Any]]:
    """Yield the child's results until it ends. Raises Empty at the limit, and never waits for a process that hangs."""
    lines: SimpleQueue[str] = SimpleQueue()

    assert child.stdout is not None
    output: IO[str] = child.stdout

    def listen() -> None:
        for line in output:
            lines.put(line)
        lines.put("")

    beside(listen, daemon=True)
    while clock.look() < limit:
        try:
            line = lines.get(timeout=min(BEAT, limit))
        except Empty:
            continue
        if not line.endswith("\n"):
            return
        yield json.loads(line)
    raise Empty
