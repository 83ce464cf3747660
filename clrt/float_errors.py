"""numpy's default floating-point error handling inside clrt, whatever the caller has set.

Some of many small numbers underflow, which np.seterr(all="raise") would turn into an error.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar, cast

import numpy as np

F = TypeVar("F", bound=Callable[..., Any])


def default_errors() -> np.errstate:
    """Return a context with numpy's default error handling."""
    return np.errstate(divide="warn", over="warn", under="ignore", invalid="warn")


def with_default_errors(function: F) -> F:
    """Decorate the function to run in that context."""

    @wraps(function)
    def inside(*arguments: Any, **named: Any) -> Any:
        with default_errors():
            return function(*arguments, **named)

    return cast(F, inside)
