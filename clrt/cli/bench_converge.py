"""`clrt bench converge`: error against time, for the renderer's configurations and other renderers."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from math import ceil, inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import UsageError
from .bench_files import figures_options, write_figures
from .option_types import OneOf, Size

if TYPE_CHECKING:
    from ..bench.convergence.converge import Effort
    from ..bench.convergence.reference import Reference
    from ..scene.model import Scene
    from ..scene.render_settings import Integrator

#: The configurations of contestants.py, where the names start with "clrt, ".
NAMES = [
    "clrt",
    "stratified",
    "independent",
    "lanes 1",
    "bvh2",
    "adaptive",
    "guided",
    "lanes 8",
    "lanes 16",
    "paths in lanes",
    "unplanned",
]
INTEGRATORS = ["path", "direct", "local", "raster"]


@click.command("converge")
@click.argument("scenes", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="SCENE...")
@click.option(
    "--choice",
    "names",
    multiple=True,
    type=OneOf(NAMES),
    help="Configuration to compare with the first; may be repeated. Default: up to bvh2.",
)
@click.option(
    "--integrator",
    "integrators",
    multiple=True,
    type=OneOf(INTEGRATORS),
    help="Integrator instead of the scene's; may be repeated. Each has its own reference.",
)
@click.option(
    "--peers", is_flag=True, help="Also compare Mitsuba, which reads its own .xml files, and Cycles, if installed."
)
@click.option(
    "--device", "selectors", multiple=True, metavar="SEL", help="Device to use; see `clrt devices`. May be repeated."
)
@click.option("--size", type=Size(), help="Image size in pixels.")
@click.option(
    "--time",
    "seconds",
    type=click.FloatRange(min=0, min_open=True),
    metavar="SECONDS",
    help="Longest time per image; default: 10, with --quick 1, with --spp unlimited.",
)
@click.option(
    "--spp",
    multiple=True,
    type=click.IntRange(min=1),
    help="Samples per pixel instead of 1, 2, 4, ...; may be repeated.",
)
@click.option("--seeds", type=click.IntRange(min=1), help="Images of each kind; default: 5, with --quick 3.")
@click.option(
    "--reference",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Image to measure the error by, taken as exact; for one SCENE. Default: rendered and cached.",
)
@click.option(
    "--reference-spp",
    type=click.IntRange(min=2),
    help="Samples per pixel of the reference; default: 4096, with --quick 256.",
)
@click.option("--quick", is_flag=True, help="Use fewer seeds and a noisier reference.")
@figures_options
@click.option("--plot", type=click.Path(path_type=Path), metavar="FILE.png", help="Plot error against time there.")
def converge_command(
    scenes: tuple[Path, ...],
    names: tuple[str, ...],
    integrators: tuple[Integrator, ...],
    peers: bool,
    selectors: tuple[str, ...],
    size: tuple[int, int] | None,
    json_file: Path | None,
    plot: Path | None,
    reference: Path | None,
    **asked: Any,
) -> None:
    """Measure how fast images of each SCENE converge to a reference, which is rendered once and cached, or to the
    image that --reference names.

    All contestants render images of 1, 2, 4, ... samples per pixel with several seeds, in interleaved runs. Also
    reports how accurate clrt's error estimate is, and whether a contestant is biased (use many --seeds with a single
    --spp to test for bias).
    """
    from ..bench.convergence.calibration import calibrations
    from ..bench.convergence.converge import measure_convergence
    from ..bench.numerics.plots import plot_convergence
    from ..device.discovery.discover import choose
    from .converge_tables import calibration_lines, scene_lines

    devices = [choose(selector)[0] for selector in selectors or (None,)]
    named = [f"device {device.index}: {device.name} ({device.platform}, {device.driver})" for device in devices]
    click.echo("\n".join(named))
    loaded = _scenes(scenes, size, integrators)
    given = None if reference is None else _reference(reference, loaded, asked["reference_spp"])
    results = []
    for result in measure_convergence(
        loaded,
        [device.index for device in devices],
        _effort(**asked),
        peers=peers,
        given=given,
        files=[file for file in scenes for _ in integrators or [None]],
        choices=_choices(names),
        say=partial(click.echo, err=True),
    ):
        click.echo("\n".join(scene_lines(result, all(device.type == "cpu" for device in devices))) + "\n")
        results.append(result)
    told = calibrations(results)
    for line in calibration_lines(told):
        click.echo(line)
    write_figures(json_file, {"quick": asked["quick"], "scenes": results, "calibration": told})
    if plot is not None:
        click.echo(str(plot_convergence(plot, results, named)))


def _scenes(files: tuple[Path, ...], size: tuple[int, int] | None, integrators: tuple[Integrator, ...]) -> list[Scene]:
    """Return the scenes of the files, each with every integrator if any are named."""
    from ..formats.load_scene import load

    loaded = [load(file) for file in files]
    if size is not None:
        loaded = [replace(scene, render=replace(scene.render, size=size)) for scene in loaded]
    if not integrators:
        return loaded
    return [
        replace(scene, name=f"{scene.name}, {name}", render=replace(scene.render, integrator=name))
        for scene in loaded
        for name in integrators
    ]


def _reference(file: Path, scenes: list[Scene], spp: int | None) -> Reference:
    """Return the image of a file as the reference of the one scene."""
    from ..bench.convergence.reference import Reference
    from .render_job import read_reference

    if len(scenes) > 1 or spp:
        raise UsageError(
            f"{file}: is the reference of one image; name one SCENE, at most one --integrator, "
            "and leave out --reference-spp"
        )
    return Reference.exact(read_reference(file, scenes[0].render.size))


def _choices(names: tuple[str, ...]) -> dict[str, dict[str, Any]]:
    """Return the configurations of these names, by the contestants' names."""
    from ..bench.convergence.contestants import CHOICES, MORE_CHOICES

    chosen = [name if name == "clrt" else f"clrt, {name}" for name in names] or list(CHOICES)
    return {name: (CHOICES | MORE_CHOICES)[name] for name in chosen}


def _effort(
    quick: bool, seconds: float | None, spp: tuple[int, ...], seeds: int | None, reference_spp: int | None
) -> Effort:
    from ..bench.convergence.converge import QUICK, Effort

    usual = QUICK if quick else Effort()
    return Effort(
        seconds=seconds or (inf if spp else usual.seconds),
        seeds=seeds or usual.seeds,
        steps=usual.steps,
        step_spp=ceil(reference_spp / usual.steps) if reference_spp else usual.step_spp,
        spp=sorted(set(spp)) or usual.spp,
    )
