"""Check masks of eight lanes: their bits, and the operations for BVHs with eight children (kernels/core/mask.cl)."""

from __future__ import annotations

import numpy as np

from ..device.open import Device
from .findings import Findings
from .kernel_calls import CheckProgram

COUNT = 512


def check_masks(device: Device, findings: Findings) -> None:
    """Check every pattern of lanes, twice, with numbers in a known order."""
    rng = np.random.default_rng(3)
    mask = (np.arange(COUNT)[:, None] >> np.arange(8) & 1).astype(bool)
    b = rng.permuted(np.tile(np.arange(1, 9), (COUNT, 1)), axis=1).astype(np.float32)
    a = np.where(mask, b - 0.5, b + rng.integers(0, 2, b.shape)).astype(np.float32)
    (out,) = CheckProgram(device, "masks").run("masks", COUNT, np.stack([a, b]), out=[(np.int32, 3 * 8 * COUNT)])
    lanes, stored, facts = out.reshape(3, COUNT, 8)
    findings.same(lanes.ravel(), np.where(mask, -1, 0).ravel(), "lanes of a comparison", a.ravel(), b.ravel())
    first = np.where(mask.any(axis=1), mask.argmax(axis=1), -1)
    least = np.where(mask.any(axis=1), np.where(mask, b, 9).argmin(axis=1), 7)
    sixteen = np.concatenate([mask, ~mask], axis=1) @ (1 << np.arange(16))
    for column, (name, truth) in enumerate(
        {
            "bits": mask @ (1 << np.arange(8)),
            "number of lanes": mask.sum(axis=1),
            "first lane": first,
            "least lane": least,
            "sixteen bits": sixteen,
        }.items()
    ):
        findings.same(facts[:, column], truth, f"{name} of a mask", mask.astype(int), b)
    for row, kept in enumerate(mask):
        truth = np.append(a[row][kept].view(np.int32), np.full(8 - kept.sum(), -1))
        findings.same(stored[row], truth, "stored lanes", a[row])
