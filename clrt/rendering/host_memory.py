"""Memory for copies of a film on the host, which is used again once nobody looks at a copy any more.

Fresh memory comes from the system page by page, which takes longer than copying a film there, and much longer on a
virtual machine whose host has to find it first.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..threads import beside

#: Copies that are needed again and again: while one is looked at, such as the last state's, the next is made.
KEPT = 2


class HostMemory:
    """For arrays of one shape and dtype; of KEPT the memory is found from the start on, beside what comes first, as far
    as there is any, and stays."""

    def __init__(self, shape: tuple[int, ...], dtype: np.dtype[Any]) -> None:
        self._shape, self._dtype = shape, dtype
        self._kept: list[NDArray[np.uint8]] = []
        #: Of each the array that was made in it last, or None where neither that nor a view of it is left.
        self._users: list[Callable[[], object]] = [lambda: None] * KEPT
        self._search = beside(self._find)

    def _find(self) -> None:
        size = int(np.prod(self._shape)) * self._dtype.itemsize
        with suppress(MemoryError):
            while len(self._kept) < KEPT:
                self._kept.append(np.full(size, 0, np.uint8))    # zeros come too late

    def array(self) -> NDArray[Any]:
        """An array whose elements are not defined. Its memory is used again when neither it nor a view of it is left.
        """
        self._search()
        for place, memory in enumerate(self._kept):
            if self._users[place]() is None:
                # Of memory that is no array's: views then are of the array made here, which stays as long as any.
                lent = np.frombuffer(memory.data, self._dtype)
                self._users[place] = weakref.ref(lent)
                return lent.reshape(self._shape)
        return np.empty(self._shape, self._dtype)
