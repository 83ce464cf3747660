"""Check plain values against a dataclass's field types and say in words what is wrong with them.

The scene file and scenes built in Python pass through here, so both meet the same limits and the same sentences.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import MISSING, asdict, fields
from functools import lru_cache
from types import NoneType
from typing import TYPE_CHECKING, Annotated, Any, Literal, cast, get_args, get_origin, get_type_hints

import numpy as np

if TYPE_CHECKING:
    from pydantic_core import CoreSchema, ErrorDetails, SchemaValidator

#: Fields whose values are no plain data; whoever holds them checks them.
ELSEWHERE = frozenset({"image", "material"})
#: Words of the scene format that this version knows but cannot draw yet.
LATER = frozenset({"aperture_radius", "focus_distance", "projection", "instance", "phong", "blinn_phong", "local",
                   "raster"})
FLOAT32_MAX = float(np.finfo(np.float32).max)
#: More mistakes than this in one object are counted, not listed.
MOST = 12


def field_problems(kind: type, values: Mapping[str, Any], where: str) -> list[str]:
    """What is wrong with `values` as the fields of the dataclass `kind`: one "where.field: value ..." a mistake.

    Finds missing and unknown fields, wrong types, values outside the limits of the type, and numbers that float32
    cannot hold (NaN, Inf and beyond). Numbers may be numpy scalars; sequences must be tuples.
    """
    from pydantic_core import ValidationError

    plain = {name: _plain(value) for name, value in values.items()}
    try:
        _validator(kind).validate_python(plain)
    except ValidationError as error:
        details = error.errors(include_url=False)
        problems = list(dict(_sentence(kind, where, detail) for detail in details).values())
        more = [f"{where}: {len(problems) - MOST} more mistakes like these"] if len(problems) > MOST else []
        return problems[:MOST] + more
    return [f"{where}.{name}: {show(value)} is beyond the range of float32; write a smaller number"
            for name, value in plain.items() if _too_large(value)]


def unknown(name: object, known: Iterable[str]) -> str:
    """What to say after a name that is not among the `known` ones, with the nearest of them."""
    import difflib

    known = sorted(known)
    near = difflib.get_close_matches(str(name), known, 1) or [word for word in known if word.startswith(f"{name}_")]
    if str(name) in LATER:
        return f"is not supported yet; this version knows {', '.join(known)}"
    if near:
        return f'is unknown; did you mean "{near[0]}"?'
    return f"is unknown; write one of {', '.join(known)}" if known else "is unknown; none is defined"


def show(value: object) -> str:
    """A value as the scene file would write it, shortened."""
    if isinstance(value, str):
        text = f'"{value}"'
    elif isinstance(value, bool):
        text = str(value).lower()
    elif isinstance(value, tuple):
        text = f"[{', '.join(show(entry) for entry in value[:20])}]"
    elif isinstance(value, dict):
        text = f"{{ {', '.join(f'{key} = {show(entry)}' for key, entry in value.items())} }}"
    else:
        text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


@lru_cache
def _validator(kind: type) -> SchemaValidator:
    """What checks the fields of the dataclass `kind`: strict, closed, finite.

    It is made without pydantic's models, whose import takes longer than all else that reads a small scene.
    """
    from pydantic_core import SchemaValidator, core_schema

    hints = get_type_hints(kind, include_extras=True)
    columns = {field.name: core_schema.typed_dict_field(
        core_schema.any_schema() if field.name in ELSEWHERE else _schema(hints[field.name]),
        required=not _optional(field)) for field in fields(kind)}
    config = core_schema.CoreConfig(strict=True, allow_inf_nan=False)
    return SchemaValidator(core_schema.typed_dict_schema(columns, extra_behavior="forbid", config=config))


def _schema(hint: Any) -> CoreSchema:
    """pydantic's schema of a type: a number, text, words, a tuple, one of these within limits, or one of these or None.
    """
    from pydantic_core import core_schema

    origin, parts = get_origin(hint), get_args(hint)
    if origin is Annotated:
        schema: Any = dict(_schema(parts[0]))
        for limit in parts[1:]:
            schema |= asdict(limit)
        return cast("CoreSchema", schema)
    if origin is Literal:
        return core_schema.literal_schema(list(parts))
    if origin is tuple:
        several = parts[-1] is ...
        return core_schema.tuple_schema([_schema(part) for part in parts if part is not ...],
                                        variadic_item_index=0 if several else None)
    if NoneType in parts:
        return core_schema.nullable_schema(_schema(parts[0]))
    return _PLAIN[hint]


_PLAIN: dict[type, CoreSchema] = {float: {"type": "float"}, int: {"type": "int"}, str: {"type": "str"},
                                  bool: {"type": "bool"}}


def _optional(field: Any) -> bool:
    return field.default is not MISSING or field.default_factory is not MISSING


def _plain(value: Any) -> Any:
    """Numpy scalars as Python's, through tuples."""
    if isinstance(value, tuple):
        return tuple(map(_plain, value))
    return value.item() if isinstance(value, np.generic) else value


def _too_large(value: Any) -> bool:
    if isinstance(value, tuple):
        return any(map(_too_large, value))
    return isinstance(value, float) and abs(value) > FLOAT32_MAX


def _sentence(kind: type, where: str, error: ErrorDetails) -> tuple[str, str]:
    """One mistake that pydantic found: the path of the value, and "path: value is ...; remedy"."""
    field, *entries = error["loc"]
    value, fault = error["input"], error["type"]
    if fault == "extra_forbidden":
        return f"{where}.{field}", f'{where}: key "{field}" {unknown(field, [f.name for f in fields(kind)])}'
    if fault == "missing" and not entries:
        return f"{where}.{field}", f"{where}: {field} is missing; add it"
    wanted = error.get("ctx", {}).get("max_length")
    if fault == "missing":  # one of a tuple's entries; the last one says how many it should have
        wanted = int(entries.pop()) + 1
    path = f"{where}.{field}" + "".join(f"[{entry}]" for entry in entries)
    if wanted is not None:
        return path, f"{path}: {show(value)} has {len(value)} entries; write {wanted}"
    if fault == "literal_error":
        return path, f"{path}: {show(value)} {unknown(value, _choices(kind, str(field)))}"
    return path, f"{path}: {show(value)} {_fault(error)}"


def _choices(kind: type, field: str) -> list[str]:
    """The words that a field of the type Literal, or Literal | None, may hold."""
    hint = get_type_hints(kind)[field]
    return [word for part in (hint, *get_args(hint)) if get_origin(part) is Literal for word in get_args(part)]


def _fault(error: ErrorDetails) -> str:
    """What is wrong with one value, and the remedy."""
    fault, value, limits = error["type"], error["input"], error.get("ctx", {})
    if fault in _LIMITS:
        name, is_wrong, remedy = _LIMITS[fault]
        limit = f"{limits[name]:g}"
        return f"{is_wrong} {limit}; {remedy} {limit}"
    if fault == "tuple_type" and isinstance(value, dict) and "image" in value:
        return "is a texture, which is not supported yet; write [red, green, blue]"
    if fault == "tuple_type" and isinstance(value, (list, np.ndarray)):
        return f"is a {type(value).__name__}; write a tuple"
    return _TYPES.get(fault) or f"is wrong: {error['msg']}"


_LIMITS = {"greater_than_equal": ("ge", "is below", "write at least"),
           "less_than_equal": ("le", "is above", "write at most"),
           "greater_than": ("gt", "is not above", "write more than"),
           "less_than": ("lt", "is not below", "write less than")}
_TYPES = {"finite_number": "is not a finite number; write one",
          "float_type": "is not a number; write one without quotes",
          "int_type": "is not a whole number; write one without quotes or decimal point",
          "string_type": "is not a text; write it in quotes",
          "tuple_type": "is not a list; write the numbers in brackets"}
