"""Misspelled keywords of public functions are refused with the closest one."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from typing import Any

import pytest

import clrt
from clrt.errors import UsageError

#: Functions without arguments, or with none by keyword alone.
WITHOUT = {"devices", "read_image"}
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
