"""The quadtrees over directions of a guiding field, one per leaf of its spatial tree (kernels/guiding/field.cl)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..compile.records import QUARTER

#: Bits of each coordinate of a direction by which quarters are divided.
DEPTH = 9
#: A quarter is divided if it has more than this share of its tree's light, and enough samples.
DIVIDED, FEWEST = 0.01, 16
#: Minimum share of a quarter: none may have the probability 0, which rounding could choose all the same.
LEAST_SHARE = 1 / 1024
#: The density of the whole sphere, per solid angle.
UNIFORM = 0.25 / np.pi


@dataclass(frozen=True)
class Quadtrees:
    """quarters: QUARTER records; the tree of number k starts with quarter 4k."""

    quarters: NDArray[Any]

    def density(self, trees: NDArray[np.int32], codes: NDArray[np.uint32]) -> NDArray[np.float64]:
        """Return the density of directions, per solid angle. trees: (n,) numbers; codes: (n,) Morton codes."""
        result = np.full(len(trees), UNIFORM)
        first, inside = 4 * trees.astype(np.int64), np.arange(len(trees))
        for level in range(DEPTH):
            quarter = first + (codes[inside] >> np.uint32(2 * (DEPTH - 1 - level)) & np.uint32(3))
            result[inside] *= 4.0 * self.quarters["share"][quarter]
            first = self.quarters["quarters"][quarter].astype(np.int64)
            inside, first = inside[first >= 0], first[first >= 0]
        return result


def morton_codes(directions: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Return the Morton codes of points in 16-bit fixed point, x in the low half, of DEPTH bits of each coordinate."""
    low, high = directions & np.uint32(0xFFFF), directions >> np.uint32(16)
    return _spread(low >> np.uint32(16 - DEPTH)) | _spread(high >> np.uint32(16 - DEPTH)) << np.uint32(1)


def _spread(values: NDArray[np.uint32]) -> NDArray[np.uint32]:
    for shift, mask in ((8, 0x00FF00FF), (4, 0x0F0F0F0F), (2, 0x33333333), (1, 0x55555555)):
        values = (values | values << np.uint32(shift)) & np.uint32(mask)
    return values


class _Level(NamedTuple):
    """Quarters of one size, (n, 4). mass: what shares are in proportion to; divided: whether they are divided."""

    mass: NDArray[np.float64]
    divided: NDArray[np.bool_]


def quadtrees(
    trees: NDArray[np.int32],
    codes: NDArray[np.uint32],
    light: NDArray[np.float64],
    squares: NDArray[np.float64],
    count: int,
) -> Quadtrees:
    """Return `count` trees of samples. trees: (n,) the number of each one's tree; codes: (n,) its Morton code.

    light, squares: (n,), the estimates of the light's integral and of that of its square, light / pdf and light² / pdf.
    Quarters are divided by light, and their shares are in proportion to the root of the square's integral times the
    solid angle, which counts the variance of the light's own estimates in (Rath et al. 2020).
    """
    keys = trees.astype(np.uint64) << np.uint64(2 * DEPTH) | codes
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    sums = np.concatenate([np.zeros((1, 2)), np.cumsum(np.stack([light[order], squares[order]], axis=1), axis=0)])
    corners = np.arange(count, dtype=np.uint64) << np.uint64(2 * DEPTH)
    ends = np.searchsorted(keys, np.append(corners, np.uint64(count << 2 * DEPTH)))
    whole = np.diff(sums[ends, 0])
    levels: list[_Level] = []
    while len(corners):
        width = np.uint64(1 << 2 * (DEPTH - 1 - len(levels)))
        cuts = np.searchsorted(keys, corners[:, None] + width * np.arange(5, dtype=np.uint64))
        found = np.diff(sums[cuts], axis=1)
        area = 0.25 ** (len(levels) + 1)
        divided = (found[..., 0] > DIVIDED * whole[:, None]) & (np.diff(cuts, axis=1) >= FEWEST) & (width > 1)
        levels.append(_Level(np.sqrt(np.maximum(found[..., 1], 0) * area), divided))
        row, column = np.nonzero(divided)
        corners, whole = corners[row] + width * column.astype(np.uint64), whole[row]
    return Quadtrees(_quarters(levels))


def _quarters(levels: list[_Level]) -> NDArray[Any]:
    """Return the QUARTER records of all levels, the largest first."""
    parts, end = [], sum(level.mass.size for level in levels)
    below: NDArray[np.float64] | None = None
    for level in reversed(levels):
        if below is not None:
            level.mass[level.divided] = below
        below = level.mass.sum(axis=1)
        part = np.zeros(level.mass.shape, QUARTER)
        share = np.divide(level.mass, below[:, None], out=np.full_like(level.mass, 0.25), where=below[:, None] > 0)
        share = np.maximum(share, LEAST_SHARE)
        part["share"] = share / share.sum(axis=1, keepdims=True)
        part["quarters"] = -1
        part["quarters"][level.divided] = end + 4 * np.arange(np.count_nonzero(level.divided))
        end -= level.mass.size
        parts.append(part.ravel())
    return np.concatenate(parts[::-1])
