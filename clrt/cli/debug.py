"""`clrt debug`: the paths of one pixel, vertex by vertex."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from . import PROGRAM
from .guard import guarded
from .load_options import LoadOptions
from .option_types import Pixel
from .options import picture_options, tracing_options


@click.command()
@click.argument("scene", type=click.Path(path_type=Path))
@click.option(
    "--pixel", type=Pixel(), help="Column and row of the pixel; 0,0 is the upper left corner. Default: the center."
)
@click.option(
    "--samples",
    type=click.IntRange(min=0),
    default=4,
    show_default=True,
    metavar="N",
    help="Number of the pixel's samples to list, starting with the first.",
)
@click.option(
    "--spp",
    type=click.IntRange(min=1),
    help="Samples per pixel of the render; all are traced for the summary. Default: the scene's.",
)
@click.option("--device", metavar="SEL", help="Device: number, id, part of a name, cpu or gpu; see `clrt devices`.")
@click.option("--json", "as_json", is_flag=True, help="Print a JSON object.")
@picture_options
@tracing_options
def command(
    scene: Path,
    pixel: tuple[int, int] | None,
    samples: int,
    device: str | None,
    as_json: bool,
    loading: LoadOptions,
    **given: Any,
) -> None:
    """Show the light paths of one pixel of SCENE, and why it is black or where its light comes from. With the options
    of a render, the samples are exactly those of that render."""
    if click.get_current_context().obj == PROGRAM:
        guarded(lambda: "")
    from ..debug.names import SceneNames
    from ..debug.summary import summary
    from ..debug.text import path_lines
    from ..debug.trace import trace_pixel
    from ..debug.vertices import vertices
    from ..device.open import open_device
    from ..output.json_text import json_text
    from ..rendering.renderer_options import choices_of, settings_of
    from ..scene.on_ground import on_ground

    content = loading.load(scene, size=given.get("size"))
    content.render = settings = settings_of(content.render, given)
    content = on_ground(content)
    pixel = pixel or (settings.size[0] // 2, settings.size[1] // 2)
    paths = trace_pixel(content, open_device(device), pixel, choices_of(given))
    names = SceneNames(content, paths.compiled)
    found = summary(paths, names)
    listed = [(i, paths.values[i].tolist(), list(vertices(paths, names, i))) for i in range(min(samples, settings.spp))]
    if as_json:
        answer = {
            "scene": content.name,
            "pixel": pixel,
            "size": settings.size,
            "integrator": settings.integrator,
            "max_depth": settings.max_depth,
            "seed": settings.seed,
            "spp": settings.spp,
            "value": paths.value.tolist(),
            "dropped": settings.spp - int(paths.kept.sum()),
            "summary": found,
            "samples": [
                {"sample": i, "value": value, "vertices": [asdict(each) for each in path]} for i, value, path in listed
            ],
        }
        click.echo(json_text(answer))
        return
    for i, value, path in listed:
        click.echo("\n".join([*path_lines(i, value, path), ""]))
    click.echo(f"pixel {pixel[0]},{pixel[1]} of {content.name}, {settings.spp} samples: {found}")
