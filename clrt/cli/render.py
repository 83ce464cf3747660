"""`clrt render`: a scene to images and a report."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import click

from . import PROGRAM
from .displays import make_progress
from .farm import ClusterOptions, cluster_for
from .frames import FrameOptions
from .guard import guarded
from .interrupt import end_by_signals
from .load_options import LoadOptions
from .logs import silence, verbose_option
from .option_groups import grouped
from .options import picture_options, tracing_options
from .render_job import INTERRUPTED, RenderJob
from .render_options import DisplayOptions, OutputOptions, SavingOptions, StopOptions

if TYPE_CHECKING:
    from ..rendering.renderer_options import RendererOptions


@click.command()
@click.argument("scene", type=click.Path(path_type=Path))
@grouped("asked", OutputOptions)
@picture_options
@grouped("stop", StopOptions)
@click.option(
    "--device",
    "devices",
    multiple=True,
    metavar="SEL",
    help="Device: number, id, part of a name, cpu or gpu; see `clrt devices`. Repeat to use several.",
)
@grouped("saving", SavingOptions)
@grouped("display", DisplayOptions)
@grouped("frames", FrameOptions)
@grouped("cluster_options", ClusterOptions)
@verbose_option
@tracing_options
def command(
    scene: Path,
    loading: LoadOptions,
    devices: tuple[str, ...],
    asked: OutputOptions,
    stop: StopOptions,
    saving: SavingOptions,
    display: DisplayOptions,
    frames: FrameOptions,
    cluster_options: ClusterOptions,
    **options: Any,
) -> None:
    """Render SCENE until the first of --spp, --time and --error is reached. SCENE is a .toml scene, a Mitsuba scene
    (.xml), a pbrt scene (.pbrt), a model, or - for a .toml scene on standard input."""
    if click.get_current_context().obj == PROGRAM:
        guarded(saving.advice)
    end_by_signals()
    from ..output.image_library import load_writer

    load_writer()
    job = RenderJob(
        scene,
        loading,
        asked,
        stop,
        saving,
        frames,
        cast("RendererOptions", {**options, "device": devices or None}),
        display.print_kernel,
    )
    job.check()
    if display.quiet:
        silence()
    local = ClusterOptions()
    with (
        make_progress(display.progress_kind, display.quiet) as progress,
        cluster_for(local if display.print_kernel else cluster_options, progress) as cluster,
    ):
        finished = job.run(cluster, progress)
    if not finished:
        sys.exit(INTERRUPTED)
