"""What makes a picture the one it is: facts by name, which two renders must share if one is to go on with the other.

These are all fields of the scene, its settings and the choices but those that are named here, so what is added later
counts by itself: names, what a scene holds beside what is seen, where to stop, and what changes no more than rounding
(lanes and trees; the device, too).
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from importlib.metadata import version
from typing import Any

import numpy as np

from ..device.sources import kernel_digest
from ..scene.instancing import prototypes
from ..scene.model import RenderSettings, Scene
from .choices import Choices

#: What is left out of a Scene, of its settings, of Choices, and of all that is in a scene.
UNSEEN = {"name", "render", "cameras", "animation", "materials", "source"}
ENDS = {"spp"}
ROUNDING = {"lanes", "layout", "builder", "paths", "tree", "first_hits"}
NAMES = {"name", "material_name"}


def facts_of(scene: Scene, choices: Choices) -> dict[str, str]:
    """Each setting as text, each part of the scene and the kernels as the SHA-256 of what they are."""
    width, height = scene.render.size
    values = {**values_of(scene.render, choices), "size": f"{width}x{height}"}
    return {"version": version("clrt"), "kernels": kernel_digest(),
            **{name: str(value) for name, value in values.items()},
            **{part: _digest(_part(scene, part)) for part in parts_of(scene)}}


def values_of(settings: RenderSettings, choices: Choices) -> dict[str, Any]:
    """The settings and choices that make a picture, by name; of the hit tests each."""
    values = {field.name: getattr(settings, field.name) for field in fields(settings) if field.name not in ENDS}
    for field in fields(choices):
        value = getattr(choices, field.name)
        if is_dataclass(value):
            values |= {each.name: getattr(value, each.name) for each in fields(value)}
        elif field.name not in ROUNDING:
            values[field.name] = value
    return values


def parts_of(scene: Scene) -> list[str]:
    """The names of what is seen of a scene."""
    return [field.name for field in fields(scene) if field.name not in UNSEEN]


def scene_hash(scene: Scene) -> str:
    """SHA-256 of all that shines, reflects or is seen in the scene."""
    return _digest([_part(scene, part) for part in parts_of(scene)])


def differences(found: dict[str, Any], wanted: dict[str, str]) -> list[str]:
    """What differs between two renders' facts, each in a few words, settings with both values."""
    told = []
    for name in {**wanted, **found}:
        if (other := found.get(name)) == (value := wanted.get(name)):
            continue
        if name == "direct_light":
            told.append(f"{'without' if value == 'True' else 'with'} --aov direct or indirect")
        else:
            hidden = name == "kernels" or name in {field.name for field in fields(Scene)}
            told.append(f"other {name}" if hidden else f"{name} {other} instead of {value}")
    return told


def _part(scene: Scene, name: str) -> object:
    """A part of the scene; of instances their meshes once each, and where those stand."""
    if name != "instances":
        return getattr(scene, name)
    meshes, which = prototypes(scene.instances)
    return meshes, which, [(each.to_world, each.material or each.mesh.material) for each in scene.instances]


def _digest(value: object) -> str:
    digest = hashlib.sha256()
    for piece in _pieces(value):
        digest.update(piece)
    return digest.hexdigest()


def _pieces(value: object) -> Iterator[bytes | memoryview]:
    """Bytes that tell `value` from any other: an array's with its type and shape, numbers as floats."""
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
