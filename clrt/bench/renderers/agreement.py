"""Whether two renderers produce the same image: their means over many seeds are compared block by block.

Both render one image per seed. A block of 16 x 16 pixels has a mean in each image, and the spread of these means over
the seeds gives their error, whatever the correlation between pixels. Every block and channel is compared by Welch's
t-test, and the smallest p-value is corrected for the number of tests (Šidák).
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...device.discovery.discover import choose
from ...errors import UsageError
from ...scene.model import Scene
from ..convergence.bias import ROUNDING
from ..convergence.contestants import Contestant, choices_on
from ..significance import FAMILY, corrected, t_test

Doubles = NDArray[np.float64]

#: Side of a block in pixels.
BLOCK = 16
#: Relative tolerance of the means of whole images.
MEAN = 0.005


class Means(NamedTuple):
    """Means of a renderer's images: blocks (seeds, rows, columns, 3) and whole images (seeds, 3)."""

    blocks: Doubles
    whole: Doubles


def means_of(renderer: Contestant, spp: int, seeds: Sequence[int], block: int = BLOCK) -> Means:
    """Render an image with each of these seeds and return their means."""
    blocks, whole = [], []
    for seed in seeds:
        pixels = renderer(spp, seed).pixels.astype(np.float64)
        blocks.append(block_means(pixels, block))
        whole.append(pixels.mean((0, 1)))
    return Means(np.array(blocks), np.array(whole))


def block_means(pixels: Doubles, block: int) -> Doubles:
    """Reduce (h, w, 3) to (rows, columns, 3); pixels left over at the lower and right edges are ignored."""
    rows, columns = (size // block for size in pixels.shape[:2])
    whole = pixels[: rows * block, : columns * block]
    return np.asarray(whole.reshape(rows, block, columns, block, 3).mean((1, 3)))


def compared(ours: Means, theirs: Means) -> dict[str, Any]:
    """Compare our means with theirs.

    mean_ratio, mean_error: the ratio per channel, and its standard error. blocks: how many were compared, per channel;
    noise: the standard error of a block's relative difference, the median and the largest; difference: the largest
    relative difference; p: the smallest, corrected; rejected: the number of blocks and channels below FAMILY after
    correction. agree: the means are within MEAN and no block is rejected. Blocks that are black in both agree.
    """
    ratio, error = mean_ratio(ours.whole, theirs.whole)
    t, freedom, difference, noise = _welch(ours.blocks, theirs.blocks)
    p = np.array([corrected(t_test(*each), t.size) for each in zip(t.ravel().tolist(), freedom.ravel().tolist())])
    rejected = int(np.count_nonzero(p < FAMILY))
    return {
        "mean_ratio": ratio.tolist(),
        "mean_error": error.tolist(),
        "blocks": t.size // 3,
        "noise": [float(np.median(noise)), float(noise.max())],
        "difference": float(np.abs(difference).max()),
        "p": float(p.min()),
        "rejected": rejected,
        "agree": bool(np.all(np.abs(ratio - 1) < MEAN)) and not rejected and all(map(isfinite, ratio)),
    }


def mean_ratio(ours: Doubles, theirs: Doubles) -> tuple[Doubles, Doubles]:
    """Return the ratio of means over (seeds, channels), and its standard error; the ratio is 1 if both are black."""
    black = (ours.mean(0) == 0) & (theirs.mean(0) == 0)
    mean = np.where(black, 1, theirs.mean(0))
    ratio = np.where(black, 1, ours.mean(0) / mean)
    return ratio, np.sqrt(_squared_error(ours) + ratio**2 * _squared_error(theirs)) / mean


def _welch(ours: Doubles, theirs: Doubles) -> tuple[Doubles, Doubles, Doubles, Doubles]:
    """Return t, its degrees of freedom (Welch 1947), the relative difference and its standard error, of (seeds, …)."""
    level = (ours.mean(0) + theirs.mean(0)) / 2
    rounding = (ROUNDING * level) ** 2
    own, other = _squared_error(ours) + rounding, _squared_error(theirs) + rounding
    difference, error = ours.mean(0) - theirs.mean(0), np.sqrt(own + other)
    lit = error > 0
    error, level = np.where(lit, error, 1), np.where(lit, level, 1)
    freedom = (own + other) ** 2 / np.where(lit, own**2 / (len(ours) - 1) + other**2 / (len(theirs) - 1), 1)
    return difference / error, np.maximum(freedom, 1), difference / level, np.where(lit, error, 0) / level


def _squared_error(rows: Doubles) -> Doubles:
    """Return the squared standard error of the mean over seeds."""
    return np.asarray(rows.var(0) / (len(rows) - 1))


def agreement(scene: Scene, spp: int, seeds: int, device: str | int | None = None) -> dict[str, Any]:
    """Return `compared` for clrt's and Mitsuba's images of `scene`, with the scene's name and size.

    Raises UsageError if Mitsuba is not installed or cannot render the scene, or if an image is smaller than a block.
    """
    if min(scene.render.size) < BLOCK:
        width, height = scene.render.size
        raise UsageError(f"images of {width}x{height} pixels have no block of {BLOCK}x{BLOCK}; use a larger --size")
    try:
        from .mitsuba_renderer import contestants

        # The first, with independent samples: images of multijitter share permutations between seeds, so that the
        # spread over seeds underestimates their error (docs/measurements/mitsuba.md).
        theirs = next(iter(contestants(scene).values()))
    except ImportError:
        raise UsageError("Mitsuba is not installed (pip install mitsuba)") from None
    ours = choices_on(scene, [choose(device)[0].index], {"clrt": {}})["clrt"]
    means = [means_of(each, spp, range(seeds)) for each in (ours, theirs)]
    return {"scene": scene.name, "size": scene.render.size, "spp": spp, "seeds": seeds} | compared(*means)
