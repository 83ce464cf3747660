"""Whether the kernels' random numbers are uniform, and independent over pixels, samples, dimensions and seeds."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from ..kernel_probe import Doubles, Probe
from ..significance import chi2_test, mean_test

#: Returns (n, 2) random numbers for pixels, samples, dimensions and seeds.
Draw = Callable[[ArrayLike, ArrayLike, ArrayLike, ArrayLike], Doubles]

#: Middles of the ranges of indices: an ordinary one, where float32 can no longer count, the end of an 8192² image, and
#: where 31 and 32 bits overflow; there the indices wrap around to 0.
MIDDLES = (1 << 23, 1 << 24, 1 << 26, 1 << 31, 1 << 32)
#: Offsets (pixel, sample, dimension, seed) of compared numbers: neighbors, diagonals, image rows, powers of two.
STEPS = (
    (1, 0, 0, 0),
    (0, 1, 0, 0),
    (0, 0, 1, 0),
    (0, 0, 0, 1),
    (2, 0, 0, 0),
    (64, 0, 0, 0),
    (1920, 0, 0, 0),
    (8192, 0, 0, 0),
    (1 << 16, 0, 0, 0),
    (1 << 30, 0, 0, 0),
    (0, 64, 0, 0),
    (0, 1 << 30, 0, 0),
    (0, 0, 2, 0),
    (0, 0, 0, 1 << 30),
    (1, 1, 0, 0),
    (1, -1, 0, 0),
    (1, 0, -1, 0),
    (0, 1, -1, 0),
    (1, 0, 0, -1),
    (0, 1, 0, -1),
)
#: Cells per side of a square, and of a hypercube.
SIDE, EDGE = 16, 6
#: Number of samples, dimensions and seeds that are tested per pixel.
FEW = 64


def draw_on(probe: Probe) -> Draw:
    """Return next_2d for indices that broadcast, taken modulo 2^32; one launch per dimension and seed."""

    def draw(pixel: ArrayLike, sample: ArrayLike, dimension: ArrayLike, seed: ArrayLike) -> Doubles:
        grid = [np.asarray(a, np.int64) % (1 << 32) for a in np.broadcast_arrays(pixel, sample, dimension, seed)]
        out = np.empty((len(grid[0]), 2))
        scalars, group = np.unique(np.column_stack(grid[2:]), axis=0, return_inverse=True)
        for i, (d, s) in enumerate(scalars.tolist()):
            rows = group.ravel() == i
            p, q = grid[0][rows], grid[1][rows]
            out[rows] = probe("random", 2, p >> 16, p & 0xFFFF, q >> 16, q & 0xFFFF, seed=s, dimension=d, block_bits=32)
        return out

    return draw


def uniformity(draw: Draw, count: int) -> dict[str, float]:
    """Return p-values of pairs filling the square evenly along every index; of each bit being 1 half of the time; and
    of two consecutive pairs, along pixels and dimensions, filling the hypercube."""
    p_values = {}
    for middle in MIDDLES:
        for name, walk in _walks(middle - count // 2, count).items():
            u = draw(*walk)
            p_values[f"{name} around {middle}"] = _square_test(*u.T)
            ones = np.mean((u * (1 << 24)).astype(np.int64)[:, :, None] >> np.arange(24) & 1, axis=0).ravel()
            p_values |= {
                f"bit {bit}, {name} around {middle}": float(p)
                for bit, p in enumerate(mean_test(ones, 0.25, count, 0.5))
            }
        i = middle - count // 2 + np.arange(count)
        first = draw(i, 0, 0, 0)
        p_values[f"four numbers of a pixel, {middle}"] = _cube_test(first, draw(i, 0, 1, 0))
        p_values[f"four numbers of two pixels, {middle}"] = _cube_test(first[0::2], first[1::2])
    return p_values


def independence(draw: Draw, count: int) -> dict[str, float]:
    """Return p-values of numbers that are one of STEPS apart being independent (chi-square) and uncorrelated."""
    p_values = {}
    for middle in MIDDLES:
        i = np.arange(count)
        start = np.array([middle - 4096, 1, 4, 9])[:, None] + [i % 8192, i // 8192, 0 * i, 0 * i]
        a = draw(*start)
        for step in STEPS:
            b = draw(*(start + np.array(step)[:, None]))
            for x, y in product((0, 1), repeat=2):
                name = f"{'xy'[x]} and {'xy'[y]} {step} apart around {middle}"
                products = 12 * (a[:, x] - 0.5) * (b[:, y] - 0.5)
                p_values[f"chi²: {name}"] = _square_test(a[:, x], b[:, y])
                p_values[f"correlation: {name}"] = float(mean_test(products.mean(), 1.0, count, 0.0))
    return p_values


def repetitions(draw: Draw, side: int) -> int:
    """Count equal pairs among those of side² pixels and samples, and of as many with the two exchanged or a seed away.

    The expected number is below one: pairs have 48 bits.
    """
    pixel, sample = (grid.ravel() for grid in np.meshgrid(np.arange(side), np.arange(side) + 1_000_000))
    u = np.concatenate(
        [draw(pixel, sample, 0, 0), draw(sample, pixel, 0, 0), draw(pixel, sample, 0, 1), draw(pixel, sample, 1, 0)]
    )
    pairs = (u * (1 << 24)).astype(np.int64) @ [1 << 24, 1]
    return len(pairs) - len(np.unique(pairs))


def _walks(start: int, count: int) -> dict[str, tuple[ArrayLike, ...]]:
    """Return (pixel, sample, dimension, seed) along which numbers are drawn, by name."""
    i = start + np.arange(count)
    few, many = np.arange(count) % FEW, start + np.arange(count) // FEW
    return {
        "pixels": (i, 3, 2, 1),
        "samples": (7, i, 2, 1),
        "pixels and samples": (many, few, 0, 0),
        "dimensions": (many, 5, few, 1),
        "seeds": (many, 5, 1, 1000 * few),
        "large seeds": (many, 5, 1, -1 - few),
    }


def _square_test(x: Doubles, y: Doubles) -> float:
    cells = (SIDE * x).astype(int) * SIDE + (SIDE * y).astype(int)
    return chi2_test(np.bincount(cells, minlength=SIDE**2), np.full(SIDE**2, len(x) / SIDE**2))


def _cube_test(a: Doubles, b: Doubles) -> float:
    cells = (EDGE * np.hstack([a, b])).astype(int) @ EDGE ** np.arange(4)
    return chi2_test(np.bincount(cells, minlength=EDGE**4), np.full(EDGE**4, len(a) / EDGE**4))
