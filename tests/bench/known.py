"""Contestants and a reference with known errors."""

from __future__ import annotations

import numpy as np

from clrt.bench.convergence.contestants import Contestant, Picture
from clrt.bench.convergence.reference import Reference

TRUTH = np.random.default_rng(3).uniform(0, 2, (48, 64, 3))
MEANS = np.tile(TRUTH.mean((0, 1)), (2, 1))
EXACT = Reference(MEANS, 2 * TRUTH, 2 * TRUTH**2)
#: relMSE of images with variance 1.
UNIT = float(np.mean(1 / (TRUTH**2 + 0.01)))


def sampler(
    variance: float, seconds: float, power: float = 1.0, gain: float = 1.0, told: float | None = None
) -> Contestant:
    """Return a contestant whose images have this variance over samples**power, at `seconds` per sample.

    gain: brightness factor, 1 if unbiased; told: the reported noise over the root of the expected relMSE.
    """

    def render(spp: int, seed: int) -> Picture:
        square = variance / spp**power
        noise = np.random.default_rng([seed, spp]).normal(size=TRUTH.shape) * np.sqrt(square)
        return Picture(
            spp,
            seconds * spp,
            2 * seconds * spp,
            (gain * TRUTH + noise).astype(np.float32),
            None if told is None or spp < 2 else told * float(np.sqrt(square * UNIT)),
        )

    return render
