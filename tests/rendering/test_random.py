"""Random numbers of the kernels: uniform and unrelated over pixels, samples, dimensions and seeds."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from clrt.device.open import Device
from clrt.scene.model import Scene

from ..probe import Probe
from ..stats import chi2_test, mean_test, sidak

Doubles = NDArray[np.float64]
FAMILY, COUNT = 1e-3, 1 << 16
Draw = Callable[[ArrayLike, ArrayLike, ArrayLike, ArrayLike], Doubles]

#: First indices: small ones, where float32 can no longer count (2^24), and the last that 32 bits hold.
STARTS = (0, (1 << 24) - 5, (1 << 32) - 2 * COUNT)


@pytest.fixture(scope="module")
def draw(device: Device) -> Draw:
    """(n, 2): next_2d for pixels, samples, dimensions and seeds that broadcast; one launch per dimension and seed."""
    probe = Probe(device, Scene())

    def call(pixel: ArrayLike, sample: ArrayLike, dimension: ArrayLike, seed: ArrayLike) -> Doubles:
        grid = [np.asarray(a, np.int64) for a in np.broadcast_arrays(pixel, sample, dimension, seed)]
        out = np.empty((len(grid[0]), 2))
        scalars, group = np.unique(np.column_stack(grid[2:]), axis=0, return_inverse=True)
        for i, (d, s) in enumerate(scalars.tolist()):
            rows = group.ravel() == i
            p, q = grid[0][rows], grid[1][rows]
            out[rows] = probe("random", 2, p >> 16, p & 0xffff, q >> 16, q & 0xffff, seed=s, dimension=d)
        return out

    return call


def independence(a: Doubles, b: Doubles) -> float:
    """p-value of pairs (a, b) being uniform over the unit square."""
    cells = (16 * a).astype(int) * 16 + (16 * b).astype(int)
    return chi2_test(np.bincount(cells, minlength=256), np.full(256, len(a) / 256))


def walks(start: int) -> dict[str, tuple[ArrayLike, ...]]:
    """(pixel, sample, dimension, seed) along which numbers are drawn."""
    i, few = np.arange(COUNT), np.arange(COUNT) % 64
    many = i // 64
    return {"pixels": (start + i, 3, 2, 1), "samples": (7, start + i, 2, 1),
            "pixels and samples": (start + many, few, 0, 0), "dimensions": (start + many, 5, few, 1),
            "seeds": (start + many, 5, 1, 1000 * few), "large seeds": (start + many, 5, 1, (1 << 32) - 1 - few)}


def test_numbers_are_uniform(draw: Draw) -> None:
    """Each pair fills the unit square evenly, along every index."""
    p_values = {(start, name): independence(*draw(*walk).T) for start in STARTS for name, walk in walks(start).items()}
    assert min(p_values.values()) > sidak(FAMILY, len(p_values)), p_values


@pytest.mark.parametrize("step", [(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1), (64, 0, 0, 0),
                                  (1920, 0, 0, 0), (1, 1, 0, 0), (1, -1, 0, 0)], ids=str)
def test_neighbours_are_unrelated(draw: Draw, step: tuple[int, int, int, int]) -> None:
    """Pairs of numbers one step apart in (pixel, sample, dimension, seed) are independent and uncorrelated."""
    p_values = {}
    for start in STARTS:
        i = np.arange(COUNT)
        pixel, sample, dimension, seed = start + i % 8192, 1 + i // 8192, 4, 9
        a = draw(pixel, sample, dimension, seed)
        b = draw(pixel + step[0], sample + step[1], dimension + step[2], seed + step[3])
        for x, y in product((0, 1), repeat=2):
            products = 12 * (a[:, x] - 0.5) * (b[:, y] - 0.5)
            p_values[start, x, y, "chi²"] = independence(a[:, x], b[:, y])
            p_values[start, x, y, "correlation"] = float(mean_test(products.mean(), 1.0, COUNT, 0.0))
    assert min(p_values.values()) > sidak(FAMILY, len(p_values)), p_values


def test_numbers_lie_below_one_and_repeat(draw: Draw) -> None:
    """Multiples of 2^-24 in [0, 1), the same for the same indices."""
    walk = walks(0)["pixels"]
    u = draw(*walk)
    assert u.min() >= 0 and u.max() < 1
    assert np.all(u * (1 << 24) % 1 == 0)
    assert np.array_equal(u, draw(*walk))


def test_the_two_numbers_of_a_pair_are_unrelated_to_the_next_pair(draw: Draw) -> None:
    """All four bits patterns of two dimensions: 8⁴ cells."""
    first, second = draw(np.arange(1 << 18), 0, 0, 0), draw(np.arange(1 << 18), 0, 1, 0)
    cells = (8 * np.hstack([first, second])).astype(int) @ [512, 64, 8, 1]
    assert chi2_test(np.bincount(cells, minlength=4096), np.full(4096, 64.0)) > FAMILY
