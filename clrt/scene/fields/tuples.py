"""Sequences of numbers in the scene's dataclasses."""

from __future__ import annotations

from collections.abc import Container
from typing import Any

from .field_types import fields_of


def tuples_for_lists(record: Any, without: Container[str] = ()) -> None:
    """Convert a dataclass's lists and arrays of numbers to tuples, so that either may be given and it is hashable, and
    numpy's numbers to Python's, so that none overflows.

    without: names of fields that keep arrays.
    """
    for field in fields_of(type(record)):
        if field.name not in without and (plain := plain_sequence(value := getattr(record, field.name))) is not value:
            object.__setattr__(record, field.name, plain)


def plain_sequence(value: Any) -> Any:
    """Return lists and arrays of numbers as tuples, and numpy's numbers as Python's; other values as they are."""
    if hasattr(value, "tolist"):  # arrays and numpy's numbers
        value = value.tolist()
    if isinstance(value, list):
        return tuple(map(plain_sequence, value))
    if isinstance(value, tuple) and any(hasattr(entry, "tolist") for entry in value):
        return tuple(map(plain_sequence, value))
    return value
