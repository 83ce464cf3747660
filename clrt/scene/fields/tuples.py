"""Sequences of numbers in the scene's dataclasses."""

from __future__ import annotations

from dataclasses import fields
from typing import Any


def tuples_for_lists(record: Any) -> None:
    """Convert a dataclass's lists and arrays of numbers to tuples, so that either may be given and it is hashable."""
    for field in fields(record):
        value = getattr(record, field.name)
        if hasattr(value, "tolist"):
            value = value.tolist()
        if isinstance(value, list):
            object.__setattr__(record, field.name, tuple(value))
