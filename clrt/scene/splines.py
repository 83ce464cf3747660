"""Smooth curves through values at given times."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Doubles = NDArray[np.float64]


def smooth(times: ArrayLike, values: ArrayLike, at: ArrayLike) -> Doubles:
    """Evaluate at the times (m,) a curve through `values` (k, n) at ascending `times` (k,), k >= 1; returns (m, n).

    Piecewise cubic Hermite. The slope at a value is that of the parabola through it and its neighbours, at an end that
    of the first or last parabola, so that motion along a parabola is reproduced exactly (Overhauser 1968; for evenly
    spaced times this is the Catmull–Rom spline). The curve is constant between equal values, before the first time and
    after the last. A scalar (n = 1) never leaves the range of its two neighbours (Fritsch and Carlson 1980).
    """
    knots, points, moments = (np.asarray(each, np.float64) for each in (times, values, at))
    if len(knots) == 1:
        return np.repeat(points, len(moments), axis=0)
    moments = np.clip(moments, knots[0], knots[-1])
    piece = np.clip(np.searchsorted(knots, moments, side="right") - 1, 0, len(knots) - 2)
    lengths = np.diff(knots)[:, None]
    slopes = _slopes(lengths, np.diff(points, axis=0) / lengths)
    length = lengths[piece]
    t = (moments - knots[piece])[:, None] / length
    rest = 1 - t
    return np.asarray(
        rest**2 * ((1 + 2 * t) * points[piece] + t * length * slopes[piece])
        + t**2 * ((1 + 2 * rest) * points[piece + 1] - rest * length * slopes[piece + 1])
    )


def _slopes(lengths: Doubles, secants: Doubles) -> Doubles:
    """Compute the slopes (k, n) at the values from the lengths (k − 1, 1) and secants (k − 1, n) of the pieces."""
    if len(secants) == 1:
        return np.repeat(secants, 2, axis=0)
    before, after = lengths[:-1], lengths[1:]
    inner = (after * secants[:-1] + before * secants[1:]) / (before + after)
    slopes = np.concatenate([2 * secants[:1] - inner[:1], inner, 2 * secants[-1:] - inner[-1:]])
    # Secants of the pieces left and right of each value; the first and last value have one piece, used for both.
    left, right = np.concatenate([secants[:1], secants]), np.concatenate([secants, secants[-1:]])
    slopes[~left.any(axis=1) | ~right.any(axis=1)] = 0
    if slopes.shape[1] == 1:
        steepest = 3 * np.minimum(np.abs(left), np.abs(right))
        slopes = np.where(left * right > 0, np.clip(slopes, -steepest, steepest), 0)
        slopes = np.where(slopes * left < 0, 0, slopes)
    return np.asarray(slopes)
