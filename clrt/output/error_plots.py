"""Plots of error against time, drawn by matplotlib, an optional dependency."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from importlib.util import find_spec
from itertools import cycle
from math import sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import OutputError, UsageError
from .atomic_files import check_target, replacing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

#: Points of seconds, and the error (√relMSE) after them.
Curve = Sequence[tuple[float, float]]

EXTENSIONS = (".png", ".svg", ".pdf")
MARKERS = "osD^vP*X"
#: Size of a panel in inches.
PANEL = (5.0, 3.8)
DOTS_PER_INCH = 150


def check_plot(path: Path) -> None:
    """Raise OutputError unless a plot can be written at `path`, UsageError if matplotlib is not installed."""
    check_target(path)
    if path.suffix.lower() not in EXTENSIONS:
        raise OutputError(
            f"{path}: plots are written as {', '.join(EXTENSIONS[:-1])} or {EXTENSIONS[-1]}; choose such a file"
        )
    if find_spec("matplotlib") is None:
        raise UsageError("plots need matplotlib: install it with `pip install matplotlib`")


def plot_history(path: Path, title: str, history: Iterable[Mapping[str, Any]]) -> Path:
    """Plot a render's `history` with `plot_errors`: its own error estimate and, if recorded, the true errors."""
    entries = list(history)
    estimate = [(entry["seconds"], entry["noise"]) for entry in entries if entry["noise"] is not None]
    true = [(entry["seconds"], sqrt(entry["relmse"])) for entry in entries if "relmse" in entry]
    return plot_errors(path, {title: {"estimated by the renderer": estimate, "against the reference": true}})


def plot_errors(path: Path, panels: Mapping[str, Mapping[str, Curve]]) -> Path:
    """Plot error against time on logarithmic axes: panels by title, in each the curves by name. Returns `path`.

    A dotted line shows the slope of independent samples, an error that falls with the square root of time. Points that
    are not positive are omitted, and curves without points. Raises OutputError.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(PANEL[0] * len(panels), PANEL[1]), layout="constrained")
    for axis, (title, curves) in zip(figure.subplots(1, len(panels), squeeze=False)[0], panels.items()):
        _draw(axis, curves)
        axis.set(xscale="log", yscale="log", xlabel="seconds", ylabel="error (√relMSE)", title=title)
        axis.grid(linewidth=0.4, alpha=0.4)
        for ticks in (axis.xaxis, axis.yaxis):
            label_short_range(ticks)
    return write_figure(path, figure)


def label_short_range(ticks: Axis) -> None:
    """Of a logarithmic axis over few decades, where matplotlib labels the steps between as 2×10⁰, 3×10⁰, 4×10⁰ …"""
    from matplotlib.ticker import LogLocator, NullFormatter

    ticks.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ticks.set_major_formatter("{x:g}")
    ticks.set_minor_formatter(NullFormatter())


def write_figure(path: Path, figure: Figure) -> Path:
    """Write a figure atomically (see `replacing`) in the extension's format. Returns the path; raises OutputError."""
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=DOTS_PER_INCH)
    return path


def _draw(axis: Axes, curves: Mapping[str, Curve]) -> None:
    drawn = {
        name: points
        for name, curve in curves.items()
        if (points := [(seconds, error) for seconds, error in curve if seconds > 0 and error > 0])
    }
    for (name, points), marker in zip(drawn.items(), cycle(MARKERS)):
        axis.plot(*zip(*points), label=name, marker=marker, markersize=4, linewidth=1.4)
    if drawn:
        start, error = next(iter(drawn.values()))[0]
        end = max(points[-1][0] for points in drawn.values())
        axis.plot(
            [start, end], [error, error * sqrt(start / end)], ":", color="grey", linewidth=1, label="slope −½", zorder=0
        )
        axis.legend(frameon=False, fontsize="small")
