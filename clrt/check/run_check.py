"""Check a device in a child process, so that a driver that crashes or hangs only fails the check."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Callable
from datetime import UTC, datetime
from queue import Empty

from ..awake import AwakeClock
from ..device.device_info import DeviceInfo, Verdict
from ..device.programs.child_process import end_child, last_line, start_child, told_end
from ..device.programs.child_results import child_results
from ..device.programs.kernel_files import kernel_digest
from ..errors import DeviceError

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
            for told in child_results(child, lambda: clock.look() >= limit):
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
