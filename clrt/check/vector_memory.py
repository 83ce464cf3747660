"""Check unaligned vector loads and stores, atomics, and parallel prefix sums."""

from __future__ import annotations

import numpy as np

from ..device.open import Device
from .findings import Findings
from .kernel_calls import CheckProgram

COUNT, PLACES = 4096, 7
#: Large enough for several work-groups to scan parts of it (device/launches/data_parallel.py), and not a round number.
SCANNED = 30011


def check_memory(device: Device, findings: Findings) -> None:
    """Check that copies are exact, that atomics lose no update, and that prefix sums are correct."""
    rng, probe = np.random.default_rng(4), CheckProgram(device, "memory")
    floats = rng.random(17 * COUNT, np.float32)
    (moved,) = probe.run("move", COUNT, floats, out=[(np.float32, floats.size)])
    findings.same(moved, floats, "numbers moved by vectors")

    numbers = rng.integers(0, 1 << 32, COUNT, np.uint32)
    counts, largest = probe.run("share", COUNT, numbers, PLACES, out=[(np.uint32, PLACES)] * 2)
    findings.same(counts, np.bincount(numbers % PLACES, minlength=PLACES), "atomic_inc")
    most = np.array([numbers[numbers % PLACES == place].max() for place in range(PLACES)])
    findings.same(largest, most, "atomic_max")

    parts = rng.integers(0, 1 << 16, (2, SCANNED), np.uint32)
    array = probe.work.upload(parts)
    probe.work.scan(array, SCANNED, arrays=2)
    scanned = probe.work.download(array, np.uint32, 2 * SCANNED)
    before = np.cumsum(parts, axis=1, dtype=np.int64) - parts
    findings.same(scanned, before.ravel(), "sums before each number", parts.ravel())
    findings.same(np.array(probe.work.sums(2)), parts.sum(axis=1, dtype=np.int64), "sums of all")
