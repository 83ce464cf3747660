"""Scale the work of a check down for slow devices such as simulators, so that it ends in seconds there, too."""

from __future__ import annotations

import time

import numpy as np

from ..device.open import Device
from .kernel_calls import CheckProgram

#: A small workload, and the seconds within which a device must do it to get the full check. A CPU takes a tenth of
#: that.
ITEMS, SAMPLES, SECONDS = 64, 128, 0.005
#: Number of attempts, as other programs may interfere, and seconds after which no more are made.
TRIES, ENOUGH = 5, 0.5
_efforts: dict[str, float] = {}


def effort(device: Device) -> float:
    """Return the fraction of the full work that suits the device, 1 for ordinary ones. Measured once per process."""
    if device.info.id not in _efforts:
        _efforts[device.info.id] = min(1.0, SECONDS / _seconds(device))
    return _efforts[device.info.id]


def share(device: Device, full: int, least: int) -> int:
    """Return the share of `full` that suits the device, but at least `least`."""
    return max(least, int(full * effort(device)))


def _seconds(device: Device) -> float:
    """Return the minimum time of the small workload, without compiling its kernel."""
    probe, samples = CheckProgram(device, "samples", device.lanes), np.ones((SAMPLES, ITEMS), np.float32)
    out = [(np.float32, 4 * ITEMS), (np.uint32, 2 * ITEMS)]
    probe.run("sums", ITEMS // device.lanes, samples, 1, out=out)
    best, start = np.inf, time.perf_counter()
    for _ in range(TRIES):
        began = time.perf_counter()
        probe.run("sums", ITEMS // device.lanes, samples, SAMPLES, out=out)
        best = min(best, time.perf_counter() - began)
        if best <= SECONDS or time.perf_counter() - start > ENOUGH:
            break
    return best
