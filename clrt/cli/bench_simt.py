"""`clrt bench simt`: a model that ranks designs for GPUs, without a GPU."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .bench_files import figures_options, write_figures

if TYPE_CHECKING:
    from ..bench.simt.study import Effort
    from ..bench.simt.workloads import Sample
    from ..device.open import Device
    from ..scene.model import Scene


@click.command("simt")
@click.option(
    "--scene",
    "files",
    type=click.Path(path_type=Path),
    multiple=True,
    metavar="FILE",
    help="Scene whose paths are simulated; repeatable. Default: ray queries alone.",
)
@click.option("--registers", type=click.IntRange(1, 255), help="Registers of the scene's megakernel; default: known.")
@click.option("--instructions", type=click.IntRange(min=1), help="Instructions of the same; default: known.")
@click.option("--shade", type=click.IntRange(min=1), help="Instructions of the queues' shading; default: known.")
@click.option("--device", metavar="SEL", help="Device that records the rays; see `clrt devices`.")
@click.option("--quick", is_flag=True, help="Use smaller samples of the rays and paths.")
@figures_options
@click.option("--plot", type=click.Path(path_type=Path), metavar="FILE.png", help="Draw where warps idle there.")
def simt_command(
    files: tuple[Path, ...],
    registers: int | None,
    instructions: int | None,
    shade: int | None,
    device: str | None,
    quick: bool,
    json_file: Path | None,
    plot: Path | None,
) -> None:
    """Model ray tracing on GPUs: idle lanes, cache lines and rates of designs, without a GPU.

    Visits of nodes and triangles are recorded by the kernels themselves, and warps are simulated that follow them: of
    the megakernel, of queues, and of queues sorted by material. Rates are modelled, not measured; the table of measured
    points states the model's error.
    """
    from ..bench.simt.gpus import GPUS
    from ..bench.simt.maps import idle_lanes
    from ..bench.simt.plots import plot_idle
    from ..bench.simt.study import PUBLISHED, QUICK, Effort, Queries, errors_at, points_of, predicted_queries
    from ..bench.simt.workloads import all_paths
    from ..device.open import open_device
    from ..errors import UsageError
    from ..formats.load_scene import load

    if plot is not None and not files:
        raise UsageError("--plot draws the warps of scenes: add --scene FILE")
    loaded = {file.stem: load(file) for file in files}
    if len(loaded) < len(files):
        raise UsageError("two scenes have files of the same name; rename one")
    opened, effort = open_device(device), QUICK if quick else Effort()
    queries, scenes = Queries(opened, effort), {}
    results: dict[str, Any] = {"quick": quick, "scenes": {}}
    for file, (name, scene) in zip(files, loaded.items()):
        try:
            scenes[name], results["scenes"][name] = _scene(
                name, scene, opened, effort, (registers, instructions, shade)
            )
        except UsageError as error:
            raise UsageError(f"{file}: {error}") from error
        click.echo("\n".join(_scene_lines(name, results["scenes"][name])))
    rates = predicted_queries(queries, GPUS, effort.largest)
    results |= {"queries": rates, "published": PUBLISHED, "errors": errors_at([*queries.points(), *points_of(scenes)])}
    click.echo("\n".join([*_query_lines(rates, PUBLISHED), *_error_lines(results["errors"])]))
    write_figures(json_file, results)
    if plot is not None:
        size = (160, 120) if quick else (320, 240)
        maps = {}
        for name, scene in loaded.items():
            paths = all_paths(opened, scene, "cwbvh", size)
            maps[name] = idle_lanes(paths.visits, "cwbvh", size)
        click.echo(str(plot_idle(plot, maps)))


def _scene(
    name: str, scene: Scene, device: Device, effort: Effort, compiled: tuple[int | None, int | None, int | None]
) -> tuple[dict[str, Sample], dict[str, Any]]:
    """Return a scene's samples by layout, and its results."""
    from ..bench.simt.gpus import GPUS
    from ..bench.simt.measured import measured_programs
    from ..bench.simt.study import USUAL, groups_of, orders_of, predicted_scene, sampled_scene, warps_of
    from ..bench.simt.variants import Program

    known = measured_programs().get(name, USUAL)
    registers, instructions, shade = compiled
    program = Program(registers or known.registers, instructions or known.instructions, shade or known.shade)
    samples = sampled_scene(device, scene, effort)
    sample = samples["cwbvh"]
    return samples, {
        "program": asdict(program),
        "paths": sample.visits.paths,
        "rays": sample.visits.rays,
        "warps": {layout: warps_of(each, layout) for layout, each in samples.items()},
        "orders": orders_of(sample, "cwbvh"),
        "groups": groups_of(sample, "cwbvh", program),
        "predicted": predicted_scene(samples, program, GPUS),
    }


def _scene_lines(name: str, result: Mapping[str, Any]) -> Iterator[str]:
    program = result["program"]
    yield (
        f"{name}: {result['paths']} paths, {result['rays']} rays; "
        f"{program['registers']} registers, {program['instructions']} instructions, {program['shade']} to shade"
    )
    yield f"  {'lanes at work, of 32':28}{'extend':>9}{'shade':>9}{'connect':>9}{'lines per node':>18}{'misses':>9}"
    for layout, variants in result["warps"].items():
        for variant, stages in variants.items():
            extend, connect = stages.get("extend"), stages.get("connect")
            nodes = extend["kinds"].get("nodes", {}).get("touched", 0.0) if extend else 0.0
            yield (
                f"  {f'{layout}, {variant}':28}{_share(extend):>9}{_share(stages['shade']):>9}{_share(connect):>9}"
                f"{nodes:18.2f}{extend['missed'] if extend else 0.0:9.1%}"
            )
    for order, kinds in result["orders"].items():
        shares = ", ".join(f"{kind} {each['lanes']:.0%} of {each['passes']}" for kind, each in kinds.items())
        yield f"  camera rays in {order}: {shares or 'none'}"
    for kind, groups in result["groups"].items():
        rows = ", ".join(f"{group}: {row['warps']} warps, {row['held']:.0%}" for group, row in groups.items())
        yield f"  {kind}, warps resident by group size and fraction of that time at work: {rows}"
    yield f"  {'modelled':42}{'Msamples/s':>12}{'Mrays/s':>10}{'extend':>9}{'connect':>9}{'shade':>9}"
    for gpu, layouts in result["predicted"].items():
        for layout, variants in layouts.items():
            for variant, row in variants.items():
                yield (
                    f"  {f'{gpu}, {layout}, {variant}':42}{1e-6 * row['samples']:12.4g}{1e-6 * row['rays']:10.4g}"
                    f"{row['extend']:9.0%}{row['connect']:9.0%}{row['shade']:9.0%}"
                )


def _share(stage: Mapping[str, Any] | None) -> str:
    return "" if stage is None else f"{stage['lanes']:.0%}"


def _query_lines(rates: Mapping[str, Any], published: Mapping[str, Any]) -> Iterator[str]:
    kinds = next(iter(next(iter(rates.values())).values()))
    yield f"  {'modelled, Grays/s':28}" + "".join(f"{kind:>10}" for kind in kinds)
    for gpu, layouts in rates.items():
        for layout, row in layouts.items():
            yield f"  {f'{gpu}, {layout}':28}" + "".join(f"{1e-9 * rate:10.3g}" for rate in row.values())
    for gpu, (source, (low, high)) in published.items():
        yield f"  published for {gpu}: {1e-9 * low:.3g} to {1e-9 * high:.3g} ({source})"


def _error_lines(errors: Mapping[str, Any]) -> Iterator[str]:
    yield f"  {'modelled over measured':60}{'M/s measured':>14}{'modelled':>10}{'ratio':>8}{'left out':>10}"
    for row in errors["rows"]:
        yield (
            f"  {row['gpu'] + ': ' + row['point']:60}{1e-6 * row['measured']:14.4g}{1e-6 * row['modelled']:10.4g}"
            f"{row['modelled'] / row['measured']:8.2f}{row['left_out']:10.2f}"
        )
    factors = ", ".join(f"{kind} {factor:.2f}" for kind, factor in errors["factor"].items())
    yield f"  within a factor of (root mean square, each point left out of the fit): {factors}"
    yield "  fitted to these: " + ", ".join(f"{name} {number:.4g}" for name, number in errors["fitted"].items())
