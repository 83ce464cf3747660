"""`clrt bench numerics`: errors and speed of each intersection test, and all hard cases with the defaults."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from .bench_files import figures_options, write_figures


@click.command("numerics")
@click.option("--device", metavar="SEL", help="Device to use; see `clrt devices`. Default: all but simulators.")
@click.option("--quick", is_flag=True, help="Take seconds instead of many minutes.")
@figures_options
@click.option("--plot", type=click.Path(path_type=Path), metavar="FILE.png", help="Plot error against speed there.")
def numerics_command(device: str | None, quick: bool, json_file: Path | None, plot: Path | None) -> None:
    """Measure numerical stability: errors and the speed they are bought with.

    First the intersection tests of each family, the default on top: Mrays/s of bounce rays (for offsets: Msamples/s of
    an image), speed relative to the default (by wall-clock time, in brackets by processor time), and errors: per
    million rays or pixels, or of t in units in the last place (ulp). Then the hard cases with the default tests: the
    number of wrong results, which must be 0 except for M1.
    """
    from ..bench.numerics.families import measure_families
    from ..bench.numerics.numerics import chosen_devices, measure_device, measure_together
    from ..bench.numerics.plots import plot_families
    from ..device.discovery.discover import devices

    chosen, known = chosen_devices(device), devices()
    results: list[dict[str, Any]] = []
    for index in chosen:
        info = known[index]
        click.echo(f"device {index}: {info['name']} ({info['platform']}, {info['driver']})")
        families = {}
        for name, tests in measure_families(index, quick=quick):
            families[name] = tests
            click.echo("\n".join(_family(name, tests)))
        rows = [_echo(row) for row in measure_device(index, quick=quick)]
        results.append({"device": info, "families": families, "rows": rows})
    together = [_echo(row) for row in measure_together(chosen, quick=quick)]
    wrong = sum(row["wrong"] for result in results for row in result["rows"])
    click.echo(f"wrong in total: {wrong + sum(row['wrong'] for row in together if row['case'] != 'M1')}")
    write_figures(json_file, {"quick": quick, "devices": results, "together": together})
    if plot is not None:
        click.echo(str(plot_families(plot, results)))


def _family(name: str, tests: Mapping[str, Mapping[str, Any]]) -> list[str]:
    from ..bench.numerics.families import FIGURES

    figures = FIGURES[name]
    lines = [f"  {name:18}{'M/s':>9}{'relative speed':>18}" + "".join(f"{title:>17}" for title in figures.values())]
    for test, row in tests.items():
        lines.append(
            f"  {test:18}{row['mrays']:9.3g}{1 / row['ratio']:9.2f} ({1 / row['cpu_ratio']:5.2f})  "
            + "".join(f"{row[key]:17.6g}" for key in figures)
        )
    return lines


def _echo(row: Any) -> dict[str, Any]:
    """Print a row immediately, and return it."""
    figure = "" if row.figure is None else f"{row.figure:12.4g} {row.unit}"
    click.echo(f"  {row.case:4} {row.what:72}{row.wrong:>8} of {row.count:<10}{figure}")
    return asdict(row)
