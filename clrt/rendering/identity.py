"""What makes a picture the one it is: facts by name, which two renders must share if one is to go on with the other.

Of the scene all that shines, reflects or is seen, but no names; of the settings all but where to stop. What changes no
more than rounding is left out: the device, how many lanes it has, and its trees.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import asdict, fields, is_dataclass
from importlib.metadata import version
from typing import Any

import numpy as np

from ..device.sources import kernel_digest
from ..scene.instancing import prototypes
from ..scene.model import Scene
from .choices import Choices

PARTS = ("camera", "meshes", "instances", "spheres", "lights", "environment")
#: Of those in RenderSettings, beside the size.
SETTINGS = ("max_depth", "seed", "integrator", "shadows", "sampler", "filter", "adaptive", "back_face_culling",
            "clamp_direct", "clamp_indirect")


def facts_of(scene: Scene, choices: Choices) -> dict[str, str]:
    """Each setting as text, each part of the scene and the kernels as the SHA-256 of what they are."""
    settings = {name: getattr(scene.render, name) for name in SETTINGS} | asdict(choices.tests)
    width, height = scene.render.size
    return {"version": version("clrt"), "kernels": kernel_digest(), "size": f"{width}x{height}",
            **{name: str(value) for name, value in settings.items()}, "offset": choices.offset,
            "direct_light": str(choices.direct_light),
            **{part: _digest(_part(scene, part)) for part in PARTS}}


def scene_hash(scene: Scene) -> str:
    """SHA-256 of all that shines, reflects or is seen in the scene."""
    return _digest([_part(scene, part) for part in PARTS])


def differences(found: dict[str, Any], wanted: dict[str, str]) -> list[str]:
    """What differs between two renders' facts, each in a few words, settings with both values."""
    told = []
    for name, value in wanted.items():
        if (other := found.get(name)) == value:
            continue
        if name == "direct_light":
            told.append(f"{'without' if value == 'True' else 'with'} --aov direct or indirect")
        else:
            hidden = name in (*PARTS, "kernels")
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
        case _ if is_dataclass(value):
            yield f"{type(value).__name__}:".encode()
            for field in fields(value):
                if field.name not in ("name", "material_name"):
                    yield f"{field.name}=".encode()
                    yield from _pieces(getattr(value, field.name))
        case _:
            yield f"{value!r},".encode()
