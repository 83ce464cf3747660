"""`clrt render`: a scene to pictures and a report."""

from __future__ import annotations

import atexit
import gc
import logging
import signal
import sys
import time
from pathlib import Path
from typing import Any

import click

from ..errors import UsageError
from . import STARTED
from .options import Size, tracing_options
from .progress import Goal, make_progress


@click.command()
@click.argument("scene", type=click.Path(path_type=Path))
@click.option("-o", "--output", "outputs", multiple=True, type=click.Path(path_type=Path), metavar="FILE",
              help="Picture to write: .png, .exr or .hdr; may be repeated. Default: <scene>.png here.")
@click.option("--size", type=Size(), help="Picture size in pixels.")
@click.option("--spp", type=click.IntRange(min=1), help="Stop at this many samples a pixel.")
@click.option("--time", "seconds", type=float, metavar="SECONDS", help="Stop after this time.")
@click.option("--error", type=float, help="Stop at this estimated error (root of relMSE).")
@click.option("--depth", type=click.IntRange(1, 1024), help="Path edges: 1 glow only, 2 direct light, 3 one bounce.")
@click.option("--seed", type=click.IntRange(0, 2**32 - 1), help="Seed of the random numbers.")
@click.option("--device", "devices", multiple=True, metavar="SEL",
              help="Number, id, part of a name, cpu or gpu; see `clrt devices`.")
@click.option("--integrator", type=click.Choice(["path", "direct"]), help="What to compute.")
@click.option("--sampler", type=click.Choice(["sobol", "stratified", "independent"]), help="Where samples come from.")
@click.option("--filter", "pixel_filter", type=click.Choice(["box", "tent", "blackman_harris"]), help="Pixel filter.")
@click.option("--adaptive", is_flag=True, default=None, help="More samples where the error is larger.")
@click.option("--reference", type=click.Path(path_type=Path), metavar="FILE", help="Picture to measure the error by.")
@click.option("--report", type=click.Path(path_type=Path), metavar="FILE.json", help="Write what was done.")
@click.option("--plot", type=click.Path(path_type=Path), metavar="FILE.png", help="Draw error against time there.")
@click.option("--denoise", is_flag=True,
              help="Denoise the picture; the raw one is kept beside it as <stem>.raw<suffix>.")
@click.option("--view", default="srgb", show_default=True, metavar="NAME", help="View transform of .png pictures.")
@click.option("--exposure", default=0.0, metavar="EV", help="Exposure of .png pictures, in stops.")
@click.option("--progress", "progress_kind", type=click.Choice(["bar", "plain", "json"]), help="Progress on stderr.")
@click.option("--print-kernel", is_flag=True, help="Print the program that would run, and stop.")
@click.option("-q", "--quiet", is_flag=True, help="No progress and no warnings.")
@tracing_options
def command(scene: Path, outputs: tuple[Path, ...], size: tuple[int, int] | None, spp: int | None,
            seconds: float | None, error: float | None, depth: int | None, seed: int | None, devices: tuple[str, ...],
            integrator: str | None, sampler: str | None, pixel_filter: str | None, adaptive: bool | None,
            reference: Path | None, report: Path | None, plot: Path | None, denoise: bool, view: str, exposure: float,
            progress_kind: str | None, print_kernel: bool, quiet: bool, **tracing: Any) -> None:
    """Render SCENE, a .toml scene or a bare model, until the first of --spp, --time and --error is reached."""
    from ..output.denoise import Denoiser, denoised, raw_path
    from ..output.image import Image
    from ..rendering.aov import render_aovs
    from ..rendering.renderer import Renderer
    from ..rendering.report import render_report
    from ..rendering.stops import check_stops, planned_spp
    from ..scene.file import load

    atexit.register(gc.freeze)  # else Python, as it ends, searches all modules' objects for garbage, in 0.05 s
    outputs = outputs or (Path(f"{scene.stem}.png"),)
    if len(devices) > 1:
        raise UsageError(f"--device is given {len(devices)} times; this version renders on one device, so name one")
    raws = tuple(map(raw_path, outputs)) if denoise else ()
    _check_outputs(outputs, raws, report, plot, view, reference)
    check_stops(spp, seconds, error)
    denoiser = Denoiser() if denoise else None
    if quiet:
        logging.disable(logging.WARNING)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # a batch system's end keeps the picture, too
    options: dict[str, Any] = {
        "size": size, "max_depth": depth, "seed": seed, "device": devices[0] if devices else None,
        "integrator": integrator, "sampler": sampler, "filter": pixel_filter,
        "adaptive": adaptive, **tracing}
    with make_progress(progress_kind, quiet) as progress:
        progress.phase("load")
        content = load(scene)
        expected = None if reference is None else _read_reference(reference, size or content.render.size)
        renderer = Renderer(content, spp=planned_spp(content.render, spp, seconds, error), on_phase=progress.phase,
                            **options)
        if print_kernel:
            click.echo(renderer.compiled.source)
            return
        aovs = render_aovs(renderer.session) if denoiser else {}
        progress.phase("render")
        goal = Goal(planned_spp(renderer.settings, spp, seconds, error), seconds, error)
        try:
            for state in renderer.passes(spp=spp, time=seconds, error=error, reference=expected):
                progress.state(state, goal)
        except KeyboardInterrupt:
            state = renderer.state(expected)
            renderer.stop_reason = "interrupted"
        progress.phase("write")
        image = Image(state.pixels, render_report(renderer, state))
        _save(image, raws or outputs, view, exposure)
        if denoiser is not None:
            progress.phase("denoise")
            image = denoised(image, denoiser, aovs, expected)
            _save(image, outputs, view, exposure)
        _write_measures(renderer, image, report, plot)
    if renderer.stop_reason == "interrupted":
        sys.exit(130)


def _check_outputs(outputs: tuple[Path, ...], raws: tuple[Path, ...], report: Path | None, plot: Path | None,
                   view: str, reference: Path | None) -> None:
    """Finds out before the render whether its results can be written."""
    from ..output.files import check_target
    from ..output.images import check_writable
    from ..output.plots import check_plot
    from ..output.view import check_view

    check_view(view)
    for output in [*outputs, *raws]:
        check_writable(output)
        if output in raws and output in outputs:
            raise UsageError(f"{output}: is where the raw picture is kept; name another picture with -o")
        if reference is not None and output.resolve() == reference.resolve():
            raise UsageError(f"{output}: is the reference, and would be overwritten; name another picture with -o")
    if report is not None:
        check_target(report)
    if plot is not None:
        check_plot(plot)


def _read_reference(path: Path, size: tuple[int, int]) -> Any:
    from ..output.images import read_image

    pixels = read_image(path)
    height, width = pixels.shape[:2]
    if (width, height) != size:
        raise UsageError(f"{path}: the reference is {width}x{height}, the picture {size[0]}x{size[1]}; "
                         f"use --size {width}x{height}")
    return pixels


def _save(image: Any, paths: tuple[Path, ...], view: str, exposure: float) -> None:
    for path in paths:
        click.echo(str(image.save(path, view=view, exposure=exposure)))


def _write_measures(renderer: Any, image: Any, report: Path | None, plot: Path | None) -> None:
    from ..output.plots import plot_history
    from ..output.report import write_report

    if report is not None:
        write_report(report, {**image.report, "total_seconds": time.perf_counter() - STARTED})
        click.echo(str(report))
    if plot is not None:
        click.echo(str(plot_history(plot, renderer.scene.name, renderer.history)))
