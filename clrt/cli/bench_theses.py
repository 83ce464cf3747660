"""`clrt bench theses`: the experiments of two theses, with their own results."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import click

from .bench_files import figures_options, write_figures


@click.command("theses")
@click.option("--device", metavar="SEL", help="Device to use; see `clrt devices`.")
@click.option("--quick", is_flag=True, help="Use smaller images, fewer triangles in the hall and fewer frames.")
@click.option("--dragon", type=click.Path(path_type=Path), metavar="FILE", help="Replaces the generated dragon.")
@click.option("--tree", type=click.Path(path_type=Path), metavar="FILE", help="Replaces the generated tree.")
@click.option("--statue", type=click.Path(path_type=Path), metavar="FILE", help="Replaces the generated statue.")
@figures_options
@click.option("--plot", type=click.Path(path_type=Path), metavar="FILE.png", help="Plot the results there.")
def theses_command(
    device: str | None, quick: bool, json_file: Path | None, plot: Path | None, **models: Path | None
) -> None:
    """Measure the time per frame with and without a BVH, rasterised and ray traced, and by mirror depth.

    The scenes resemble those of the theses (docs/theses.md), whose results are shown next to clrt's. They come from
    other machines: only the ratios can be compared.
    """
    from ..bench.numerics.plots import plot_theses
    from ..bench.theses.experiments import QUICK, Effort, Models, measure_theses

    results = []
    for result in measure_theses(
        QUICK if quick else Effort(), Models(**models), device=device, say=partial(click.echo, err=True)
    ):
        click.echo("\n".join(_lines(result)) + "\n")
        results.append(result)
    click.echo(
        "theirs: measured on another machine, in the scene and at the size in the title"
        "\nof 1/16: measured on an image with a 16th of the pixels, and scaled"
    )
    write_figures(json_file, {"quick": quick, "models": models, "experiments": results})
    if plot is not None:
        click.echo(str(plot_theses(plot, results)))


def _lines(result: Mapping[str, Any]) -> list[str]:
    width, height = result["size"]
    lines = [
        result["title"],
        f"  {result['triangles']} triangles, {width}x{height}; {result['device']}, "
        f"{result['platform']}; theirs: {result['machine']}",
        f"  {'':36}{'ms/frame':>12}{'frames/s':>10}{'frames':>8}{'rays/sample':>13}{'Mrays/s':>9}"
        f"{'theirs: ms':>12}{'frames/s':>10}",
    ]
    for name, row in result["rows"].items():
        theirs = f"{1e3 * row['theirs']:12.4g}{1 / row['theirs']:10.4g}" if row["theirs"] else ""
        part = f", of 1/{row['part'] ** 2}" if row["part"] > 1 else ""
        lines.append(
            f"  {name + part:36}{1e3 * row['seconds']:12.4g}{row['frames_per_second']:10.4g}{row['frames']:8}"
            f"{row['rays'] / row['samples']:13.3f}{1e-6 * row['rays'] / row['seconds']:9.3g}{theirs}"
        )
    for ratio in result["ratios"]:
        cpu = f" ({ratio['cpu']:.4g} of processor time)" if result["device_type"] == "cpu" else ""
        theirs = f"; theirs {ratio['theirs']:.4g}" if ratio["theirs"] else ""
        lines.append(f"  {ratio['of']} / {ratio['over']}: {ratio['ours']:.4g} times the time{cpu}{theirs}")
    return lines
