"""Check random numbers, and the compensated sums of samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..device.open import Device
from .effort import share
from .findings import Findings
from .kernel_calls import CheckProgram

Words = NDArray[np.uint32]
COUNT = 1024
SAMPLES = 128


def check_random_numbers(device: Device, findings: Findings) -> None:
    """Check that the device's numbers equal those of the same hash in numpy, and lie in [0, 1)."""
    rng, probe = np.random.default_rng(5), CheckProgram(device, "samples", device.lanes)
    index = rng.integers(0, 1 << 32, (2, COUNT), np.uint32)
    for seed, dimension in ((0, 0), (7, 3), (0xFFFFFFFF, 1000)):
        bits, units = probe.run(
            "numbers",
            COUNT // device.lanes,
            index,
            seed,
            dimension,
            out=[(np.uint32, 2 * COUNT), (np.float32, 2 * COUNT)],
        )
        truth = np.concatenate(pcg4d(index[0], index[1], np.uint32(dimension), np.uint32(seed)))
        where = np.tile(index, 2)
        findings.same(bits, truth, "random bits", *where)
        findings.same(units, (truth >> 8) / 2.0**24, "random numbers", *where)


def pcg4d(*words: Words | np.uint32) -> tuple[Words, Words]:
    """Return the second and third word of pcg4d (Jarzynski and Olano 2020, listing 4), including its LCG step."""
    with np.errstate(over="ignore"):
        x, y, z, w = (np.uint32(1664525) * v + np.uint32(1013904223) for v in words)
        x, y, z, w = (x + y * w, y, z, w)
        y = y + z * x
        z = z + x * y
        w = w + y * z
        x, y, z, w = (v ^ v >> np.uint32(16) for v in (x, y, z, w))
        x = x + y * w
        y = y + z * x
        return y, z + x * y


def check_sums(device: Device, findings: Findings) -> None:
    """Check that sums of samples, and of their squares, are exact, and that non-finite samples are dropped and counted.

    Samples are k or k·2^12 with k < 2^8, so the sum of 128 of them, and its compensation as a second float, are
    integers of 24 bits times a power of two: plain float sums, or reordered additions, lose some.
    """
    rng, count = np.random.default_rng(6), share(device, COUNT // 16, 1) * 16
    samples = rng.integers(0, 256, (SAMPLES, count)) << 12 * rng.integers(0, 2, (SAMPLES, count))
    kept = rng.random(samples.shape) < 63 / 64
    others = rng.choice(np.array([np.nan, np.inf, -np.inf, 2e31], np.float32), samples.shape)
    sums, counts = CheckProgram(device, "samples", device.lanes).run(
        "sums",
        count // device.lanes,
        np.where(kept, samples, others).astype(np.float32),
        SAMPLES,
        out=[(np.float32, 4 * count), (np.uint32, 2 * count)],
    )
    counted = np.concatenate([kept.sum(axis=0), (~kept).sum(axis=0)])
    findings.same(counts, counted, "samples kept, and samples dropped")
    pairs = sums.reshape(2, 2, count).astype(np.float64)
    for name, (total, error), values in zip(("sum", "sum of squares"), pairs, (samples, samples**2)):
        truth = np.where(kept, values, 0).sum(axis=0)  # integers below 2^48, so exact
        findings.same(total + error, truth.astype(np.float64), name)  # exact in float64, too
        findings.expect(
            np.abs(error) <= np.spacing(total.astype(np.float32)) / 2,
            f"error kept with the {name}",
            ("of", total),
            ("is", error),
        )
