"""Outcomes of light samples."""

from __future__ import annotations

from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: A light sample that loses less than this fraction is not shadowed: the rest is rounding.
ROUNDING = 1e-5


class Outcome(StrEnum):
    """Outcome of a light sample, in words."""

    LIT = "not shadowed"
    PARTLY = "partly shadowed"
    SHADOWED = "shadowed"
    ABSORBED = "absorbed on the way"
    NO_EMISSION = "in a direction without emission"
    BEHIND = "behind the surface"
    NO_BSDF = "on a material that scatters nothing there"
    UNSAMPLED = "with a pdf of 0"


def outcomes(rows: NDArray[Any]) -> list[Outcome]:
    """Return the outcome of the light sample of each VERTEX record (n,); for UNSAMPLED ones nothing else is known."""
    dark, no_bsdf = (~_any(rows[name]) for name in ("light_radiance", "light_bsdf"))
    above = np.all(
        [
            np.sum(rows["light_direction"] * rows[normal], axis=1) > 0
            for normal in ("geometric_normal", "shading_normal")
        ],
        axis=0,
    )
    sent, arrives, total = rows["sent"] != 0, rows["direct"].sum(axis=1), rows["unshadowed"].sum(axis=1)
    cases = [
        (~sent & dark, Outcome.NO_EMISSION),
        (~sent & (rows["light_pdf"] <= 0), Outcome.UNSAMPLED),
        (~sent & no_bsdf & above, Outcome.NO_BSDF),
        (~sent, Outcome.BEHIND),
        (total <= 0, Outcome.ABSORBED),
        (arrives <= 0, Outcome.SHADOWED),
        (arrives < (1 - ROUNDING) * total, Outcome.PARTLY),
    ]
    numbers = np.select([condition for condition, _ in cases], list(range(len(cases))), len(cases))
    return [[*(outcome for _, outcome in cases), Outcome.LIT][number] for number in numbers]


def _any(values: NDArray[np.float32]) -> NDArray[np.bool_]:
    return np.asarray(np.any(values > 0, axis=1))
