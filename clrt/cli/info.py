"""`clrt info`: the contents of a scene, its BVH, and what is compiled and uploaded for it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .load_options import LoadOptions
from .option_groups import grouped
from .options import tracing_options

if TYPE_CHECKING:
    from ..device.open import Device


@click.command()
@click.argument("scene", type=click.Path(path_type=Path), required=False)
@click.option("--materials", "list_materials", is_flag=True, help="List all material types and presets instead.")
@click.option("--json", "as_json", is_flag=True, help="Print a JSON object.")
@click.option("--aov", "aovs", multiple=True, metavar="NAME,...", help="Include what these AOVs need.")
@click.option(
    "--device",
    "selector",
    metavar="SEL",
    help="Device to compile for; see `clrt devices`. Default: the best, or a CPU if there is none.",
)
@grouped("loading", LoadOptions)
@tracing_options
def command(
    scene: Path | None,
    list_materials: bool,
    as_json: bool,
    aovs: tuple[str, ...],
    selector: str | None,
    loading: LoadOptions,
    **chosen: Any,
) -> None:
    """Show what SCENE contains and what is compiled for it, without rendering; needs no device."""
    if list_materials:
        from .material_list import material_lines

        for line in material_lines(as_json):
            click.echo(line)
        return
    if scene is None:
        raise click.UsageError("Missing argument 'SCENE'; give a scene file or a model, or --materials")
    from ..output.json_text import json_text
    from ..rendering.aovs import chosen_aovs
    from ..rendering.compile.compile_scene import compile_scene
    from ..rendering.renderer_options import choices_of
    from ..scene.on_ground import on_ground
    from .scene_lists import lights_in, materials_in, meshes_in
    from .scene_report import report_lines, scene_report

    names = chosen_aovs(",".join(aovs)) if aovs else ()
    content = loading.load(scene)
    choices = choices_of({**chosen, "aovs": names})
    compiled = compile_scene(on_ground(content), choices, device=_device(selector))
    report = {
        **scene_report(content, compiled, names),
        "mesh_list": meshes_in(content),
        "material_list": materials_in(content),
        "light_list": lights_in(content),
    }
    for line in [json_text(report)] if as_json else report_lines(report):
        click.echo(line)


def _device(selector: str | None) -> Device | None:
    """Return the device that would render; None if there is none and none was requested."""
    from ..device.discovery.discover import find_devices
    from ..device.open import open_device

    if selector is None and not any(info.chosen for info, _ in find_devices()):
        return None
    return open_device(selector)
