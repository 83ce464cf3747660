"""Validation of plain values against a dataclass's field types, with problems as sentences.

The scene file and objects made in Python are both validated here, so the limits and messages are the same. Imports no
numpy, as the command line reads its options from render settings.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from datetime import date, datetime, time
from functools import lru_cache, reduce
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from .limits import Characters, Ge, Gt, Le, Limit, Lt

INT64_END = 2**63
FLOAT32_MAX = (2 - 2**-23) * 2.0**127
#: More problems than this in one object are counted, not listed.
MOST = 12
#: What other renderers call fields, where the name is not like clrt's.
_SYNONYMS = {"samples": "spp", "bounces": "max_depth", "resolution": "size"}
#: The names of the generic types of arrays; from numpy 2.5 on, NDArray[...] is an alias with a name of its own.
_ARRAYS = frozenset({"ndarray", "NDArray"})


def field_problems(kind: type, values: Mapping[str, Any], where: str) -> list[str]:
    """Return what is wrong with `values` as the fields of the dataclass `kind`: each as
    "where.field: value ...".

    Finds missing and unknown fields, wrong types, values outside the limits of the type, and numbers that float32
    cannot represent (NaN, Inf and out of range). Numbers may be numpy scalars; sequences must be tuples. Arrays and
    mappings are not checked.
    """
    plain = {name: plain_value(value) for name, value in values.items()}
    hints = field_types(kind)
    problems: list[str] = []
    for field in fields_of(kind):
        if field.name in plain:
            problems += _problems(hints[field.name], plain[field.name], f"{where}.{field.name}")
    problems += [f"{where}{fault}" for fault in missing_fields(kind, plain)]
    problems += [f'{where}: key "{name}" {unknown(name, hints)}' for name in plain if name not in hints]
    if problems:
        more = [f"{where}: {len(problems) - MOST} more mistakes like these"] if len(problems) > MOST else []
        return problems[:MOST] + more
    return [
        f"{where}.{name}: {show(value)} is outside the range of float32; write a smaller number"
        for name, value in plain.items()
        if _too_large(value)
    ]


def usable(kind: type, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return valid `values` for the fields of `kind` in a form that numpy can use: integers of more than 64 bits, for
    which it has no type, become floats if the field accepts these."""
    hints = field_types(kind)
    return {name: _floats(hints[name], value) for name, value in values.items()}


def unknown(name: object, known: Iterable[str]) -> str:
    """Return the message that a name is not among the `known` ones, with the closest match."""
    import difflib

    known = sorted(known)
    near = (
        [word for word in known if word == _SYNONYMS.get(str(name))]
        or difflib.get_close_matches(str(name), known, 1)
        or [word for word in known if word.startswith(f"{name}_")]
    )
    if near:
        return f'is unknown; did you mean "{near[0]}"?'
    return f"is unknown; write one of {', '.join(known)}" if known else "is unknown; none is defined"


def show(value: object) -> str:
    """Format a value as in the scene file, shortened."""
    if isinstance(value, str):
        text = f'"{value}"'
    elif isinstance(value, bool):
        text = str(value).lower()
    elif isinstance(value, tuple):
        text = f"[{', '.join(show(entry) for entry in value[:20])}]"
    elif isinstance(value, (date, time)):
        text = value.isoformat()
    elif isinstance(value, dict):
        text = f"{{ {', '.join(f'{key} = {show(entry)}' for key, entry in value.items())} }}"
    else:
        # Python refuses to format integers of more than 4300 decimal digits.
        text = hex(value) if isinstance(value, int) and value.bit_length() > 1024 else repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def field_types(kind: type) -> dict[str, Any]:
    """Return the types of a dataclass's fields by name, with their limits; Any for arrays and mappings."""
    return _field_types(kind)


def fields_of(kind: type) -> tuple[Field[Any], ...]:
    """Return a dataclass's fields, without the time that `fields` takes."""
    return _fields_of(kind)


def array_fields(kind: type) -> Mapping[str, type]:
    """Return the scalar types of a dataclass's fields that are arrays, or None, by name."""
    return _array_fields(kind)


def missing_fields(kind: type, given: Container[str]) -> list[str]:
    """Return a problem for each field of a dataclass that has no default and is not given."""
    return [f": {name} is missing; add it" for name in required_fields(kind) if name not in given]


def required_fields(kind: type) -> list[str]:
    """Return the names of a dataclass's fields without a default."""
    return [field.name for field in fields_of(kind) if field.default is MISSING and field.default_factory is MISSING]


def value_problems(hint: Any, value: Any, where: str) -> list[str]:
    """Return what is wrong with one value, as `field_problems` does, given its type without arrays and mappings."""
    return list(_problems(hint, plain_value(value), where))


def not_of_type(value: object, kind: type, name: str, example: str) -> str:
    """Return the message that an object is of another type, or is the class itself. name: of the type."""
    if isinstance(value, type) and issubclass(value, kind):
        return f"{value.__name__} is a class; write an object of it, clrt.{value.__name__}(...)"
    return f"{show(value)} is not of type {name}; {example}"


@lru_cache
def _field_types(kind: type) -> dict[str, Any]:
    hints = get_type_hints(kind, include_extras=True)
    return {field.name: Any if _is_opaque(hints[field.name]) else hints[field.name] for field in fields(kind)}


@lru_cache
def _fields_of(kind: type) -> tuple[Field[Any], ...]:
    return fields(kind)


@lru_cache
def _array_fields(kind: type) -> Mapping[str, type]:
    hints = get_type_hints(kind)
    names = [field.name for field in fields(kind) if _ARRAYS & _origins(hints[field.name])]
    return {name: next(each for each in _leaves(hints[name]) if hasattr(each, "dtype")) for name in names}


def _leaves(hint: Any) -> Iterator[Any]:
    """Yield the types that a generic type is made of."""
    parts = get_args(hint)
    yield from (leaf for part in parts for leaf in _leaves(part)) if parts else (hint,)


def _is_opaque(hint: Any) -> bool:
    """Return whether values of this type are not plain data."""
    return not _origins(hint).isdisjoint(_ARRAYS | {"Mapping", "dict"})


def _origins(hint: Any) -> set[str]:
    """Return the names of a type's generic origins, by which arrays are found without importing numpy."""
    parts = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
    return {getattr(get_origin(part), "__name__", "") for part in parts}


def _problems(hint: Any, value: Any, path: str) -> Iterator[str]:
    """Yield the problems of a `value` of the type `hint`: a number, string, Literal, tuple, limits, texture or None."""
    origin, parts = get_origin(hint), get_args(hint)
    if origin is Annotated:
        yield from _problems(parts[0], value, path) if _fault(parts[0], value) else _outside(parts[1:], value, path)
    elif NoneType in parts:
        rest = tuple(part for part in parts if part is not NoneType)
        yield from () if value is None else _problems(reduce(operator.or_, rest), value, path)
    elif origin in (Union, UnionType):
        if not isinstance(value, tuple(filter(is_dataclass, parts))) and (made := _made_of(parts, value)):
            yield f"{path}: is a {type(value).__name__}; write a {made}"
            return
        meant = _meant(parts, value)
        yield from _problems(meant, value, path)
        if is_dataclass(meant) and hasattr(value, "factor"):  # a texture's, instead of a plain value
            yield from _problems(_factor(parts[0], value.factor), value.factor, f"{path}.factor")
    elif isinstance(hint, type) and is_dataclass(hint):
        if not isinstance(value, hint):
            yield f"{path}: {not_of_type(value, hint, hint.__name__, _example(hint))}"
    elif origin is Literal:
        if not (isinstance(value, str) and value in parts):
            yield f"{path}: {show(value)} {unknown(value, parts)}"
    elif origin is tuple and isinstance(value, tuple):
        yield from _tuple_problems(parts, value, path)
    elif hint is not Any and (fault := _fault(origin or hint, value)):
        yield f"{path}: {show(value)} {fault}"


def _tuple_problems(parts: tuple[Any, ...], value: tuple[Any, ...], path: str) -> Iterator[str]:
    """Yield the problems of a tuple and of its entries; parts: their types, or one type and an ellipsis."""
    kinds = (parts[0],) * len(value) if parts[-1] is ... else parts
    if len(value) <= len(kinds):
        for i, (kind, entry) in enumerate(zip(kinds, value)):
            yield from _problems(kind, entry, f"{path}[{i}]")
    if len(value) != len(kinds):
        yield f"{path}: {show(value)} has {len(value)} entries; write {len(kinds)}"


def _floats(hint: Any, value: Any) -> Any:
    """Return a valid value with integers of more than 64 bits as floats if the type accepts these."""
    origin, parts = get_origin(hint), get_args(hint)
    if hint is float:
        return value if abs(value) < INT64_END else float(value)
    if origin is Annotated:
        return _floats(parts[0], value)
    if origin in (Union, UnionType) and value is not None:
        return _floats(_meant(parts, value), value)
    if origin is tuple:
        kinds = (parts[0],) * len(value) if parts[-1] is ... else parts
        return tuple(map(_floats, kinds, value))
    return value


def _meant(parts: tuple[Any, ...], value: Any) -> Any:
    """Return the member of a union that a value is validated against: the one that it is of, else the first."""
    kinds = [(get_origin(part) or part, part) for part in parts]
    return next((part for kind, part in kinds if isinstance(kind, type) and isinstance(value, kind)), parts[0])


def _made_of(parts: tuple[Any, ...], value: Any) -> str:
    """Return how the member of a union is made that has a value as one of its fields; empty if none does."""
    return next(
        (
            f"clrt.{part.__name__}({name}=...)"
            for part in parts
            if is_dataclass(value) and isinstance(part, type) and is_dataclass(part)
            for name, kind in field_types(part).items()
            if kind is type(value)
        ),
        "",
    )


def _factor(plain: Any, factor: object) -> Any:
    """Return the type of a texture's factor, given the type of the plain value; a color also accepts one number."""
    one = get_origin(plain) is tuple and not isinstance(factor, tuple)
    return get_args(plain)[0] if one else plain


def _example(kind: type) -> str:
    """Return how an object of this type is written, in the scene file and in Python."""
    if "remedy" in vars(kind):
        return str(vars(kind)["remedy"])
    return f"write a clrt.{' or clrt.'.join(each.__name__ for each in kind.__subclasses__() or [kind])}"


def _outside(limits: Iterable[Limit | Characters], value: Any, path: str) -> Iterator[str]:
    """Yield the limits that a number or text violates."""
    for limit in limits:
        if isinstance(limit, Characters):
            if not re.fullmatch(limit.pattern, value):
                yield f"{path}: {show(value)} is not made of {limit.names} alone; leave the rest out"
            continue
        keeps, is_wrong, remedy = _LIMITS[type(limit)]
        if not keeps(value, limit.bound):
            yield f"{path}: {show(value)} {is_wrong} {limit.bound}; {remedy} {limit.bound}"


def _fault(kind: Any, value: Any) -> str:
    """Return why a value is not of a plain type, and the remedy; empty if it is."""
    if isinstance(value, _ACCEPTED[kind]) and isinstance(value, bool) == (kind is bool):
        finite = not isinstance(value, float) or math.isfinite(value)
        return "" if finite else "is not a finite number; write one"
    if kind is tuple and (isinstance(value, list) or hasattr(value, "tolist")):
        return f"is a {type(value).__name__}; write a tuple"
    fault, if_quoted = _REMEDIES[kind]
    return fault + if_quoted if isinstance(value, (str, float)) else fault


_ACCEPTED: dict[Any, Any] = {float: (float, int), int: int, str: str, bool: bool, tuple: tuple, datetime: datetime}
#: What is wrong with values of other types, and what to leave out of strings and numbers.
_REMEDIES: dict[Any, tuple[str, str]] = {
    float: ("is not a number; write one", " without quotes"),
    int: ("is not an integer; write one", " without quotes or decimal point"),
    str: ("is not a string; write it in quotes", ""),
    bool: ("is not a boolean; write true or false", ""),
    tuple: ("is not a list; write the numbers in brackets", ""),
    datetime: (
        "is not a date and time; write one such as 2026-06-21T12:00:00+02:00 without quotes, or in Python a datetime",
        "",
    ),
}
_LIMITS: dict[type, tuple[Callable[[float, float], bool], str, str]] = {
    Ge: (operator.ge, "is below", "write at least"),
    Le: (operator.le, "is above", "write at most"),
    Gt: (operator.gt, "is not above", "write more than"),
    Lt: (operator.lt, "is not below", "write less than"),
}


def plain_value(value: Any) -> Any:
    """Convert numpy scalars to Python's, also inside tuples."""
    if isinstance(value, tuple):
        return tuple(map(plain_value, value))
    return value.item() if getattr(value, "ndim", None) == 0 else value


def _too_large(value: Any) -> bool:
    if isinstance(value, tuple):
        return any(map(_too_large, value))
    return isinstance(value, (float, int)) and abs(value) > FLOAT32_MAX
