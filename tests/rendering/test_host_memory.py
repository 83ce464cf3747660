"""Memory for a film's copies is used again when nobody can see it any more, and never before."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.rendering.host_memory import KEPT, HostMemory
from clrt.rendering.records import PIXEL


def place(array: NDArray[Any]) -> int:
    return int(array.__array_interface__["data"][0])


def test_memory_is_used_again() -> None:
    memory = HostMemory((3, 5), PIXEL)
    places = set()
    for _ in range(10):
        array = memory.array()
        assert array.shape == (3, 5) and array.dtype == PIXEL and array.flags.writeable
        places.add(place(array))
    assert len(places) <= KEPT


def test_what_is_still_seen_stays_as_it_is() -> None:
    """Views of views, of one field, as bytes: each keeps the whole from being given out."""
    memory = HostMemory((3, 5), PIXEL)
    array = memory.array()
    array["count"] = 7
    views = [array["count"], array[1:][:, 2]["count"], np.ascontiguousarray(array).reshape(-1).view(np.uint8).data,
             array[list(PIXEL.names or ())]]
    seen = place(array)
    del array
    while views:
        other = memory.array()
        other["count"] = 8
        assert place(other) != seen and np.all(views[0] == 7)
        del other, views[-1]
    assert seen in map(place, [memory.array() for _ in range(KEPT)])
