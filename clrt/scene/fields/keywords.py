"""Arguments of public functions: unknown keywords, missing arguments and wrong types."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import is_dataclass
from functools import cache, wraps
from inspect import Parameter, Signature, signature
from os import PathLike
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, cast, get_args, get_origin, get_type_hints

from ...errors import UsageError
from .field_types import plain_value, show, unknown, value_problems
from .tuples import plain_sequence

F = TypeVar("F", bound=Callable[..., Any])
#: Abstract types of arguments, and what these should be; what they contain is for the function to check.
_ABSTRACT: dict[Any, str] = {
    PathLike: "is not the path of a file; write its name",
    Iterable: "is not a list; write [...]",
    Mapping: "is not a dict; write {...}",
}


def with_known_keywords(function: F) -> F:
    """Decorate a function, which raises UsageError for unknown keywords, with the closest one, for missing arguments
    and for those that are not of the types in its signature."""
    name, form = function.__qualname__.removesuffix(".__init__"), signature(function)
    takes_any = any(each.kind is Parameter.VAR_KEYWORD for each in form.parameters.values())
    known = None if takes_any else form.parameters.keys() - {"self"}

    @wraps(function)
    def checked(*arguments: Any, **named: Any) -> Any:
        check_arguments(name, function, form, arguments, named, known)
        return function(*arguments, **named)

    return cast(F, checked)


def check_arguments(
    name: str,
    function: Callable[..., Any],
    form: Signature,
    arguments: tuple[Any, ...],
    named: Mapping[str, Any],
    known: Collection[str] | None,
) -> None:
    """Raise UsageError for the first argument that a function of this signature does not accept.

    known: names of its keywords; None if it checks these itself, as it does the types of those not in the signature.
    """
    if known is not None:
        check_keywords(name, named, known)
    try:
        given = form.bind(*arguments, **named).arguments
    except TypeError as error:
        raise UsageError(f"{name}: {error}; {_places(form)}") from None
    for each, hint in _types(function).items():
        if each in given and (problems := _problems(hint, given[each], f"{name}.{each}")):
            raise UsageError("\n".join(problems))


def check_keywords(function: str, given: Iterable[str], known: Collection[str]) -> None:
    """Raise UsageError for the first keyword that a function does not know."""
    for each in given:
        if each not in known:
            raise UsageError(f'{function}: the option "{each}" {unknown(each, known)}')


def _places(form: Signature) -> str:
    """Return which arguments have places, and that others have names."""
    by_kind: dict[Any, list[str]] = {}
    for each in form.parameters.values():
        by_kind.setdefault(each.kind, []).append(each.name)
    placed = [each for each in by_kind.get(Parameter.POSITIONAL_OR_KEYWORD, []) if each != "self"]
    return f"it has {', '.join(placed) or 'none'}, in this order; write others by their names"


@cache
def _types(function: Callable[..., Any]) -> dict[str, Any]:
    """Return the types of a function's arguments that can be checked."""
    hints = get_type_hints(function, include_extras=True)
    hints.pop("return", None)
    return {name: hint for name, hint in hints.items() if _is_checked(hint)}


def _is_checked(hint: Any) -> bool:
    """Return whether values can be checked for this type. A choice among names is up to the function."""
    kinds = {get_origin(each) or each for each in _members(hint)}
    return not kinds <= {Literal, NoneType} and all(
        kind in (float, int, str, bool, tuple, NoneType, Literal, *_ABSTRACT) or is_dataclass(kind) for kind in kinds
    )


def _members(hint: Any) -> tuple[Any, ...]:
    return get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)


def _problems(hint: Any, value: Any, where: str) -> list[str]:
    """Return what is wrong with an argument: of an abstract type among others that it is none of these."""
    value, members = plain_value(value), _members(hint)
    kinds = tuple(str if get_origin(each) is Literal else get_origin(each) or each for each in members)
    if fault := next((fault for kind, fault in _ABSTRACT.items() if kind in kinds), ""):
        return [] if isinstance(value, kinds) else [f"{where}: {show(value)} {fault}"]
    return value_problems(hint, plain_sequence(value), where)
