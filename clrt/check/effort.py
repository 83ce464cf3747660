"""How much a device is asked: of a slow one, as simulators are, less, so that its check ends in seconds, too."""

from __future__ import annotations

import time

import numpy as np

from ..device.open import Device
from .probe import Probe

#: A small work, and the seconds in which a device has to do it to be asked everything. A CPU takes a tenth of that.
ITEMS, SAMPLES, SECONDS = 64, 128, 0.005
#: How often it is tried, as other programs may be in the way, and seconds after which that is enough.
TRIES, ENOUGH = 5, 0.5
_efforts: dict[str, float] = {}


def effort(device: Device) -> float:
    """The part of the full work that suits the device, at most 1, as for ordinary ones. Measured once a process."""
    if device.info.id not in _efforts:
        _efforts[device.info.id] = min(1.0, SECONDS / _seconds(device))
    return _efforts[device.info.id]


def share(device: Device, full: int, least: int) -> int:
    """As much of `full` as suits the device, but at least so much."""
    return max(least, int(full * effort(device)))


def _seconds(device: Device) -> float:
    """The least that the small work took, once its kernel was compiled."""
    probe, samples = Probe(device, "samples", device.lanes), np.ones((SAMPLES, ITEMS), np.float32)
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
