"""Meshes, materials and lights of a scene by name, for `clrt info`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from typing import Any

from ..scene.editing import materials_of
from ..scene.light_images import LightImage
from ..scene.lights import Light
from ..scene.materials.material import Material
from ..scene.materials.textures import Texture
from ..scene.model import Environment, Instance, Mesh, Scene, Sphere
from ..scene.provenance import material_of
from ..scene.sky.sky import SkyEnvironment

#: Most lines per list; --json has all.
MOST = 40
#: The field with the light group of an emitter.
GROUP = "light_group"


def meshes_in(scene: Scene) -> list[dict[str, Any]]:
    """Return each mesh's name, triangles and sets of texture coordinates, also of meshes that instances show."""
    distinct = {id(mesh): mesh for mesh in (*scene.meshes, *(each.mesh for each in scene.instances))}
    return [
        {
            "name": mesh.name,
            "triangles": len(mesh.faces),
            "uv_sets": sum(coordinates is not None for coordinates in (mesh.uv, mesh.uv1)),
        }
        for mesh in distinct.values()
    ]


def materials_in(scene: Scene) -> list[dict[str, Any]]:
    """Return each material's name, type, and the fields that differ from their defaults, textures apart."""
    rows = []
    for name, material in materials_of(scene).items():
        given = {
            each.name: getattr(material, each.name)
            for each in fields(material)
            if getattr(material, each.name) != each.default
        }
        textured = [field for field, value in given.items() if isinstance(value, Texture)]
        rows.append(
            {
                "name": name,
                "type": material.kernel,
                "set": [each for each in given if each not in textured],
                "textured": textured,
            }
        )
    return rows


def lights_in(scene: Scene) -> list[dict[str, Any]]:
    """Return the scene's lights, its environment unless black, and each emissive object with its radiance."""
    rows = [
        {
            "type": light.kernel,
            **{each.name: _shown(getattr(light, each.name)) for each in fields(light) if each.name != GROUP},
            **_group(light),
        }
        for light in scene.lights
    ]
    rows += _environment(scene.environment)
    objects: list[Mesh | Instance | Sphere] = [*scene.meshes, *scene.instances, *scene.spheres]
    for each in objects:
        material = each.material if isinstance(each, Sphere) else material_of(each)
        if any(material.radiance):
            kind = type(each).__name__.lower()
            rows.append({"type": kind, "name": each.name, "radiance": material.radiance, **_group(material)})
    return rows


def _group(emitter: Light | Environment | Material) -> dict[str, str]:
    """Return the light group of an emitter, if it has one."""
    return {GROUP: emitter.light_group} if emitter.light_group else {}


def _shown(value: Any) -> Any:
    """Return a light's field, for an image its name and size."""
    if not isinstance(value, LightImage):
        return value
    height, width = value.pixels.shape[:2]
    return f"{value.name} ({width}x{height})"


def _environment(sky: Environment) -> Iterator[dict[str, Any]]:
    if isinstance(sky, SkyEnvironment):
        elevation, azimuth = (round(angle, 2) for angle in sky.sky.position)
        yield {
            "type": "sky",
            "sun_elevation_degrees": elevation,
            "sun_azimuth_degrees": azimuth,
            "turbidity": sky.sky.turbidity,
            "strength": sky.strength * sky.sky.sky_strength,
            **_group(sky),
        }
    elif sky.image is not None and sky.strength:
        height, width = sky.image.shape[:2]
        yield {"type": "environment map", "size": f"{width}x{height}", "strength": sky.strength, **_group(sky)}
    elif sky.image is None and any(sky.color) and sky.strength:
        yield {"type": "environment", "color": sky.color, "strength": sky.strength, **_group(sky)}


def mesh_texts(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the lines for `meshes_in`."""
    coordinates = ("no texture coordinates", "texture coordinates", "two sets of texture coordinates")
    return _lines(f'"{row["name"]}": {row["triangles"]:_} triangles, {coordinates[row["uv_sets"]]}' for row in rows)


def material_texts(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the lines for `materials_in`."""
    return _lines(
        f'"{row["name"]}": ' + ", ".join([row["type"], *row["set"], *(f"{name} (texture)" for name in row["textured"])])
        for row in rows
    )


def light_texts(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the lines for `lights_in`."""
    return _lines(
        row["type"]
        + (f' "{row["name"]}": ' if "name" in row else ": ")
        + ", ".join(
            f"{key} {_text(value)}" for key, value in row.items() if key not in ("type", "name") and value is not None
        )
        for row in rows
    )


def _lines(texts: Iterable[str]) -> list[str]:
    """Return each text once, with how often it occurs, and the number of those that exceed MOST."""
    lines = [text if number == 1 else f"{text} ({number} of these)" for text, number in Counter(texts).items()]
    return lines[:MOST] + [f"and {len(lines) - MOST} more; --json lists all"] * (len(lines) > MOST)


def _text(value: Any) -> str:
    if isinstance(value, tuple):
        return " ".join(map(_text, value))
    return f"{value:.4g}" if isinstance(value, float) else str(value)
