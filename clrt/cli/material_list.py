"""`clrt info --materials`: every material type with its fields and limits, and every preset."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import fields
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from ..scene.fields.field_types import show
from ..scene.fields.limits import Characters, Ge, Gt, Le, Lt
from ..scene.materials.material import SHARED
from ..scene.materials.material_types import MATERIALS, Material
from ..scene.materials.presets import CONDUCTORS, F0_PRESETS
from ..scene.materials.textures import Texture

#: Descriptions of limits.
LIMITS = {Ge: "at least", Gt: "above", Le: "at most", Lt: "below"}


def material_list() -> dict[str, Any]:
    """Return the fields that all types share, the types, and the presets."""
    shared = _described(Material, SHARED)
    types = [
        {
            "type": kind.kernel,
            "about": (kind.__doc__ or "").split("\n")[0],
            "fields": _described(kind, {field.name for field in fields(kind)} - SHARED),
        }
        for kind in MATERIALS
    ]
    f0 = {
        name: {"f0": color, "kind": "metal" if metallic else "not a metal"}
        for name, (color, metallic) in F0_PRESETS.items()
    }
    conductors = {
        name: {"eta": eta, "k": k, "f0": tuple(map(_normal_reflectance, eta, k))}
        for name, (eta, k) in CONDUCTORS.items()
    }
    return {"every_type": shared, "types": types, "presets": {"metallic_roughness": f0, "conductor": conductors}}


def material_lines(as_json: bool) -> Iterator[str]:
    """Yield `material_list` as lines of text, or as one line of JSON."""
    found = material_list()
    if as_json:
        yield json.dumps(found)
        return
    yield from ("Every type has", *map(_field_line, found["every_type"]))
    for kind in found["types"]:
        yield from ("", f'type = "{kind["type"]}": {kind["about"]}', *map(_field_line, kind["fields"]))
    for kind_name, presets in found["presets"].items():
        yield from ("", f"Presets of {kind_name}")
        for name, values in presets.items():
            yield f"  {name:14}" + "  ".join(f"{key} {_short(value)}" for key, value in values.items())


def _normal_reflectance(eta: float, k: float) -> float:
    return round(((eta - 1) ** 2 + k * k) / ((eta + 1) ** 2 + k * k), 3)


def _described(kind: type[Material], names: set[str] | frozenset[str]) -> list[dict[str, Any]]:
    hints = get_type_hints(kind, include_extras=True)
    return [
        {"name": field.name, "values": " or ".join(_values(hints[field.name])), "default": field.default}
        for field in fields(kind)
        if field.name in names
    ]


def _values(hint: Any) -> Iterator[str]:
    """Yield descriptions of the values that a type hint allows."""
    origin, parts = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        for part in parts:
            yield from () if part is NoneType else _values(part)
    elif origin is Literal:
        yield ", ".join(parts)
    elif origin is tuple:
        number = next(_values(parts[0])).removeprefix("a number")
        yield f"{len(parts)} numbers{', each' * bool(number)}{number}"
    elif origin is Annotated and isinstance(parts[1], Characters):
        yield f"text of {parts[1].names}"
    elif origin is Annotated:
        words = {type(limit): f"{limit.bound:g}" for limit in parts[1:]}
        limits = (
            f"{words[Ge]} to {words[Le]}"
            if {Ge, Le} <= set(words)
            else " and ".join(f"{LIMITS[limit]} {bound}" for limit, bound in words.items())
        )
        yield f"a number {limits}"
    else:
        yield {bool: "true or false", str: "text", Texture: "a texture", float: "a number"}[hint]


def _field_line(field: dict[str, Any]) -> str:
    default = "none" if field["default"] is None else show(field["default"])
    return f"  {field['name']:22}{default:20}{field['values']}"


def _short(value: Any) -> str:
    return value if isinstance(value, str) else " ".join(f"{part:g}" for part in value)
