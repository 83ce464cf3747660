"""Misspelled keywords of public functions are refused with the closest one; missing arguments and surplus ones, too."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from typing import Any

import pytest

import clrt
from clrt.errors import UsageError

#: Functions without arguments, or with none by keyword alone.
WITHOUT = {"devices"}
FUNCTIONS: dict[str, Callable[..., Any]] = {
    name: call
    for name in clrt.__all__
    if (inspect.isfunction(call := getattr(clrt, name)) or name in ("Renderer", "RayQuery", "InstancedRayQuery"))
    and name not in WITHOUT
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_each_misspelled_keyword(name: str) -> None:
    """Whatever the other arguments are, which are not looked at."""
    known = [each for each in inspect.signature(FUNCTIONS[name]).parameters if len(each) > 2]
    for keyword in known:
        wrong = keyword[:-1] + keyword[-1] * 2
        with pytest.raises(UsageError, match=f'{name}: the option "{wrong}" is unknown; did you mean "') as refused:
            FUNCTIONS[name](**{wrong: 1})
        assert re.findall('mean "(.*)"', str(refused.value))[0] in known


@pytest.mark.parametrize("name", FUNCTIONS)
def test_missing_and_surplus_arguments(name: str) -> None:
    """They are refused with the names of those that have places."""
    first, call = next(iter(inspect.signature(FUNCTIONS[name]).parameters)), FUNCTIONS[name]
    with pytest.raises(UsageError, match=f"^{name}: missing a required argument: '{first}'; it has {first}"):
        call()
    with pytest.raises(UsageError, match=f"^{name}: too many positional arguments; it has {first}"):
        call(*range(40))
