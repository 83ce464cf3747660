"""Calibration of a renderer's error estimate: estimated √relMSE over the actual one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import inf, isfinite, log, nan, sqrt
from statistics import fmean, median
from typing import Any

#: An estimate is accurate if it is within this factor of the actual error.
RIGHT = 1.2


def noise_ratio(noise: float, error: float, own: float) -> float:
    """Return estimated √relMSE over the actual one, for an image whose relMSE against a reference is `error`.

    own: the reference's relMSE, which is part of `error`. NaN if nothing was estimated, or if the image's share of the
    error is not above the reference's.
    """
    return noise / sqrt(error - own) if error - own > own else nan


def calibrations(scenes: Iterable[Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return the `calibration` of each contestant that estimates errors, over all scenes (of `measure_convergence`)."""
    ratios: dict[str, list[float]] = {}
    for scene in scenes:
        for name, row in scene["contestants"].items():
            ratios.setdefault(name, []).extend(ratio for level in row["noise_ratio"] for ratio in level)
    return {name: calibration(known) for name, every in ratios.items() if (known := [*filter(isfinite, every)])}


def calibration(ratios: Sequence[float]) -> dict[str, Any]:
    """Summarize ratios. pictures: their number; within: fraction within RIGHT; median; worst: farthest from 1."""
    return {
        "pictures": len(ratios),
        "within": fmean(1 / RIGHT <= ratio <= RIGHT for ratio in ratios),
        "median": median(ratios),
        "worst": max(ratios, key=lambda ratio: abs(log(ratio)) if ratio > 0 else inf),
    }
