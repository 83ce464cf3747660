"""`clrt bake`: light or ambient occlusion of a mesh to an image over its texture coordinates."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from . import PROGRAM
from .displays import make_progress
from .guard import guarded
from .interrupt import end_by_signals
from .load_options import LoadOptions
from .logs import silence, verbose_option
from .option_groups import grouped
from .option_types import OneOf, TexelSize
from .outputs import Outputs
from .progress_reporter import Progress
from .render_options import FILE


@click.command()
@click.argument("scene", type=click.Path(path_type=Path))
@click.option("--mesh", required=True, metavar="NAME", help="Mesh or instance to bake; see `clrt info`.")
@click.option(
    "-o",
    "--output",
    "outputs",
    required=True,
    multiple=True,
    type=FILE,
    metavar="FILE",
    help="Image to write: .exr or .hdr (linear), .png, .jpg, .webp or .tif; may be repeated.",
)
@click.option(
    "--what",
    type=OneOf(["irradiance", "indirect", "direct", "occlusion"]),
    default="irradiance",
    show_default=True,
    help="Irradiance, its indirect or direct part, or ambient occlusion from 0, closed, to 1, open.",
)
@click.option("--size", type=TexelSize(), default=1024, show_default=True, help="Texels: N of a square, or WxH.")
@click.option("--padding", type=click.IntRange(0), default=4, show_default=True, help="Texels repeated around charts.")
@click.option("--uv-set", type=click.IntRange(0, 1), default=0, show_default=True, help="Set of texture coordinates.")
@click.option(
    "--distance", type=float, metavar="X", help="Distance within which surfaces occlude; default: any. For occlusion."
)
@click.option("--spp", type=click.IntRange(1), help="Samples per texel; default: the scene's, or with --noise 65536.")
@click.option(
    "--noise",
    type=float,
    metavar="X",
    help="Stop when the mean standard error is this fraction of the mean, of every 65536 texels.",
)
@click.option("--depth", "max_depth", type=click.IntRange(1), help="Maximum path depth; default: the scene's.")
@click.option("--seed", type=click.IntRange(0), help="Seed of the random number generator.")
@click.option("--device", "devices", multiple=True, metavar="SEL", help="Device, see `clrt devices`; may be repeated.")
@click.option(
    "--view", metavar="NAME", help="View transform of a .png; default: srgb, or raw for occlusion; see `clrt render`."
)
@click.option("--exposure", type=float, default=0.0, metavar="EV", help="Exposure of a .png, in stops.")
@click.option("--report", type=FILE, metavar="FILE.json", help="Write a report of the bake.")
@click.option("--force", is_flag=True, help="Replace files that are read-only.")
@click.option(
    "--progress",
    "progress_kind",
    type=OneOf(["bar", "plain", "json"]),
    help="Format of the progress display on standard error; default: bar on a terminal, else plain.",
)
@click.option("-q", "--quiet", is_flag=True, help="Show no progress and no warnings.")
@grouped("loading", LoadOptions)
@verbose_option
def command(
    scene: Path,
    mesh: str,
    outputs: tuple[Path, ...],
    loading: LoadOptions,
    devices: tuple[str, ...],
    view: str | None,
    exposure: float,
    report: Path | None,
    force: bool,
    progress_kind: str | None,
    quiet: bool,
    **options: Any,
) -> None:
    """Bake the light on a mesh of SCENE, or its ambient occlusion, into an image over its texture coordinates."""
    if click.get_current_context().obj == PROGRAM:
        guarded(lambda: "")
    end_by_signals()
    from ..formats.load_scene import check_scene

    check_scene(scene)
    chosen = view or ("raw" if options["what"] == "occlusion" else "srgb")
    results = Outputs((scene,), outputs, (), False, chosen, exposure, report, None, force)
    results.check()
    results.check_unprotected()
    if quiet:
        silence()
    with make_progress(progress_kind, quiet) as progress:
        _bake(scene, mesh, loading, results, {**options, "device": devices or None}, progress)


def _bake(
    path: Path, mesh: str, loading: LoadOptions, results: Outputs, options: dict[str, Any], progress: Progress
) -> None:
    """Load the scene, bake the mesh and write the results."""
    from dataclasses import fields

    from ..baking.bake import Bake, BakeOptions
    from ..formats.referenced_files import files_read
    from ..output.image import Image

    progress.phase("load")
    with files_read() as inputs:
        content = loading.load(path)
    results.check_apart(inputs)
    names = {field.name for field in fields(BakeOptions)}
    how = BakeOptions(**{name: value for name, value in options.items() if name in names})
    tracing = {name: value for name, value in options.items() if name not in names}
    job = Bake(content, mesh, how, {**tracing, "on_phase": progress.phase})
    started = False
    for state in job.states():
        if not started:
            progress.phase("bake", device=job.meter.device_name, device_bytes=job.meter.device_bytes)
            started = True
        progress.bake(state)
    progress.phase("write")
    made = job.light_map()
    results.save_frame(Image(made.pixels, made.report))
