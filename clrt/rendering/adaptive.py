"""Adaptive sampling: which tiles' samples to double next.

It biases a picture: where the samples so far happen to be bright they differ more, too, so more are taken and make up
for it; where they happen to be dark none are, and nothing does. The less, the more samples there are. Half of what is
said of a tile's error is its four neighbours', who know nothing of that chance: it takes half of the bias away, and a
twentieth of the gain (docs/performance.md).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .film import Film
from .tiles import tile_pixels, tile_sums

#: Samples that all pixels get before any tile gets more than others.
FLOOR_SPP = 16
#: By what part of all samples so far a round adds to them.
GROWTH = 0.5
#: By how much some tiles' samples may exceed what is planned before they begin anew.
MOST_TIMES_PLANNED = 4


def most_planned(spp: int | None, adaptive: bool) -> int | None:
    """The samples that any pixel may get, where so many are planned for each."""
    return None if spp is None else int(spp) * (MOST_TIMES_PLANNED if adaptive else 1)


def tiles_to_double(film: Film, tile_samples: NDArray[np.int64], errors: NDArray[np.float64],
                    spp: int | None) -> NDArray[np.intp]:
    """The tiles of a round, by number; none where `spp` samples a pixel are reached. tile_samples, errors: (rows,
    columns), of each tile's pixels and of all its values."""
    height, width = film.pixels.shape
    samples = tile_samples * tile_pixels((width, height))
    done = int(samples.sum())
    most = max(GROWTH * done, samples.max())    # of few tiles at least the dearest, else none may ever fit
    if spp is not None:
        most = min(most, spp * film.pixels.size - done)
    return worth_doubling(errors, tile_sums(film.pixels["rays"]), samples, most)


def worth_doubling(errors: NDArray[np.float64], rays: NDArray[np.float64], samples: NDArray[np.int64],
                   most: float) -> NDArray[np.intp]:
    """The tiles whose doubling takes most error away for what it costs, by number, of `most` samples together at most.

    All arrays (rows, columns), sums over a tile's values or pixels: squared error, which falls by half or so with each
    doubling; rays so far, which is what as many samples cost again; samples so far. What does not fit is passed over.
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
