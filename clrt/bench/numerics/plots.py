"""Plots of experiments, by matplotlib (an extra)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...output.error_plots import MARKERS, label_short_range, write_figure
from .families import FIGURES

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Zero errors are drawn here, below all nonzero ones.
ZERO = 1e-3
#: An axis that is short and spans more than this factor has room for the labels of whole decades alone.
SHORT = 30
#: Okabe and Ito's palette, which is distinguishable with most kinds of color blindness.
COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#f0e442")


def plot_families(path: Path, results: Sequence[Mapping[str, Any]]) -> Path:
    """Plot error against speed of every test in `results` ({device, families}) and return the path.

    There is a row per device, and a column per family with its primary criterion."""
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


def plot_convergence(path: Path, results: Sequence[Mapping[str, Any]], devices: Sequence[str]) -> Path:
    """Plot the results of `measure_convergence`, a column per scene, and return the path.

    √relMSE against seconds and against samples per pixel: the mean over seeds, with a band from minimum to maximum.
    Dotted lines have the slope of independent samples; the grey line is the reference's own error. devices: text in the
    legend.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(3.8 * len(results), 6.4), layout="constrained")
    axes = figure.subplots(2, len(results), squeeze=False, sharey="col")
    names = list(dict.fromkeys(name for result in results for name in result["contestants"]))
    for result, column in zip(results, axes.T):
        for axis, (key, label) in zip(column, (("seconds", "seconds"), ("spp", "samples per pixel"))):
            _draw_convergence(axis, result, names, key)
            axis.set(xscale="log", yscale="log", xlabel=label)
            low, high = axis.get_xlim()
            if high < SHORT * low:
                label_short_range(axis.xaxis)
            axis.grid(linewidth=0.4, alpha=0.4)
        column[0].set_title(f"{result['scene']}, {'x'.join(map(str, result['size']))}", fontsize="medium")
    for row in axes:
        row[0].set_ylabel("error (√relMSE)")
    marks = {label: mark for axis in axes.flat for mark, label in zip(*axis.get_legend_handles_labels())}
    figure.legend(
        marks.values(),
        marks.keys(),
        loc="outside lower center",
        ncols=1 + len(results),
        frameon=False,
        fontsize="small",
        title="\n".join(devices),
        title_fontsize="x-small",
    )
    return write_figure(path, figure)


def _draw_convergence(axis: Axes, result: Mapping[str, Any], names: Sequence[str], key: str) -> None:
    """Draw curves over `key`; a contestant's color and marker depend on its position in `names`."""
    slope: list[tuple[float, float]] = []
    for place, name in enumerate(names):
        row = result["contestants"].get(name)
        points = (
            []
            if row is None
            else [
                (x, sqrt(y), sqrt(max(low, 0)), sqrt(high))
                for x, y, (low, high) in zip(row[key], row["relmse"], row["relmse_range"])
                if x > 0 and y > 0
            ]
        )
        if points:
            x, y, low, high = zip(*points)
            color = COLORS[place % len(COLORS)]
            axis.plot(x, y, label=name, color=color, marker=MARKERS[place % len(MARKERS)], markersize=4, linewidth=1.3)
            axis.fill_between(x, low, high, color=color, alpha=0.15, linewidth=0)
            slope = slope or [(x[0], y[0]), (x[-1], y[0] * sqrt(x[0] / x[-1]))]
    if slope:
        axis.plot(*zip(*slope), ":", color="grey", linewidth=1, label="slope −½", zorder=0)
    if own := sqrt(result["reference"]["relmse"]):
        axis.axhline(own, color="lightgrey", linewidth=1, label="the reference's own", zorder=0)


def plot_theses(path: Path, results: Sequence[Mapping[str, Any]]) -> Path:
    """Plot the results of `measure_theses` and return the path: for each ratio two bars, ours and theirs; and frames
    per second over the depth of mirrors, relative to depth 4, so that machines are comparable."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 3.9), layout="constrained")
    bars, curves = figure.subplots(1, 2, width_ratios=(1.1, 1))
    _draw_ratios(bars, results)
    for result, color in zip([result for result in results if _depths(result)], COLORS):
        for key, style in (("seconds", "o-"), ("theirs", "s:")):
            points = _depths(result, key)
            start = dict(points).get(4, points[0][1]) if points else 0.0
            curves.plot(
                [depth for depth, _ in points],
                [start / seconds for _, seconds in points],
                style,
                color=color,
                markersize=4,
                label=result["name"] + (f", {result['thesis']}" if key == "theirs" else ""),
            )
    curves.set(xscale="log", xlabel="mirror depth", ylabel="frames per second over those at depth 4", ylim=(0, None))
    curves.set_xticks(ticks := [1, 2, 4, 10, 25, 40], [str(tick) for tick in ticks])
    curves.minorticks_off()
    curves.grid(linewidth=0.4, alpha=0.4)
    curves.legend(frameon=False, fontsize="small")
    return write_figure(path, figure)


def _draw_ratios(axis: Axes, results: Sequence[Mapping[str, Any]]) -> None:
    ratios = [
        (f"{result['name']}: {ratio['of']}\n/ {ratio['over']}", ratio["ours"], ratio["theirs"])
        for result in results
        for ratio in result["ratios"]
    ][::-1]
    for row, (_, ours, theirs) in enumerate(ratios):
        for value, place, color in ((ours, row + 0.18, COLORS[0]), (theirs, row - 0.18, "grey")):
            if value:
                axis.barh(place, value, 0.34, color=color)
                axis.annotate(f" {value:.{0 if value > 100 else 2}f}", (value, place), va="center", fontsize="small")
    axis.set(xscale="log", xlabel="relative time per frame; blue: clrt, grey: theirs")
    axis.set_yticks(range(len(ratios)), [name for name, _, _ in ratios], fontsize="small")
    axis.margins(x=0.2)


def _depths(result: Mapping[str, Any], key: str = "seconds") -> list[tuple[int, float]]:
    """Return depth and seconds of the rows that have both."""
    return [(row["depth"], row[key]) for row in result["rows"].values() if row["depth"] and row[key]]
