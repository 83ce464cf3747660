"""`clrt render`: a scene to images and a report."""

from __future__ import annotations

import atexit
import gc
import logging
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import DeviceError, OutputError, ReaderGoneError, UsageError
from ..threads import beside
from . import PROGRAM
from .displays import make_progress
from .farm import cluster_for, farm_options, is_huge, make_renderer, render_frames, render_huge
from .frames import FrameSequence, frame_options, make_sequence
from .goal import Goal
from .guard import guarded
from .interrupt import Interruptible, end_by_signals
from .logs import silence, verbose_option
from .options import picture_options, tracing_options
from .outputs import Outputs
from .pipes import split_pipes
from .progress import Progress

if TYPE_CHECKING:
    from ..device.open import Device
    from ..output.denoise import Denoiser
    from ..rendering.renderer import Renderer, State

#: The exit code after Ctrl-C.
INTERRUPTED = 130
#: With a reference, a warning is logged if the estimated error is off by more than this factor.
RIGHT = 1.2


@click.command()
@click.argument("scene", type=click.Path(path_type=Path))
@click.option("-o", "--output", "outputs", multiple=True, type=click.Path(path_type=Path), metavar="FILE",
              help="Image to write: .png, .exr or .hdr; may be repeated. - is standard output as PNG, exr:- as "
                   "OpenEXR. Default: <scene>.png in the current folder.")
@picture_options
@click.option("--spp", type=click.IntRange(min=1), help="Stop at this many samples per pixel.")
@click.option("--time", "seconds", type=float, metavar="SECONDS", help="Stop after this time.")
@click.option("--error", type=float, help="Stop at this estimated error (root of relMSE).")
@click.option("--error-percentile", type=click.FloatRange(0, 100, min_open=True), metavar="PERCENT",
              help="Stop when this percentage of the tiles of 8x8 pixels has reached --error, not the whole image.")
@click.option("--device", "devices", multiple=True, metavar="SEL",
              help="Device: number, id, part of a name, cpu or gpu; see `clrt devices`. Repeat to use several.")
@click.option("--integrator", type=click.Choice(["path", "direct", "local", "raster", "normals", "albedo", "depth"]),
              help="Integrator; default: the scene's.")
@click.option("--shadows/--no-shadows", default=None, help="Whether local and raster cast shadow rays.")
@click.option("--adaptive", is_flag=True, default=None, help="Take more samples where the error is larger.")
@click.option("--reference", type=click.Path(path_type=Path), metavar="FILE",
              help="Reference image to measure the error against.")
@click.option("--report", type=click.Path(path_type=Path), metavar="FILE.json", help="Write a report of the render.")
@click.option("--plot", type=click.Path(path_type=Path), metavar="FILE.png", help="Plot error against time there.")
@click.option("--aov", "aovs", multiple=True, metavar="NAME,...",
              help="AOVs to write: layers of an .exr, or files next to a .png. An unknown NAME lists them.")
@click.option("--denoise", is_flag=True,
              help="Denoise the image; the raw one is saved next to it as <stem>.raw<suffix>.")
@click.option("--checkpoint", type=click.Path(path_type=Path), metavar="FILE",
              help="Save the state there regularly, so that --resume can continue; FILE~ is the previous one.")
@click.option("--checkpoint-every", type=click.FloatRange(min=0), default=30.0, show_default=True, metavar="SECONDS",
              help="Time between checkpoints; longer if they would take more than 2 % of the time.")
@click.option("--resume", is_flag=True, help="Resume from --checkpoint; start afresh if it does not exist yet.")
@click.option("--view", default="srgb", show_default=True, metavar="NAME",
              help="View transform of .png images: srgb, agx, pbr_neutral, reinhard, raw, aces, ocio:VIEW.")
@click.option("--exposure", default=0.0, metavar="EV", help="Exposure of .png images, in stops.")
@click.option("--progress", "progress_kind", type=click.Choice(["bar", "plain", "json"]),
              help="Format of the progress display on standard error; default: bar on a terminal, else plain.")
@click.option("--force", is_flag=True, help="Replace files that are read-only.")
@click.option("--print-kernel", is_flag=True, help="Print the kernel source that would run, and exit.")
@click.option("-q", "--quiet", is_flag=True, help="Show no progress and no warnings.")
@frame_options
@farm_options
@verbose_option
@tracing_options
def command(scene: Path, outputs: tuple[Path, ...], camera: str | None, size: tuple[int, int] | None, spp: int | None,
            seconds: float | None, error: float | None, error_percentile: float | None, depth: int | None,
            seed: int | None, devices: tuple[str, ...],
            integrator: str | None, shadows: bool | None, sampler: str | None, pixel_filter: str | None,
            adaptive: bool | None, reference: Path | None, report: Path | None, plot: Path | None,
            aovs: tuple[str, ...], denoise: bool, checkpoint: Path | None, checkpoint_every: float, resume: bool,
            view: str, exposure: float, progress_kind: str | None, force: bool, print_kernel: bool,
            quiet: bool, frames: str | None, turntable: int | None, fps: float | None, scheduler: str | None,
            local_cluster: int | None, **others: Any) -> None:
    """Render SCENE until the first of --spp, --time and --error is reached. SCENE is a .toml scene, a Mitsuba scene
    (.xml), a model, or - for a .toml scene on standard input."""
    def advice() -> str:
        kept = checkpoint is not None and checkpoint.exists()
        return f"; {checkpoint} holds the samples so far: resume with --resume" if kept else ""

    if click.get_current_context().obj == PROGRAM:
        guarded(advice)
    end_by_signals()
    from ..output.data_images import check_denoisable
    from ..output.image_library import load_writer

    load_writer()
    from ..formats.load_scene import STDIN, check_scene, load
    from ..formats.referenced_files import files_read
    from ..rendering.stop_conditions import check_stops, planned_spp

    check_scene(scene)
    layers = _chosen_aovs(aovs) if aovs else ()
    named = (scene,) if reference is None else (scene, reference)
    usual = Path("scene.png" if scene == STDIN else f"{scene.stem}.png")
    files, pipes = split_pipes(outputs or (usual,))
    results = Outputs(named, files, layers, denoise, view, exposure, report, plot, force, pipes=pipes)
    sequence = make_sequence(results, frames, resume, {"checkpoint": checkpoint, "reference": reference, "plot": plot}
                             ) if frames or turntable else None
    if sequence is None:
        if fps is not None:
            raise UsageError("--fps is the frame rate of an animation; add --frames or --turntable")
        if resume and checkpoint is None:
            raise UsageError("--resume needs a checkpoint; give its file with --checkpoint")
        results.check(checkpoint)
        results.check_unprotected(checkpoint)
    check_stops(spp, seconds, error)
    if error_percentile is not None and error is None:
        raise UsageError("--error-percentile is the part of the image that must reach --error; add --error")
    denoiser = _denoiser() if denoise else None
    if quiet:
        silence()
    options: dict[str, Any] = {
        "size": size, "max_depth": depth, "seed": seed, "device": devices or None,
        "integrator": integrator, "shadows": shadows, "sampler": sampler, "filter": pixel_filter, "adaptive": adaptive,
        "checkpoint": None if print_kernel else checkpoint, "resume": resume and not (print_kernel or sequence),
        "checkpoint_seconds": checkpoint_every, "error_percentile": error_percentile, "aovs": layers,
        "first_hits": denoise, **others}
    if print_kernel:
        scheduler = local_cluster = None
    with (make_progress(progress_kind, quiet) as progress,
          cluster_for(scheduler, local_cluster, progress) as cluster):
        opening = None if cluster else beside(lambda: _open(devices or None))
        progress.phase("load")
        with files_read() as inputs:
            content = load(scene, camera)
        if sequence is None:
            results.check_apart(inputs, checkpoint)
        else:
            content = sequence.scene(content, size, turntable, fps)
            sequence.check_apart(inputs)
        expected = None if reference is None else read_reference(reference, size or content.render.size)
        planned = planned_spp(content.render, spp, seconds, error)
        if denoiser is not None:
            check_denoisable(integrator or content.render.integrator)
        goal = Goal(planned, seconds, error, error_percentile)
        if cluster and sequence:
            if not render_frames(cluster, content, options, goal, sequence, progress):
                sys.exit(INTERRUPTED)
            return
        if cluster and is_huge(size or content.render.size):
            if not render_huge(cluster, content, options, goal, results, progress):
                sys.exit(INTERRUPTED)
            return
        if opening is not None:
            options["device"] = opening()
        renderer = make_renderer(cluster, content, spp=planned, on_phase=progress.phase, **options)
        if print_kernel:
            click.echo(renderer.compiled.source)
            return
        # Otherwise Python searches all modules' objects for garbage at exit, which takes 0.05 s. Not if it exits before
        # the render: OpenImageIO then reports its remaining objects.
        atexit.register(gc.freeze)
        with Interruptible(renderer.interrupt) as interruptible:
            try:
                if sequence is None:
                    _render(renderer, results, goal, expected, denoiser, progress)
                else:
                    _render_frames(renderer, sequence, goal, denoiser, progress)
            except (DeviceError, OutputError) as failure:
                advised = type(failure)(f"{failure}{advice()}")
                if interruptible.asked and isinstance(failure, ReaderGoneError):
                    advised.exit_code = INTERRUPTED     # Ctrl-C ends all programs of a pipeline
                raise advised from failure
        if renderer.stop_reason == "interrupted":
            logging.getLogger(__name__).warning("%s: interrupted; %s", content.name, (
                "run the same command with --resume to render the missing frames" if sequence else
                f"run it with --resume to continue from {checkpoint}" if checkpoint else
                "to be able to resume a render, start it with --checkpoint"))
    if interruptible.asked:
        sys.exit(INTERRUPTED)


def _chosen_aovs(names: tuple[str, ...]) -> tuple[str, ...]:
    from ..rendering.aovs import chosen_aovs
    return chosen_aovs(",".join(names))


def _open(selectors: tuple[str, ...] | None) -> list[Device]:
    """Open the devices and import what renders: half of this is file access, and it needs no scene."""
    from ..device.open import open_devices

    devices = open_devices(selectors)
    from ..rendering import renderer  # noqa: F401
    return devices


def _denoiser() -> Denoiser:
    from ..output.denoise import Denoiser
    return Denoiser()


def _render_frames(renderer: Renderer, sequence: FrameSequence, goal: Goal, denoiser: Denoiser | None,
                   progress: Progress) -> None:
    """Render the remaining frames, each to the goal, and encode the videos."""
    shots = list(sequence.left(renderer.scene, renderer.choices, goal))
    for done, (results, camera) in enumerate(shots):
        progress.frame(results.header["frame"], done, len(shots))
        renderer.look(camera)
        _render(renderer, results, goal, None, denoiser, progress)
        if renderer.stop_reason == "interrupted":
            return
    sequence.join()


def _render(renderer: Renderer, results: Outputs, goal: Goal, expected: Any, denoiser: Denoiser | None,
            progress: Progress) -> None:
    """Render to the goal, or until interrupted, and write the results; an interrupted frame is not written."""
    guides = renderer.session.guides() if denoiser else {}
    progress.phase("render", device=renderer.name, device_bytes=renderer.session.device_bytes)
    for state in renderer.passes(spp=goal.spp, time=goal.seconds, error=goal.error, reference=expected):
        progress.workers(renderer.session.shares())
        progress.state(state, goal)
        unfinished = results.header and renderer.stop_reason == "interrupted"
        if renderer.stop_reason is not None and not unfinished:    # its last checkpoint is written at the same time
            _write(renderer, state, results, denoiser, guides, expected, progress)


def _write(renderer: Renderer, state: State, results: Outputs, denoiser: Denoiser | None, guides: Mapping[str, Any],
           expected: Any, progress: Progress) -> None:
    from ..output.denoise import denoised
    from ..output.image import Image
    from ..rendering.render_report import render_report

    progress.phase("write")
    image = Image(state.pixels, render_report(renderer, state) | results.header, aovs=renderer.aovs(state))
    renderer.warnings.log(state.film)
    ratio = state.noise_ratio
    if ratio is not None and not 1 / RIGHT <= ratio <= RIGHT:
        logging.getLogger(__name__).warning("the estimated error is %.2f times the error against the "
                                            "reference, which may be noisy itself", ratio)
    if denoiser is None:
        results.save(image)
    else:
        results.save(replace(image, aovs={}), raw=True)
        progress.phase("denoise")
        image = denoised(image, denoiser, guides, expected)
        results.save(image)
    results.save_measures(renderer, image)


def read_reference(path: Path, size: tuple[int, int]) -> Any:
    """Return the reference in an image file, (height, width, 3). Raises UsageError if it cannot be compared with an
    image of `size` (width, height)."""
    from ..output.images import read_image
    from ..rendering.film.state import check_reference

    pixels = read_image(path)
    height, width = pixels.shape[:2]
    if (width, height) != size:
        raise UsageError(f"{path}: the reference is {width}x{height}, the image {size[0]}x{size[1]}; "
                         f"use --size {width}x{height}")
    try:
        check_reference(pixels, size)
    except UsageError as error:
        raise UsageError(f"{path}: the {error}") from error
    return pixels
