"""What a part of the measurement is asked for, and the items that it answers with."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

#: The figures of an item: scalars by name.
Row = dict[str, Any]


@dataclass(frozen=True)
class Request:
    """Order to measure one part. device, other: ids of the device to measure and of one to compare it with, if any;
    scenes: scene files; seconds: for the whole part, by which it sizes its items."""

    device: str
    other: str | None
    quick: bool
    seconds: float
    scenes: list[str] = field(default_factory=list)


class Item(NamedTuple):
    """One row of a part's table. measure: returns its figures; raises a ClrtError if the device cannot do it."""

    name: str
    measure: Callable[[], Row]


#: Yields the items of a part; what they share is made when the first of them needs it.
Items = Callable[[Request], Iterator[Item]]
