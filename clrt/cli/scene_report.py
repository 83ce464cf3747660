"""What `clrt info` reports: the contents of a scene, its BVH, and what is compiled and uploaded for it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from math import prod
from typing import Any

from ..rendering.accumulation.first_hits import first_hit_program
from ..rendering.aovs import seen_first
from ..rendering.compile.compile_scene import CompiledScene
from ..scene.model import Scene
from .scene_lists import light_texts, material_texts, mesh_texts


def scene_report(scene: Scene, compiled: CompiledScene, aovs: Collection[str]) -> dict[str, Any]:
    """Return the report of a scene, compiled for a render with these AOVs."""
    return {**_contents(scene, compiled), "tree": _tree(compiled), **_program(scene, compiled, aovs)}


def _contents(scene: Scene, compiled: CompiledScene) -> dict[str, Any]:
    settings = scene.render
    materials = {mesh.material for mesh in scene.meshes} | {sphere.material for sphere in scene.spheres}
    materials |= {instance.material or instance.mesh.material for instance in scene.instances}
    return {
        "scene": scene.name,
        "size": "x".join(map(str, settings.size)),
        "spp": settings.spp,
        "max_depth": settings.max_depth,
        "integrator": settings.integrator,
        "meshes": len(scene.meshes),
        "triangles": sum(len(mesh.faces) for mesh in scene.meshes),
        "instances": {
            "entries": len(scene.instances),
            "in_tree": compiled.instances,
            "triangles": sum(len(instance.mesh.faces) for instance in scene.instances),
        },
        "spheres": len(scene.spheres),
        "cameras": list(scene.cameras),
        **{kind: list(names) for kind, names in (scene.source.contents if scene.source else {}).items()},
        "materials": dict(Counter(material.kernel for material in materials)),
        "lights": {
            "entries": int(compiled.counts["lights"][0]),
            **Counter(type(light).kernel for light in scene.lights),
        },
    }


def _tree(compiled: CompiledScene) -> dict[str, Any]:
    built = compiled.tree
    return {
        "layout": built.name,
        "builder": built.builder,
        "nodes": built.nodes,
        "depth": built.depth,
        "stack": built.stack,
        "sah_cost": built.sah_cost,
        "bytes": built.bytes,
        "build_seconds": built.build_seconds,
    }


def _program(scene: Scene, compiled: CompiledScene, aovs: Collection[str]) -> dict[str, Any]:
    film = prod(scene.render.size) * compiled.pixel.itemsize
    report: dict[str, Any] = {
        "features": compiled.features,
        "files": compiled.files,
        "kernel_bytes": len(compiled.source.encode()),
        "buffers": {**{name: array.nbytes for name, (_, array) in compiled.buffers.items()}, "film": film},
        "bytes": compiled.bytes + film,
    }
    if seen := seen_first(aovs):
        program = first_hit_program(compiled, seen)[0]
        report["first_hit"] = {"aovs": " ".join(seen), "kernel_bytes": len(program.encode())}
    return report


def report_lines(report: Mapping[str, Any]) -> Iterator[str]:
    """Yield the lines of a report with the lists `mesh_list`, `material_list` and `light_list`."""
    for name, value in report.items():
        if name in ("mesh_list", "material_list", "light_list"):
            continue
        if isinstance(value, dict):
            value = "  ".join(f"{key} {_short(part)}" for key, part in value.items()) or "none"
        elif isinstance(value, list):
            value = ("; " if name == "left_out" else " ").join(value) or "none"
        yield f"{name:13} {_short(value)}"
    yield from (f"{'mesh':13} {line}" for line in mesh_texts(report["mesh_list"]))
    yield from (f"{'material':13} {line}" for line in material_texts(report["material_list"]))
    yield from (f"{'light':13} {line}" for line in light_texts(report["light_list"]))


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else f"{value:_}" if isinstance(value, int) else str(value)
