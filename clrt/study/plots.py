"""Intersection tests drawn by matplotlib, which is an extra."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..output.plots import write_figure
from .families import FIGURES

#: Zero errors are drawn here, below all that was counted.
ZERO = 1e-3


def plot_families(path: Path, results: Sequence[Mapping[str, Any]]) -> Path:
    """Error against speed of every test in `results` ({device, families}), a row a device, a column a figure that the
    family is judged by. Returns the path."""
    from matplotlib.figure import Figure

    judged = [(family, next(iter(figures.items()))) for family, figures in FIGURES.items()]
    figure = Figure(figsize=(4 * len(judged), 3.4 * len(results)), layout="constrained")
    axes = figure.subplots(len(results), len(judged), squeeze=False)
    for result, row in zip(results, axes):
        for (family, (key, title)), axis in zip(judged, row):
            for name, test in result["families"][family].items():
                point = 1 / test["ratio"], max(test[key], ZERO)
                axis.scatter(*point)
                axis.annotate(name, point, xytext=(4, 4), textcoords="offset points")
            axis.margins(0.25)
            axis.set(yscale="log", xlabel="times as fast as the default", ylabel=title, title=family)
        device = f"{result['device']['name']} ({result['device']['platform']})"
        row[0].annotate(device, (0, 1.12), xycoords="axes fraction")
    return write_figure(path, figure)
