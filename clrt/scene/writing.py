"""Write a bare model as a scene file to start from: the same picture, with all that a user may want to change."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import fields
from typing import Any

import numpy as np

from .instancing import meshes_by_id
from .materials import Material
from .model import Scene
from .sky import default_sky

#: Fields that are written even where they have their default, since they are what a user changes first.
TELLING = {"position", "look_at", "fov_degrees", "size", "spp", "max_depth", "color", "metallic", "roughness"}
#: What the scene file calls the one material of a file that has no names for its own.
UNNAMED = "model"


def scene_text(scene: Scene, file: str) -> str:
    """The scene file of a model that was loaded from `file`, as the scene file is to name it.

    Its materials are written by the names that the file gives them. Those that the scene file cannot say, such as
    textures inside the model, and names that stand for several, stay the model's own.
    """
    return "\n".join(_lines(scene, file)) + "\n"


def _lines(scene: Scene, file: str) -> Iterator[str]:
    yield f"# {file.encode('unicode_escape').decode()} as clrt shows it; change what you like (docs/scene-format.md)."
    yield from _section("[camera]", scene.camera)
    for name, camera in scene.cameras.items():
        if camera != scene.camera:
            yield f"# or, instead of the lines above: name = {_value(name)}"
    yield from _section("[render]", scene.render)
    yield from ("", "[environment]", 'sky = "default"') if _has_default_sky(scene) else ()
    for light in scene.lights:
        yield from _section("[[light]]", light, light.kernel)
    materials, kept = _materials(scene)
    for name, material in materials.items():
        yield from _section(f"[materials.{_key(name or UNNAMED)}]", material, material.kernel)
    yield from ("", "[[mesh]]", f"file = {_value(file)}")
    if list(materials) == [""] and not kept:
        yield f"material = {_value(UNNAMED)}"
    elif materials:
        yield from ("", "[mesh.materials]  # the file's name = the one above")
        yield from (f"{_key(name)} = {_value(name or UNNAMED)}" for name in materials)
    if kept:
        yield f"# The file's own: {', '.join(map(_value, kept))}"


def _has_default_sky(scene: Scene) -> bool:
    image = default_sky().image
    return image is not None and scene.environment.image is not None and np.array_equal(image, scene.environment.image)


def _materials(scene: Scene) -> tuple[dict[str, Material], list[str]]:
    """By the file's names the materials that can be written, and the other names."""
    named: dict[str, set[Material]] = {}
    for mesh in (*scene.meshes, *meshes_by_id(scene.instances).values()):
        named.setdefault(mesh.material_name, set()).add(mesh.material)
    clear = {name: next(iter(same)) for name, same in named.items()
             if len(same) == 1 and all(map(_is_plain, same)) and not (name == UNNAMED and "" in named)}
    return clear, [name for name in named if name not in clear]


def _is_plain(material: Material) -> bool:
    """Whether the scene file can say all of a material."""
    return all(isinstance(getattr(material, field.name), bool | int | float | str | tuple | None)
               for field in fields(material))


def _section(title: str, record: Any, kind: str | None = None) -> Iterator[str]:
    """A table of a dataclass's fields, without those of no interest."""
    yield from ("", title)
    if kind is not None:
        yield f"type = {_value(kind)}"
    for field in fields(record):
        value = getattr(record, field.name)
        if value is not None and (field.name in TELLING or value != field.default):
            yield f"{field.name} = {_value(value)}"


def _value(value: bool | int | float | str | tuple[Any, ...]) -> str:
    """As TOML writes it; numbers to the last digit."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, bool):
        return str(value).lower()
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f") if isinstance(value, str) else repr(value)


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _value(name)
