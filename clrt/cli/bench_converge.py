"""`clrt bench converge`: error against time, by the renderer's choices and beside other renderers."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from math import sqrt
from pathlib import Path
from typing import Any

import click


@click.command("converge")
@click.argument("scenes", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="SCENE...")
@click.option("--peers", is_flag=True, help="Beside other renderers, where installed: Mitsuba, Cycles.")
@click.option("--device", "selectors", multiple=True, metavar="SEL", help="See `clrt devices`; may be repeated.")
@click.option("--time", "seconds", type=click.FloatRange(min=0, min_open=True), metavar="SECONDS",
              help="That a picture may take; default: 10, with --quick 1.")
@click.option("--quick", is_flag=True, help="Fewer seeds and a rougher reference.")
@click.option("--json", "json_file", type=click.Path(path_type=Path), metavar="FILE", help="Write the figures there.")
@click.option("--plot", type=click.Path(path_type=Path), metavar="FILE.png", help="Draw error against time there.")
def converge_command(scenes: tuple[Path, ...], peers: bool, selectors: tuple[str, ...], seconds: float | None,
                     quick: bool, json_file: Path | None, plot: Path | None) -> None:
    """How fast pictures of each SCENE come near a reference of many samples, which is rendered once and kept.

    Pictures of 1, 2, 4 ... samples a pixel by all contestants in turns, with several seeds.
    """
    from ..device.discover import choose
    from ..output.files import check_target
    from ..output.plots import check_plot, plot_errors
    from ..output.report import write_report
    from ..scene.file import load
    from ..study.converge import QUICK, Effort, measure_convergence

    if json_file is not None:
        check_target(json_file)
    if plot is not None:
        check_plot(plot)
    effort = QUICK if quick else Effort()
    devices = [choose(selector)[0] for selector in selectors or (None,)]
    for device in devices:
        click.echo(f"device {device.index}: {device.name} ({device.platform}, {device.driver})")
    results = []
    for result in measure_convergence(
            [load(scene) for scene in scenes], [device.index for device in devices], peers=peers,
            effort=effort._replace(seconds=seconds or effort.seconds), say=partial(click.echo, err=True)):
        click.echo("\n".join(_lines(result, all(device.type == "cpu" for device in devices))) + "\n")
        results.append(result)
    if plot is not None:
        click.echo(str(plot_errors(plot, {result["scene"]: _curves(result) for result in results})))
    if json_file is not None:
        write_report(json_file, {"quick": quick, "scenes": results})
        click.echo(str(json_file))


def _lines(result: Mapping[str, Any], on_cpu: bool) -> list[str]:
    from ..study.converge import AGREES

    (width, height), reference = result["size"], result["reference"]
    lines = [f"{result['scene']}: {width}x{height}, {result['max_depth']} path edges; reference of {reference['spp']} "
             f"samples a pixel, relMSE {reference['relmse']:.1e}",
             f"  {'':28}{'spp':>7}{'seconds':>9}{'Msamples/s':>12}{'relMSE':>10}{'relMSE·s':>10}{'ratio':>7}"
             + " (  CPU)" * on_cpu + f"{'slope':>7}  mean ratio"]
    lines += [_line(name, row, on_cpu) for name, row in result["contestants"].items()]
    lines += [f"  {name}: {why}" for name, why in result["missing"].items()]
    lines += [f"  {name}: more than {AGREES:.1%} off in the mean, by too few samples or another scene"
              for name, row in result["contestants"].items() if not row["agrees"]]
    return lines + LEGEND


def _line(name: str, row: Mapping[str, Any], on_cpu: bool) -> str:
    last = row["last"]
    return (f"  {name:28}{row['spp'][last]:7}{row['seconds'][last]:9.3g}{row['msamples']:12.3g}"
            f"{row['relmse'][last]:10.3g}{row['relmse_seconds']:10.3g}{row['ratio']:7.2f}"
            + f" ({row['cpu_ratio']:5.2f})" * on_cpu + f"{row['slope']:7.2f}  "
            + " ".join(f"{ratio:.4f}" for ratio in row["mean_ratio"]))


LEGEND = ["  relMSE: mean over seeds, less the reference's own; ratio: of relMSE·s (CPU: processor's) to the first's",
          "  slope: of log relMSE over log samples; mean ratio: to the reference, by channel"]


def _curves(result: Mapping[str, Any]) -> dict[str, list[tuple[float, float]]]:
    """√relMSE against seconds, of each contestant."""
    return {name: [(seconds, sqrt(max(relmse, 0))) for seconds, relmse in zip(row["seconds"], row["relmse"])]
            for name, row in result["contestants"].items()}
