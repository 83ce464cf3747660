"""Piecewise-constant distribution tables: probabilities, and start indices of searches."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.rendering.compile.lights.piecewise_constant import LEVELS, steps
from clrt.rendering.compile.records import SKY_STEP

RNG = np.random.default_rng(0)
WEIGHTS = {
    "one": np.array([3.0]),
    "two": np.array([1.0, 3.0]),
    "equal": np.ones(1000),
    "thirds": np.ones(3),
    "random": RNG.random(777),
    "zeros": RNG.random(1000) * (RNG.random(1000) < 0.3),
    "ends in zeros": np.array([0.0, 0.0, 1.0, 2.0, 0.0, 0.0]),
    "peak": np.where(np.arange(2000) == 777, 1e6, 1.0),
    "tiny": np.where(np.arange(5) == 2, 1e-12, 1.0),
    "rows": RNG.random((5, 300)) ** 8,
    "bands": RNG.random((90, 1024)),
}


def table_of(weights: NDArray[np.float64]) -> tuple[NDArray[np.void], NDArray[np.float64]]:
    """Return the table for rows of weights, or for a single one, and the probabilities."""
    rows = np.atleast_2d(weights)
    table = np.empty(rows.shape, SKY_STEP)
    probabilities = steps(rows, table)
    return table, probabilities


@pytest.mark.parametrize("weights", WEIGHTS.values(), ids=WEIGHTS)
def test_probabilities(weights: NDArray[np.float64]) -> None:
    """Multiples of 1/LEVELS within 1/LEVELS of the exact share that sum to 1; zero weights have probability zero."""
    table, probability = table_of(weights)
    weights = np.atleast_2d(weights)
    assert np.all(probability * LEVELS % 1 == 0) and np.all(probability >= 0) and np.all(probability[weights == 0] == 0)
    assert np.all(probability.sum(axis=-1) == 1) and np.all(table["top"][..., -1] == 1)
    assert np.abs(probability - weights / weights.sum(axis=-1, keepdims=True)).max() <= 1 / LEVELS
    np.testing.assert_array_equal(np.cumsum(probability, axis=-1), table["top"])


@pytest.mark.parametrize("weights", WEIGHTS.values(), ids=WEIGHTS)
def test_searches_start_in_time(weights: NDArray[np.float64]) -> None:
    """At or before the step that contains u, with u·n a float32 product, and on average hardly before it."""
    table, _ = table_of(weights)
    n = table.shape[1]
    edges = np.round(np.arange(n) / n * LEVELS)[:, None] + np.arange(-2, 3)  # where that product may be rounded up
    levels = np.concatenate([edges.ravel(), RNG.integers(0, LEVELS, 1 << 16), [0, LEVELS - 1]])
    u = (levels[(levels >= 0) & (levels < LEVELS)] / LEVELS).astype(np.float32)
    cell = (u * np.float32(n)).astype(int)
    assert cell.max() < n
    for row in table:
        step = np.searchsorted(row["top"], u, side="right")
        assert np.all(row["start"][cell] <= step)
        assert np.mean(step - row["start"][cell]) < 1.5
