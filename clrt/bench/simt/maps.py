"""Where warps idle: the fraction of lanes without work in the tiles of an image, by stage."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...rendering.film.tiles import TILE, TILE_PIXELS
from .costs import INSTRUCTIONS
from .variants import STAGES
from .visits import Ints, Visits, label
from .warps import TYPE_BITS, VISITED, in_paths

#: Lanes of a warp, whose pixels are a tile of 8 by 4.
WIDTH = 32


def idle_lanes(visits: Visits, layout: str, size: tuple[int, int]) -> dict[str, NDArray[np.float64]]:
    """Return by stage (rows, columns), the fraction of idle lanes in each 8x4 tile; NaN where no warp gets there.

    visits: of a path through each pixel, in whole tiles of the image of (width, height). Passes count by their
    instructions.
    """
    warps, idle = in_paths(visits, WIDTH), {}
    costs = np.array([INSTRUCTIONS[layout][kind] for kind in VISITED], np.float64)
    for stage, name in STAGES.items():
        seen = (visits.stage == stage)[visits.ray]
        ray = visits.ray[seen]
        passes = label(warps.of_ray[ray], visits.turn[seen], visits.place[seen], visits.kind[seen])
        idle[name] = _image(visits.path[ray] // WIDTH, passes, costs[visits.kind[seen]], visits.paths, size)
    types = label(warps.of_surface, visits.material & TYPE_BITS)
    idle["shade"] = _image(visits.shaded_path // WIDTH, types, np.ones(len(types)), visits.paths, size)
    return idle


def _image(
    warp: Ints, passes: Ints, cost: NDArray[np.float64], paths: int, size: tuple[int, int]
) -> NDArray[np.float64]:
    """Return the idle fraction by tile. warp, passes, cost: of each lane that works in a pass."""
    _, first = np.unique(passes, return_index=True)
    count = paths // WIDTH
    worked, issued = np.bincount(warp, cost, count), WIDTH * np.bincount(warp[first], cost[first], count)
    with np.errstate(invalid="ignore"):
        idle = np.where(issued > 0, 1 - worked / issued, np.nan)
    rows, columns = -(-size[1] // TILE), -(-size[0] // TILE)
    halves = idle.reshape(rows, columns, TILE_PIXELS // WIDTH)
    return halves.transpose(0, 2, 1).reshape(rows * halves.shape[2], columns)
