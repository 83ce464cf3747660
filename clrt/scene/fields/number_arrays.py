"""Conversion of users' array arguments to numeric arrays."""

from __future__ import annotations

from contextlib import suppress
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


def stored_array(value: Any, kind: Any) -> Any:
    """Return a read-only array of the scalar type `kind` for a list or an array of numbers that fit.

    An array of that type is not copied, and a read-only one is returned itself. Others remain as they are, for the
    validation to name: wide or fractional numbers for integers, and for floats the integers of pictures, as colors from
    0 to 255 would be far too bright.
    """
    if isinstance(value, list | tuple):
        with suppress(ClrtError):
            value = real_array("", value)
    if not isinstance(value, np.ndarray):
        return value
    if value.dtype.kind in "fiu" and value.dtype != kind:
        value = _converted(value, np.dtype(kind))
    return read_only(value)


def read_only(array: Any) -> Any:
    """Return a read-only view of an array; one that is read-only, and other values, as they are."""
    if not isinstance(array, np.ndarray) or not array.flags.writeable:
        return array
    view = array.view(np.ndarray)
    view.setflags(write=False)
    return view


def _converted(array: NDArray[Any], kind: np.dtype[Any]) -> NDArray[Any]:
    """Return the array in another type if its numbers fit, else itself."""
    if kind.kind == "f":
        with np.errstate(over="ignore", under="ignore"):
            return array if array.dtype in (np.uint8, np.uint16) else array.astype(kind)
    if array.size and array.dtype.kind == "f":
        return array
    narrow = array.astype(kind)
    return narrow if np.array_equal(array, narrow) else array


def _array(name: str, values: ArrayLike, kinds: str, wanted: str, error: type[ClrtError]) -> NDArray[Any]:
    try:
        array = np.asarray(values)
    except (ValueError, TypeError) as misfit:
        raise error(f"{name} is not an array; give rows of the same length, of {wanted}") from misfit
    if array.size and array.dtype.kind not in kinds:
        raise error(f"{name} has dtype {array.dtype}; give {wanted}")
    return array
