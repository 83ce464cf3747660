"""Unknown keywords of public functions."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from functools import wraps
from inspect import signature
from typing import Any, TypeVar, cast

from ...errors import UsageError
from .field_types import unknown

F = TypeVar("F", bound=Callable[..., Any])


def with_known_keywords(function: F) -> F:
    """Decorate a function, which raises UsageError for unknown keywords, with the closest one."""
    known = frozenset(signature(function).parameters)
    name = function.__qualname__.removesuffix(".__init__")

    @wraps(function)
    def checked(*arguments: Any, **named: Any) -> Any:
        check_keywords(name, named, known)
        return function(*arguments, **named)

    return cast(F, checked)


def check_keywords(function: str, given: Iterable[str], known: Collection[str]) -> None:
    """Raise UsageError for the first keyword that a function does not know."""
    for each in given:
        if each not in known:
            raise UsageError(f'{function}: the option "{each}" {unknown(each, known)}')
