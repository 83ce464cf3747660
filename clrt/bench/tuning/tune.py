"""Tuning of a device: the fastest candidate of a trial in child processes, which may hang or crash."""

from __future__ import annotations

import json
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from math import exp, log
from queue import Empty
from statistics import fmean

from ...device.device_info import DeviceInfo, Tuning
from ...device.open import Device
from ...device.programs.child_process import end_child, last_line, start_child, told_end
from ...device.programs.child_results import child_results
from ...errors import DeviceError
from .candidates import candidates

TRIAL = "clrt.bench.tuning.trial"
#: Factor by which a candidate must be faster than the first, the one expected to be best.
TELLING = 1.03
#: Seconds for the child to exit after its last result.
EXIT = 10.0


@dataclass(frozen=True)
class Trial:
    """Result of a trial. seconds: least per sample, by scene, of each candidate that was measured, in their order;
    failures: why the others were not."""

    seconds: dict[Tuning, dict[str, float]]
    failures: dict[Tuning, str]

    @property
    def best(self) -> Tuning:
        """Return the fastest candidate by the geometric mean over the scenes, unless the first is nearly as fast."""
        times = {each: exp(fmean(map(log, seconds.values()))) for each, seconds in self.seconds.items()}
        first, best = next(iter(times)), min(times, key=lambda each: times[each])
        return first if times[first] < TELLING * times[best] else best


def tune(device: Device, limit: float, say: Callable[[str], None] = lambda message: None) -> Trial:
    """Try all candidates on a device, within `limit` seconds. Raises DeviceError if none of them ended.

    say: called with each failure. A candidate that crashes or hangs the driver is left out, and the trial goes on
    without it; one that is not reached in time is left out, too.
    """
    trial, left, end = Trial({}, {}), candidates(device), time.monotonic() + limit
    while left:
        ended, problem = _run(device.info, left, max(0.0, end - time.monotonic()) / len(left))
        trial.seconds.update((candidate, ended[candidate]) for candidate in left if candidate in ended)
        left = [each for each in left if each not in ended]
        if left:
            failed = left.pop(0)
            trial.failures[failed] = problem
            say(f"{device.info.name}: {failed.paths}, {failed.layout}: {problem}")
    if not trial.seconds:
        raise DeviceError(f"{device.info.name} cannot be tuned: {next(iter(trial.failures.values()))}")
    return trial


def _run(info: DeviceInfo, left: Sequence[Tuning], each: float) -> tuple[dict[Tuning, dict[str, float]], str]:
    """Run a child process for the candidates; return the times of those that it measured, and why the next was not.

    each: seconds that a candidate may take.
    """
    least: dict[Tuning, dict[str, float]] = {}
    deadline = time.monotonic() + each
    with tempfile.TemporaryFile() as given, tempfile.TemporaryFile() as errors:
        given.write(json.dumps([asdict(candidate) for candidate in left]).encode())
        given.seek(0)
        child = start_child(TRIAL, info.id, subprocess.PIPE, errors, given=given)
        try:
            for row in child_results(child, lambda: time.monotonic() >= deadline):
                seconds = least.setdefault(Tuning(**row["tuning"]), row["seconds"])
                seconds.update((scene, min(took, seconds[scene])) for scene, took in row["seconds"].items())
                deadline = time.monotonic() + each
            code = child.wait(EXIT)
            return least, f"{told_end(code)}{last_line(errors)}" if code else "it gave no result"
        except (Empty, subprocess.TimeoutExpired):
            return least, f"it did not finish in {each:.3g} s"
        finally:
            end_child(child)
