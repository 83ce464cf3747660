"""Memory for copies of a film on the host, which is used again once nobody looks at a copy any more.

Fresh memory comes from the system page by page, which takes longer than copying a film there, and much longer on a
virtual machine whose host has to find it first.
"""

from __future__ import annotations

import weakref
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Copies that are needed again and again: while one is looked at, such as the last state's, the next is made.
KEPT = 2


class HostMemory:
    """For arrays of one shape and dtype; of KEPT the memory is there from the start, and stays."""

    def __init__(self, shape: tuple[int, ...], dtype: np.dtype[Any]) -> None:
        self._shape, self._dtype = shape, dtype
        self._bytes = int(np.prod(shape)) * dtype.itemsize
        self._spare = [np.full(self._bytes, 0, np.uint8) for _ in range(KEPT)]    # zeros would not be there yet

    def array(self) -> NDArray[Any]:
        """An array whose elements are not defined. Its memory is used again when neither it nor a view of it is left.
        """
        spare = self._spare
        memory = spare.pop() if spare else np.empty(self._bytes, np.uint8)

        def give_back() -> None:
            if len(spare) < KEPT:
                spare.append(memory)

        # Of memory that is no array's: views then are of the array made here, which stays as long as any of them.
        lent = np.frombuffer(memory.data, self._dtype)
        weakref.finalize(lent, give_back).atexit = False
        return lent.reshape(self._shape)
