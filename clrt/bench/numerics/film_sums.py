"""Film accumulation: whether means stay accurate for any number of samples, and non-finite samples are dropped."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ...rendering.compile.records import PIXEL
from ...rendering.film.film import Film
from ..kernel_probe import Doubles, Probe

#: Samples per launch; llvmpipe terminates loops after 65535 iterations.
LAUNCH = 1 << 15
LARGEST_SUM = 1e38
#: Rows of the kernel's state, in order.
STATE = ("sum", "sum_error", "square", "square_error")
#: Streams of radiances by name: (common value, rare value, period). Every `period`-th sample is the rare value.
STREAMS: dict[str, tuple[tuple[float, float, float], tuple[float, float, float], int]] = {
    "constant": ((1.0, 0.1, 1 + 2.0**-23), (1.0, 0.1, 1 + 2.0**-23), 2),
    "far apart": ((1e6, 1e-6, 1e30), (1e6, 1e-6, 1e30), 2),
    "tiny": ((1 / 3, 255.0, 3e-38), (1 / 3, 255.0, 3e-38), 2),
    "two values": ((0.1, 1e-6, 1e-6), (0.7, 1.0, 1e6), 2),
    "rare peaks": ((1e-6, 0.3, 1.0), (1e6, 1e5, 1e30), 4093),
}


class Sums(NamedTuple):
    """Film of a row of pixels. exact: (n, 3) means of the float32 radiances that were added."""

    film: Film
    exact: Doubles


def accumulate(probe: Probe, often: Doubles, seldom: Doubles, period: int, samples: int, before: int = 0) -> Sums:
    """Add `samples` samples to pixels that hold `before` samples of `often` (n, 3); every period-th one is `seldom`."""
    pair = [a.astype(np.float32).astype(np.float64) for a in (often, seldom)]
    state, counts, added = np.zeros((len(often), 12)), np.zeros((len(often), 2)), 0
    if before:
        state = np.hstack([_split(before * pair[0]), _split(np.minimum(before * pair[0] ** 2, LARGEST_SUM))])
    while added < samples:
        launch = min(samples - added, LAUNCH - LAUNCH % period)
        out = probe("accumulate", 14, often, seldom, state, samples=launch, period=period)
        state, added = out[:, :12], added + launch
        counts += out[:, 12:]
    pixels = np.zeros((1, len(often)), PIXEL)
    for k, name in enumerate(STATE):
        pixels[name] = state[None, :, 3 * k : 3 * k + 3]
    pixels["count"], pixels["dropped"] = counts.T[:, None] + [[[before]], [[0]]]
    rare = samples // period
    return Sums(Film(pixels), (pair[0] * (before + samples - rare) + pair[1] * rare) / (before + samples))


def stream_errors(probe: Probe, samples: int, before: int = 0) -> Iterator[tuple[str, float, int]]:
    """Yield each stream's name, the largest relative error of a mean, and the error of the film's sample count."""
    for name, (often, seldom, period) in STREAMS.items():
        sums = accumulate(probe, np.array([often]), np.array([seldom]), period, samples, before)
        error = float(np.max(np.abs(sums.film.mean[0] / sums.exact - 1)))
        yield name, error, abs(sums.film.samples - samples - before) + sums.film.nonfinite_samples


def _split(sums: Doubles) -> Doubles:
    """Split float64 numbers into float32 and remainder, (n, 6)."""
    head = sums.astype(np.float32).astype(np.float64)
    return np.hstack([head, sums - head])
