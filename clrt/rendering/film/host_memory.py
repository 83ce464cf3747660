"""Host memory for copies of a film, reused once a copy is no longer referenced.

Fresh memory is mapped by the system page by page, which takes longer than copying a film, and much longer on a virtual
machine whose host has to find it first.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...threads import beside

#: Number of copies in use at a time: while one is referenced, such as the last state's, the next is made.
KEPT = 2


class HostMemory:
    """Pool for arrays of one shape and dtype; memory for KEPT arrays is allocated in the background at construction, if
    available, and retained."""

    def __init__(self, shape: tuple[int, ...], dtype: np.dtype[Any]) -> None:
        self._shape, self._dtype = shape, dtype
        self._kept: list[NDArray[np.uint8]] = []
        #: For each, a reference to the last array in it, or None if neither that nor a view of it is left.
        self._users: list[Callable[[], object]] = [lambda: None] * KEPT
        self._search = beside(self._find)

    def _find(self) -> None:
        size = int(np.prod(self._shape)) * self._dtype.itemsize
        with suppress(MemoryError):
            while len(self._kept) < KEPT:
                self._kept.append(np.full(size, 0, np.uint8))  # np.zeros would map pages on first use

    def array(self) -> NDArray[Any]:
        """Return an uninitialised array. Its memory is reused once neither it nor a view of it is referenced any
        more."""
        self._search()
        for place, memory in enumerate(self._kept):
            if self._users[place]() is None:
                # Not of an array: then the array made here is the base of all views, and lives as long as any of them.
                lent = np.frombuffer(memory.data, self._dtype)
                self._users[place] = weakref.ref(lent)
                return lent.reshape(self._shape)
        return np.empty(self._shape, self._dtype)
