"""`clrt info`: the contents of a scene, its BVH, and what is compiled and uploaded for it."""

from __future__ import annotations

from collections import Counter
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .options import tracing_options

if TYPE_CHECKING:
    from ..device.open import Device


@click.command()
@click.argument("scene", type=click.Path(path_type=Path), required=False)
@click.option("--materials", "list_materials", is_flag=True, help="List all material types and presets instead.")
@click.option("--json", "as_json", is_flag=True, help="Print a JSON object.")
@click.option("--aov", "aovs", multiple=True, metavar="NAME,...", help="Include what these AOVs need.")
@click.option("--device", "selector", metavar="SEL",
              help="Device to compile for; see `clrt devices`. Default: the best, or a CPU if there is none.")
@tracing_options
def command(scene: Path | None, list_materials: bool, as_json: bool, aovs: tuple[str, ...], selector: str | None,
            **chosen: Any) -> None:
    """Show what SCENE contains and what is compiled for it, without rendering; needs no device."""
    if list_materials:
        from .material_list import material_lines

        for line in material_lines(as_json):
            click.echo(line)
        return
    if scene is None:
        raise click.UsageError("Missing argument 'SCENE'; give a scene file or a model, or --materials")
    from ..formats.load_scene import load
    from ..output.json_text import json_text
    from ..rendering.accumulation.first_hits import first_hit_program
    from ..rendering.aovs import chosen_aovs, seen_first
    from ..rendering.compile.compile_scene import compile_scene
    from ..rendering.renderer_options import choices_of
    from .scene_lists import light_texts, lights_in, material_texts, materials_in

    names = chosen_aovs(",".join(aovs)) if aovs else ()
    content = load(scene)
    choices = choices_of({**chosen, "aovs": names})
    compiled = compile_scene(content, choices, device=_device(selector))
    built = compiled.tree
    film = prod(content.render.size) * compiled.choices.pixel.itemsize
    materials = {mesh.material for mesh in content.meshes} | {sphere.material for sphere in content.spheres}
    materials |= {instance.material or instance.mesh.material for instance in content.instances}
    report: dict[str, Any] = {
        "scene": content.name, "size": "x".join(map(str, content.render.size)), "spp": content.render.spp,
        "max_depth": content.render.max_depth, "integrator": content.render.integrator,
        "meshes": len(content.meshes), "triangles": sum(len(mesh.faces) for mesh in content.meshes),
        "instances": {"entries": len(content.instances), "in_tree": compiled.instances,
                      "triangles": sum(len(instance.mesh.faces) for instance in content.instances)},
        "spheres": len(content.spheres),
        "cameras": list(content.cameras),
        "materials": dict(Counter(material.kernel for material in materials)),
        "lights": {"entries": int(compiled.counts["lights"][0]),
                   **Counter(type(light).kernel for light in content.lights)},
        "tree": {"layout": built.name, "builder": built.builder, "nodes": built.nodes, "depth": built.depth,
                 "stack": built.stack, "sah_cost": built.sah_cost, "bytes": built.bytes,
                 "build_seconds": built.build_seconds},
        "features": compiled.features, "files": compiled.files, "kernel_bytes": len(compiled.source.encode()),
        "buffers": {**{name: array.nbytes for name, (_, array) in compiled.buffers.items()}, "film": film},
        "bytes": compiled.bytes + film,
    }
    if seen := seen_first(names):
        program = first_hit_program(compiled, seen)[0]
        report["first_hit"] = {"aovs": " ".join(seen), "kernel_bytes": len(program.encode())}
    shown, emitting = materials_in(content), lights_in(content)
    if as_json:
        click.echo(json_text({**report, "material_list": shown, "light_list": emitting}))
        return
    for name, value in report.items():
        if isinstance(value, dict):
            value = "  ".join(f"{key} {_short(part)}" for key, part in value.items()) or "none"
        elif isinstance(value, list):
            value = " ".join(value) or "none"
        click.echo(f"{name:13} {_short(value)}")
    for name, lines in (("material", material_texts(shown)), ("light", light_texts(emitting))):
        for line in lines:
            click.echo(f"{name:13} {line}")


def _device(selector: str | None) -> Device | None:
    """Return the device that would render; None if there is none and none was requested."""
    from ..device.discovery.discover import find_devices
    from ..device.open import open_device

    if selector is None and not any(info.chosen for info, _ in find_devices()):
        return None
    return open_device(selector)


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else f"{value:_}" if isinstance(value, int) else str(value)
