"""Options that are fields of a dataclass: one table for each object, which a command receives."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import Field, field, fields
from functools import wraps
from types import NoneType
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import click

from ..scene.fields.limits import Ge, Le, Limit, Lt
from .option_types import Finite, OneOf, Size

Decorator = Callable[[Any], Any]


def flag(*names: str, default: Any = None, **settings: Any) -> Any:
    """Return a dataclass field that is a command-line option, with the settings of `click.option`."""
    return field(default=default, metadata={"names": names, "settings": {**settings, "default": default}})


def grouped(name: str, kind: type) -> Decorator:
    """Add the options that are the fields of a dataclass; the command receives the object by this name."""

    def decorate(command: Any) -> Any:
        @wraps(command)
        def called(**given: Any) -> Any:
            values = {each.name: given.pop(each.name) for each in fields(kind)}
            return command(**{name: kind(**values)}, **given)

        made: Any = called
        for each in reversed(fields(kind)):
            made = click.option(*each.metadata["names"], each.name, **each.metadata["settings"])(made)
        return made

    return decorate


def settings_options(
    kind: type, names: Mapping[str, str] = {}, without: Collection[str] = (), defaults: bool = True
) -> Decorator:
    """Add an option for each described field of a settings object; the command receives them by the fields' names.

    names: options that are not called like their field; defaults: whether they have the fields' defaults, else None.
    """
    hints = get_type_hints(kind, include_extras=True)

    def decorate(command: Any) -> Any:
        for each in reversed(fields(kind)):
            if each.name not in without and "description" in each.metadata:
                command = _option(each, hints[each.name], names.get(each.name), defaults)(command)
        return command

    return decorate


def _option(each: Field[Any], hint: Any, name: str | None, defaults: bool) -> Decorator:
    """Return the option of a field: a flag, or one whose values are those of its type."""
    name = name or f"--{each.name.replace('_', '-')}"
    told: dict[str, Any] = {"help": each.metadata["description"]}
    if hint is bool:
        return click.option(
            f"{name}/--no-{name[2:]}" if each.default else name, each.name, is_flag=True, default=None, **told
        )
    kind, values = _without_none(hint), each.metadata["values"]
    if kind is bool:
        return click.option(
            name,
            each.name,
            type=OneOf(["on", "off"]),
            **told,
            callback=lambda context, parameter, value: value and value == "on",
        )
    default = each.default if defaults else None
    value = OneOf(values) if values else _type(kind)
    return click.option(
        name,
        each.name,
        type=value,
        metavar="X" if isinstance(value, Finite) else None,
        **told,
        default=default,
        show_default=default is not None,
    )


def _without_none(hint: Any) -> Any:
    """Return X for the type X | None."""
    return next(part for part in get_args(hint) if part is not NoneType) if NoneType in get_args(hint) else hint


def _type(hint: Any) -> click.ParamType[Any]:
    """Return the option type for a field's type, with its limits."""
    origin, parts = get_origin(hint), get_args(hint)
    if origin is Literal:
        return OneOf(parts)
    if origin is tuple:
        return Size()
    limits: dict[type[Limit], Any] = {type(each): each.bound for each in parts[1:]} if origin is Annotated else {}
    if (parts[0] if limits else hint) is int:
        most = limits.get(Le, limits[Lt] - 1 if Lt in limits else None)
        return click.IntRange(limits.get(Ge), most) if limits else click.INT
    return Finite(limits.get(Ge), limits.get(Le))
