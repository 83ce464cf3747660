"""Floating-point errors in clrt's own use of numpy: as numpy has them by default, whatever a caller sets elsewhere.

Among many small numbers some underflow, which np.seterr(all="raise") would make an error of.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar, cast

import numpy as np

F = TypeVar("F", bound=Callable[..., Any])


def default_errors() -> np.errstate:
    """The context in which they are."""
    return np.errstate(divide="warn", over="warn", under="ignore", invalid="warn")


def with_default_errors(function: F) -> F:
    """The function in that context."""
    @wraps(function)
    def inside(*arguments: Any, **named: Any) -> Any:
        with default_errors():
            return function(*arguments, **named)

    return cast(F, inside)
