"""Animated properties other than those of nodes, named by JSON pointers (Khronos, KHR_animation_pointer)."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from ...errors import SceneError
from . import schema as gltf
from .material_schema import Part

#: Supported pointers.
POINTERS = re.compile(
    r"/nodes/\d+/(extensions/KHR_node_visibility/visible|weights/\d+)"
    r"|/meshes/\d+/weights(/\d+)?"
    r"|/cameras/\d+/(perspective/yfov|orthographic/ymag)"
    r"|/extensions/KHR_lights_punctual/lights/\d+/(color|intensity|range|spot/(inner|outer)ConeAngle)"
    r"|/materials/\d+/(emissiveFactor|alphaCutoff|pbrMetallicRoughness/(baseColor|metallic|roughness)Factor)"
    r"|/materials/\d+/extensions/KHR_materials_\w+/\w*(Factor|Strength|Rotation|Roughness|Ior|ior|Minimum|Maximum)"
    r"|/materials/\d+/(\w+/)*\w+Texture/extensions/KHR_texture_transform/(offset|rotation|scale)"
)
#: Pointers to what channels of nodes animate, too.
NODE = re.compile(r"/nodes/(\d+)/(translation|rotation|scale|weights)")
#: Types of accessors by the number of a property's components.
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}


def kind_of(document: gltf.Document, pointer: str) -> tuple[str, int] | None:
    """Return the accessor type of a property's values, and how many make one value; None for what is not supported."""
    if not POINTERS.fullmatch(pointer):
        return None
    value: Any = document
    for key in _keys(pointer):
        try:
            value = value[int(key)] if isinstance(value, list) else getattr(value, key)
        except (LookupError, AttributeError, ValueError):
            return None
    if isinstance(value, list):
        return "SCALAR", len(value)
    size = len(value) if isinstance(value, tuple) else 1
    return (KINDS[size], 1) if isinstance(value, float | bool | tuple) else None


def with_value(document: gltf.Document, pointer: str, value: NDArray[np.float64]) -> gltf.Document:
    """Return the document with another value of a property. Raises SceneError for one that the property cannot have."""
    try:
        changed: gltf.Document = _changed(document, _keys(pointer), value)
    except ValidationError as error:
        shown = ", ".join(f"{each:g}" for each in value)
        raise SceneError(f"{pointer} becomes {shown}: {error.errors()[0]['msg']}; export the file again") from None
    return changed


def _changed(part: Any, keys: list[str], value: NDArray[np.float64]) -> Any:
    """Return a copy of a part in which the property below it has the value."""
    if not keys:
        if isinstance(part, bool):
            return bool(value[0])
        return value.tolist() if isinstance(part, tuple | list) else float(value[0])
    key, *rest = keys
    if isinstance(part, list):
        return [_changed(each, rest, value) if number == int(key) else each for number, each in enumerate(part)]
    assert isinstance(part, Part)
    below = getattr(part, key)
    new = _changed(below, rest, value)
    return part.model_copy(update={key: new if isinstance(new, Part) else _checked(part, key, new)})


def _checked(part: Part, key: str, value: Any) -> Any:
    """Return the value as the property has it. Raises ValidationError if it is not among the property's values."""
    if isinstance(value, list) and value and isinstance(value[0], Part):
        return value
    fresh = type(part).model_validate({**part.model_dump(), key: value})
    return getattr(fresh, key)


def _keys(pointer: str) -> list[str]:
    return pointer.split("/")[1:]
