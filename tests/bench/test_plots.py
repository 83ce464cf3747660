"""Plots of studies have no clipped legends and no overlapping labels."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from clrt.bench.numerics import plots

pytest.importorskip("matplotlib")


@pytest.mark.parametrize("longest", [0.3, 1.0, 3.0, 300.0])
@pytest.mark.parametrize("scenes", [1, 2])
def test_convergence_is_legible(monkeypatch: pytest.MonkeyPatch, scenes: int, longest: float) -> None:
    """Tests the default contestants over less than a decade of time, and over four."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    drawn: list[Figure] = []
    monkeypatch.setattr(plots, "write_figure", lambda path, figure: drawn.append(figure))
    row = {
        "seconds": [0.06, longest],
        "spp": [1, round(longest / 0.06)],
        "relmse": [0.1, 0.006 / longest],
        "relmse_range": [(0.09, 0.11), (0.005 / longest, 0.007 / longest)],
    }
    names = ["clrt", "clrt, stratified", "clrt, independent", "clrt, lanes 1", "clrt, bvh2"]
    result: dict[str, Any] = {
        "scene": "cornell",
        "size": (256, 256),
        "contestants": dict.fromkeys(names, row),
        "reference": {"relmse": 3.5e-5},
    }
    plots.plot_convergence(Path("a.png"), [result] * scenes, ["device 0: pthread (Portable Computing Language)"])
    (figure,) = drawn
    FigureCanvasAgg(figure)
    figure.draw_without_rendering()
    legend = figure.legends[0].get_window_extent()
    assert legend.x0 >= 0 and legend.x1 <= figure.bbox.x1 and legend.y0 >= 0
    for axis in figure.axes:
        shown = [label.get_window_extent() for label in axis.get_xticklabels(which="both") if label.get_text()]
        spans = sorted((box.x0, box.x1) for box in shown if axis.bbox.x0 <= (box.x0 + box.x1) / 2 <= axis.bbox.x1)
        assert spans and all(left[1] <= right[0] for left, right in pairwise(spans))
