"""Dataclass fields that are options: each with the description that `--help` and help() show.

Modules of settings import nothing heavy, as the command line reads its options from them.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field, fields
from typing import Any

from .errors import check_choice


def option(default: Any, description: str, values: Iterable[object] = ()) -> Any:
    """Return a dataclass field. values: all that are allowed, if they are listed; a default of None is, too."""
    return field(default=default, metadata={"description": description, "values": tuple(values)})


def check_values(record: Any) -> None:
    """Raise UsageError unless each option of the dataclass has one of its listed values."""
    for each in fields(record):
        if values := each.metadata.get("values"):
            check_choice(each.name, getattr(record, each.name), (*values, *((None,) if each.default is None else ())))
