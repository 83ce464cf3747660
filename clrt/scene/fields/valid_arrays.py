"""Memory of arrays that passed a test, so that copies of a mesh or an image with other fields are not tested again."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any
from weakref import WeakValueDictionary

import numpy as np

#: Read-only arrays by `id` and test, as long as they exist.
_passed: WeakValueDictionary[tuple[int, Hashable], np.ndarray[Any, Any]] = WeakValueDictionary()


def faults_once(array: object, test: Hashable, faults: Callable[[], list[str]]) -> list[str]:
    """Return the faults that a test finds in an array: none if this read-only array has passed it before.

    test: the test's name and all that its result depends on, but for the array.
    """
    key = id(array), test
    if _passed.get(key) is array and array is not None:
        return []
    found = faults()
    if not found and isinstance(array, np.ndarray) and not array.flags.writeable:
        _passed[key] = array
    return found
