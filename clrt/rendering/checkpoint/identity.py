"""Identity of an image: facts by name, which two renders must share for one to resume the other.

These are all fields of the scene, its settings and the choices, except for those listed here, so that new fields are
included automatically. Excluded are names, contents of a scene that are not visible, stop conditions, and what affects
only rounding (lanes and BVHs; also the device).
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from ...device.programs.kernel_files import kernel_digest
from ...scene.geometry.instancing import prototypes
from ...scene.model import Environment, RenderSettings, Scene
from ..compile.choices import Choices
from ..compile.visible_parts import visible_parts

#: Fields excluded from a scene's settings, from Choices, and from everything in a scene.
ENDS = {"spp", "error"}
ROUNDING = {"lanes", "layout", "builder", "paths", "tree", "first_hits"}
NAMES = {"name", "material_name"}
#: Folders whose Python code determines samples: how scenes are packed, what is sampled and summed. (What the readers
#: of files return is part of the scene, but textures are decoded when they are packed.)
CODE = ("rendering", "scene", "formats/images")


@cache
def code_digest(package: Path = Path(__file__).parents[2]) -> str:
    """Return the SHA-256 of the names and texts of the Python files in CODE, as 64 hexadecimal digits.

    The version changes with releases alone, and the scene's hash is the same however it is packed. A digest of the text
    refuses more checkpoints than necessary, after any edit of these files, but cannot be forgotten.
    """
    digest = hashlib.sha256()
    for path in sorted(path for folder in CODE for path in (package / folder).rglob("*.py")):
        text = path.read_bytes()
        digest.update(f"{path.relative_to(package).as_posix()}\0{len(text)}\0".encode() + text)
    return digest.hexdigest()


def facts_of(scene: Scene, choices: Choices) -> dict[str, str]:
    """Return each setting as text, and the SHA-256 of each part of the scene, of the kernels and of the code."""
    width, height = scene.render.size
    values = {**values_of(scene.render, choices), "size": f"{width}x{height}"}
    return {
        "version": version("clrt"),
        "kernels": kernel_digest(),
        "code": code_digest(),
        **{name: str(value) for name, value in values.items()},
        **{part: _digest(_part(scene, part)) for part in visible_parts(scene)},
    }


def values_of(settings: RenderSettings, choices: Choices) -> dict[str, Any]:
    """Return the settings and choices that determine an image, by name; hit tests one by one."""
    values = {field.name: getattr(settings, field.name) for field in fields(settings) if field.name not in ENDS}
    for field in fields(choices):
        value = getattr(choices, field.name)
        if is_dataclass(value):
            values |= {each.name: getattr(value, each.name) for each in fields(value)}
        elif field.name not in ROUNDING:
            values[field.name] = value
    return values


def scene_hash(scene: Scene) -> str:
    """Return the SHA-256 of everything that emits, reflects or is visible in the scene."""
    return _digest([_part(scene, part) for part in visible_parts(scene)])


def differences(found: dict[str, Any], wanted: dict[str, str]) -> list[str]:
    """Return the differences between two renders' facts, each in a few words, settings with both values."""
    told = []
    for name in {**wanted, **found}:
        if (other := found.get(name)) == (value := wanted.get(name)):
            continue
        if name == "direct_light":
            told.append(f"{'without' if value == 'True' else 'with'} --aov direct or indirect")
        elif name == "light_groups":
            told.append(f"{'without' if value == 'True' else 'with'} --aov light_groups")
        else:
            hidden = name in ("kernels", "code") or name in {field.name for field in fields(Scene)}
            told.append(f"different {name}" if hidden else f"{name} {other} instead of {value}")
    return told


def _part(scene: Scene, name: str) -> object:
    """Return a part of the scene: for instances each mesh once, and the transforms; for an environment what it emits,
    without the parameters of a sky."""
    if name == "environment":
        return Environment(**{each.name: getattr(scene.environment, each.name) for each in fields(Environment)})
    if name != "instances":
        return getattr(scene, name)
    meshes, which = prototypes(scene.instances)
    return (
        meshes,
        which,
        [
            (each.to_world, each.to_world_end, each.pivot, each.material or each.mesh.material)
            for each in scene.instances
        ],
    )


def _digest(value: object) -> str:
    digest = hashlib.sha256()
    for piece in _pieces(value):
        digest.update(piece)
    return digest.hexdigest()


def _pieces(value: object) -> Iterator[bytes | memoryview]:
    """Yield bytes that identify `value` uniquely: of an array with its dtype and shape, of numbers as floats."""
    match value:
        case np.ndarray():
            yield f"{value.dtype.str}{value.shape}".encode()
            yield np.ascontiguousarray(value).reshape(-1).view(np.uint8).data
        case list() | tuple():
            yield f"[{len(value)}".encode()
            for item in value:
                yield from _pieces(item)
        case int() | float() | np.number():
            yield f"{float(value)!r},".encode()
        case None | str():
            yield f"{value!r},".encode()
        case dict():
            yield from _pieces([[name, value[name]] for name in sorted(value)])
        case _ if is_dataclass(value):
            yield f"{type(value).__name__}:".encode()
            for field in fields(value):
                if field.name not in NAMES:
                    yield f"{field.name}=".encode()
                    yield from _pieces(getattr(value, field.name))
        case _:
            raise TypeError(f"a {type(value).__name__} in a scene, whose content is not known")
