"""Functions whose keywords are those of a TypedDict: `**options: Unpack[Options]` checks them statically, and `listed`
at run time."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import Field, fields
from functools import wraps
from inspect import Parameter, signature
from textwrap import fill
from types import NoneType
from typing import Annotated, Any, Literal, TypeVar, cast, get_args, get_origin, get_type_hints

from ..scene.fields.keywords import check_arguments

F = TypeVar("F", bound=Callable[..., Any])


def listed(options: type, settings: Sequence[type] = ()) -> Callable[[F], F]:
    """Decorate a function or class: its signature and docstring list the keywords in `options`, and it raises
    UsageError for others, with the closest one.

    settings: dataclasses whose fields have the defaults and descriptions of keywords.
    """
    described = {field.name: field for kind in settings for field in fields(kind)}

    def decorate(function: F) -> F:
        module = vars(sys.modules[function.__module__])
        hints = get_type_hints(options, localns={**module, function.__name__: function}, include_extras=True)
        made: Any = function
        if isinstance(function, type):
            made.__init__ = _checked(made.__init__, function.__name__, hints, described)
        else:
            made = _checked(function, function.__name__, hints, described)
        made.__doc__ = "\n".join(
            [
                f"{(made.__doc__ or '').rstrip()}\n",
                "    Keywords:\n",
                *(
                    fill(
                        f"- {name}: {_description(name, hint, described)}",
                        120,
                        initial_indent=" " * 4,
                        subsequent_indent=" " * 6,
                    )
                    for name, hint in hints.items()
                ),
            ]
        )
        return cast(F, made)

    return decorate


def _checked(
    call: Callable[..., Any], name: str, hints: Mapping[str, Any], described: Mapping[str, Field[Any]]
) -> Callable[..., Any]:
    """Return the call that refuses unknown keywords, with its full signature."""
    form = signature(call)
    own = [each for each in form.parameters.values() if each.kind is not Parameter.VAR_KEYWORD]
    known = {each.name for each in own} | {*hints}
    keywords = [
        Parameter(each, Parameter.KEYWORD_ONLY, default=_default(each, hint, described), annotation=_type(hint))
        for each, hint in hints.items()
    ]

    @wraps(call)
    def checked(*arguments: Any, **given: Any) -> Any:
        check_arguments(name, call, form, arguments, given, known)
        return call(*arguments, **given)

    setattr(checked, "__signature__", form.replace(parameters=[*own, *keywords]))
    return checked


def _type(hint: Any) -> Any:
    """Return a type without its description."""
    return get_args(hint)[0] if get_origin(hint) is Annotated else hint


def _default(name: str, hint: Any, described: Mapping[str, Field[Any]]) -> Any:
    """Return the default of a keyword: None if it may be None."""
    return described[name].default if name in described and NoneType not in get_args(_type(hint)) else None


def _description(name: str, hint: Any, described: Mapping[str, Field[Any]]) -> str:
    """Return what a keyword does, and the values that it may have."""
    own, field = get_args(hint)[1:] if get_origin(hint) is Annotated else (), described.get(name)
    text = own[0] if own else field.metadata["description"] if field else ""
    values = [
        each for part in (_type(hint), *get_args(_type(hint))) if get_origin(part) is Literal for each in get_args(part)
    ]
    return f"{text} One of {', '.join(map(repr, values))}." if values else text
