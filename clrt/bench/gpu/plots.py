"""Plots of the parts, as SVG, by matplotlib (an extra)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from io import StringIO
from itertools import cycle
from typing import TYPE_CHECKING, Any

from ...output.error_plots import MARKERS
from ..numerics.plots import COLORS
from .columns import rows_of
from .request import Row
from .summary import measured

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH, BAR = 9.5, 0.19
#: Draws the rows of a part, and returns the height in inches that suits them.
Plot = Callable[["Axes", Mapping[str, Row]], float]


def svg_of(plot: Plot, part: Mapping[str, Any]) -> str:
    """Return the plot of a part as an SVG element; empty if nothing was measured."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    if not (rows := measured(part)):
        return ""
    figure, text = Figure(layout="constrained"), StringIO()
    axis = figure.subplots()
    figure.set_size_inches(WIDTH, plot(axis, rows))
    with rc_context({"svg.fonttype": "none"}):
        figure.savefig(text, format="svg")
    return text.getvalue()[text.getvalue().index("<svg") :]


def bars(axis: Axes, values: Mapping[str, Mapping[str, float]], label: str) -> float:
    """Draw bars by group and name, each labelled with its value, and return a height."""
    names = list(dict.fromkeys(name for group in values.values() for name in group))
    place, ticks = 0.0, []
    for group, figures in values.items():
        first = place
        for name, value in figures.items():
            axis.barh(place, value, 0.9, color=COLORS[names.index(name) % len(COLORS)])
            axis.annotate(f" {value:.4g}", (value, place), va="center", fontsize="x-small")
            place += 1
        ticks.append(((first + place - 1) / 2, group))
        place += 0.6
    if len(names) > 1:
        for name, color in zip(names, cycle(COLORS)):
            axis.barh(0, 0, color=color, label=name)
        axis.legend(frameon=False, fontsize="small")
    axis.set_yticks([at for at, _ in ticks], [name for _, name in ticks], fontsize="small")
    axis.set(xlabel=label, ylim=(place, -1))
    axis.margins(x=0.12)
    return 1.0 + BAR * place


def lines(axis: Axes, curves: Mapping[str, list[tuple[float, float]]], across: str, up: str) -> float:
    """Draw curves by name on logarithmic axes, and return a height."""
    for (name, points), color, marker in zip(curves.items(), cycle(COLORS), cycle(MARKERS)):
        axis.plot(*zip(*sorted(points)), label=name, color=color, marker=marker, markersize=4, linewidth=1.4)
    axis.set(xscale="log", yscale="log", xlabel=across, ylabel=up)
    axis.grid(linewidth=0.4, alpha=0.4)
    axis.legend(frameon=False, fontsize="small")
    return 3.8


def _by(rows: Mapping[str, Row], group: str, name: str, value: str) -> dict[str, dict[str, float]]:
    """Return a value of the rows by two of their other fields."""
    found: dict[str, dict[str, float]] = {}
    for row in rows.values():
        found.setdefault(str(row[group]), {})[str(row[name])] = row[value]
    return found


def _curves(rows: Mapping[str, Row], name: str, across: str, up: str) -> dict[str, list[tuple[float, float]]]:
    found: dict[str, list[tuple[float, float]]] = {}
    for row in rows.values():
        found.setdefault(str(row[name]), []).append((row[across], row[up]))
    return found


def _rays(axis: Axes, rows: Mapping[str, Row]) -> float:
    return bars(axis, _by(rows, "layout", "kind", "mrays"), "Mrays/s, kernels alone")


def _samples(axis: Axes, rows: Mapping[str, Row]) -> float:
    split = {item: item.rpartition(", ") for item in rows}
    values: dict[str, dict[str, float]] = {}
    for item, row in rows.items():
        values.setdefault(split[item][0], {})[split[item][2]] = row["msamples"]
    return bars(axis, values, "Msamples/s")


def _groups(axis: Axes, rows: Mapping[str, Row]) -> float:
    curves = _curves(rows, "of", "group", "mrays")
    height = lines(axis, curves, "work-items per group", "Mrays/s")
    groups = sorted({row["group"] for row in rows.values()})
    axis.set_xticks(groups, [str(group) for group in groups])
    axis.minorticks_off()
    return height


def _builds(axis: Axes, rows: Mapping[str, Row]) -> float:
    return lines(axis, _curves(rows, "builder", "triangles", "mtriangles"), "triangles", "Mtriangles/s")


def _frames(axis: Axes, rows: Mapping[str, Row]) -> float:
    variants = rows_of({"rows": rows})
    values = {
        item: {"clrt": 1e3 * row["seconds"], **({"theirs": 1e3 * row["theirs"]} if row["theirs"] else {})}
        for item, row in variants.items()
    }
    axis.set_xscale("log")
    return bars(axis, values, "ms/frame")


def _calls(axis: Axes, rows: Mapping[str, Row]) -> float:
    curves = {
        title: [(row["rays"], 1e3 * row[key]) for row in rows.values()]
        for title, key in (("whole calls", "call_seconds"), ("kernels", "kernel_seconds"))
    }
    return lines(axis, curves, "rays", "ms")


def _compiles(axis: Axes, rows: Mapping[str, Row]) -> float:
    values = {item: {"cold": row["cold_seconds"], "warm": row["warm_seconds"]} for item, row in rows.items()}
    return bars(axis, values, "seconds to build the program")


PLOTS: dict[str, Plot] = {
    "rays": _rays,
    "samples": _samples,
    "groups": _groups,
    "builds": _builds,
    "frames": _frames,
    "calls": _calls,
    "compiles": _compiles,
}
