"""Memory of film copies is reused once no view of it is alive, and never before."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.rendering.compile.records import PIXEL
from clrt.rendering.film.host_memory import KEPT, HostMemory

SHAPE = (3, 5)
#: Views of a film: a field, some rows, several fields, and its bytes, as the checkpoint writer takes them.
VIEWS: dict[str, Callable[[NDArray[Any]], Any]] = {
    "field": lambda film: film["count"],
    "rows": lambda film: film[1:][:, 2],
    "fields": lambda film: film[list(PIXEL.names or ())],
    "bytes": lambda film: np.ascontiguousarray(film).reshape(-1).view(np.uint8).data,
}


def place(array: NDArray[Any]) -> int:
    return int(array.__array_interface__["data"][0])


def test_memory_is_used_again() -> None:
    """It is reused, and arrays that others allocate in between do not get it."""
    memory, others = HostMemory(SHAPE, PIXEL), []
    places = set()
    for _ in range(10):
        array = memory.array()
        assert array.shape == SHAPE and array.dtype == PIXEL and array.flags.writeable
        places.add(place(array))
        del array
        others.append(np.empty(SHAPE, PIXEL))
    assert len(places) <= KEPT and places.isdisjoint(map(place, others))


@pytest.mark.parametrize("view", VIEWS)
def test_what_is_still_seen_stays_as_it_is(view: str) -> None:
    memory = HostMemory(SHAPE, PIXEL)
    array = memory.array()
    array["count"] = 7
    seen, sight = place(array), VIEWS[view](array)
    del array
    others = [memory.array() for _ in range(KEPT + 1)]
    assert len({seen, *map(place, others)}) == KEPT + 2
    del others, sight
    assert seen in map(place, [memory.array() for _ in range(KEPT)])
