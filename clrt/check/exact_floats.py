"""Exact reference results: sums and products of floats as fractions, and the nearest float32 of a fraction."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float32]


def nearest_float32(exact: Fraction) -> np.float32:
    """Return the float32 nearest to a number in the normal range, on ties the even one (IEEE 754-2019, 4.3.1)."""
    near = np.float32(float(exact))  # rounded twice, so it may be a neighbour of the nearest
    candidates = np.nextafter(near, np.float32(-np.inf)), near, np.nextafter(near, np.float32(np.inf))
    return min(candidates, key=lambda f: (abs(Fraction(float(f)) - exact), int(f.view(np.uint32)) & 1))


def fused(a: Floats, b: Floats, c: Floats) -> Floats:
    """Return a·b + c, (n,) each, rounded once."""
    triples = zip(a.tolist(), b.tolist(), c.tolist())
    return np.array([nearest_float32(Fraction(x) * Fraction(y) + Fraction(z)) for x, y, z in triples], np.float32)


def ulps(got: Floats, exact: ArrayLike) -> NDArray[np.float64]:
    """Return the error of `got` against `exact`, float64, in units in the last place."""
    truth = np.asarray(exact, np.float64)
    return np.asarray(np.abs(got.astype(np.float64) - truth) / np.spacing(np.abs(truth).astype(np.float32)), np.float64)
