"""Estimates of the light at recorded vertices, with less noise than their own paths give.

A path seldom finds the light that reaches its first vertices, so the mean light that surfaces reflect is kept for cells
of space, and each path ends in a cell: light at a vertex is what the next one emits or reflects from lights, and what
its cell reflects otherwise, as in reinforcement learning (Dahm and Keller 2017). Cells are iterated until light has
crossed them a dozen times.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Rounds of iteration.
ROUNDS = 12


def light_at(
    vertices: NDArray[Any], cells: NDArray[np.int32], count: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return for each vertex the luminance that arrives along its direction, and for each cell the mean luminance that
    it reflects without that of light sampling.

    vertices: VERTEX records; cells: (n,) the number of each one's cell, of `count`.
    """
    following = np.where(vertices["goes"] & ~vertices["ends"], np.roll(cells, -1), count)  # past the cells: nothing
    known = vertices["goes"] | (vertices["weight"] == 0)  # unlike paths that roulette ended
    own, after = cells[known], following[known]
    weight, direct = vertices["weight"][known].astype(np.float64), vertices["direct"][known]
    number = np.maximum(np.bincount(own, minlength=count), 1)
    reflected = np.zeros(count + 1)
    for _ in range(ROUNDS):
        reflected[:count] = np.bincount(own, weight * (direct + reflected[after]), count) / number
    return vertices["direct"] + reflected[following], reflected[:count]
