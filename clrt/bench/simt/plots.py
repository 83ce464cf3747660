"""Pictures of idle lanes, by matplotlib (an extra)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...output.error_plots import write_figure

#: Stages in the order of a path segment.
ORDER = ("extend", "shade", "connect")


def plot_idle(path: Path, scenes: Mapping[str, Mapping[str, NDArray[np.float64]]]) -> Path:
    """Draw the fraction of idle lanes in each tile, a row per scene and a column per stage; return the path.

    scenes: results of `idle_lanes` by name. Tiles that no warp gets to are gray.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(3.6 * len(ORDER) + 0.8, 2.9 * len(scenes)), layout="constrained")
    axes = figure.subplots(len(scenes), len(ORDER), squeeze=False)
    drawn: Any = None
    for (name, stages), row in zip(scenes.items(), axes):
        for stage, axis in zip(ORDER, row):
            idle = stages[stage]
            axis.set_facecolor("0.6")
            drawn = axis.imshow(idle, vmin=0, vmax=1, cmap="viridis", aspect=0.5, interpolation="nearest")
            known = idle[np.isfinite(idle)]
            axis.set(title=f"{name}, {stage}: {known.mean():.0%}" if known.size else f"{name}, {stage}: none")
            axis.set(xticks=[], yticks=[])
    figure.colorbar(drawn, ax=axes, label="fraction of idle lanes in a tile of 8x4 pixels", shrink=0.6)
    return write_figure(path, figure)
