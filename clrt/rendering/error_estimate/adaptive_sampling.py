"""Adaptive sampling: selection of the tiles whose samples are doubled next.

It biases the image: tiles whose samples happen to be bright also show a higher variance, so they get more samples,
which corrects them; tiles that happen to be dark get none and stay dark. The bias decreases with the sample count. Half
of a tile's error estimate comes from its four neighbours, which are independent of that chance: this removes half of
the bias, and a twentieth of the gain (docs/performance.md).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..film.film import Film
from ..film.tiles import tile_pixels, tile_sums

#: Samples per pixel before the distribution becomes adaptive.
FLOOR_SPP = 16
#: Fraction of all samples so far that one round adds.
GROWTH = 0.5
#: Maximum factor by which a tile's samples may exceed the plan before the sampler starts afresh.
MOST_TIMES_PLANNED = 4


def most_planned(spp: int | None, adaptive: bool) -> int | None:
    """Return the maximum samples of any pixel, given the planned samples per pixel."""
    return None if spp is None else int(spp) * (MOST_TIMES_PLANNED if adaptive else 1)


def tiles_to_double(
    film: Film, tile_samples: NDArray[np.int64], errors: NDArray[np.float64], spp: int | None
) -> NDArray[np.intp]:
    """Return the tile numbers of the next round; none if `spp` samples per pixel are reached. tile_samples, errors:
    (rows, columns), samples per pixel of each tile and squared error summed over its values."""
    height, width = film.pixels.shape
    samples = tile_samples * tile_pixels((width, height))
    done = int(samples.sum())
    most = max(GROWTH * done, samples.max())  # at least the most expensive tile, else none might ever fit
    if spp is not None:
        most = min(most, spp * film.pixels.size - done)
    return worth_doubling(errors, tile_sums(film.pixels["rays"]), samples, most)


def worth_doubling(
    errors: NDArray[np.float64], rays: NDArray[np.float64], samples: NDArray[np.int64], most: float
) -> NDArray[np.intp]:
    """Return the tiles whose doubling reduces the error most per cost, with at most `most` samples in total.

    All arrays are (rows, columns) sums over a tile's values or pixels: squared error, which about halves with each
    doubling; rays so far, the cost of another as many samples; samples so far. Tiles that exceed the remaining budget
    are skipped.
    """
    worth = _with_neighbours(errors) / np.maximum(rays, 1)
    best, costs, chosen = np.argsort(-worth.ravel(), kind="stable"), samples.ravel(), []
    for tile, cost in zip(best.tolist(), costs[best].tolist()):
        if cost <= most:
            chosen.append(tile)
            most -= cost
    return np.array(chosen, np.intp)


def _with_neighbours(errors: NDArray[np.float64]) -> NDArray[np.float64]:
    around = np.pad(errors, 1, mode="edge")
    beside = around[:-2, 1:-1] + around[2:, 1:-1] + around[1:-1, :-2] + around[1:-1, 2:]
    return np.asarray((errors + beside / 4) / 2)
