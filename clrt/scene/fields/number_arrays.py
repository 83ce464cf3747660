"""Conversion of users' array arguments to numeric arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import ClrtError, UsageError


def real_array(name: str, values: ArrayLike, error: type[ClrtError] = UsageError) -> NDArray[Any]:
    """Return `values` as an array of integers or floats of any width. Raises `error`, with the name, for anything else,
    such as rows of different lengths, complex numbers, strings and None."""
    return _array(name, values, "fiu", "real numbers, such as float32", error)


def whole_array(name: str, values: ArrayLike, error: type[ClrtError] = UsageError) -> NDArray[Any]:
    """Return `values` as an array of integers; raises likewise. An empty array may have any dtype."""
    return _array(name, values, "iu", "integers, such as int32", error)


def _array(name: str, values: ArrayLike, kinds: str, wanted: str, error: type[ClrtError]) -> NDArray[Any]:
    try:
        array = np.asarray(values)
    except (ValueError, TypeError) as misfit:
        raise error(f"{name} is not an array; give rows of the same length, of {wanted}") from misfit
    if array.size and array.dtype.kind not in kinds:
        raise error(f"{name} has dtype {array.dtype}; give {wanted}")
    return array
