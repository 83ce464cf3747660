"""Face lines that are all alike, such as `f 1/1/1 2/2/2 3/3/3`: parsed together, several times as fast as any lines."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..digit_words import Bytes, eight_digits, last_digits
from ..regular_numbers import NEWLINE, NINE, SPACE, ZERO, fields

SLASH = ord("/")
#: Most digits of an index.
MOST_DIGITS = 8


def regular_faces(text: Bytes) -> NDArray[np.int32] | None:
    """Return the indices of vertex, texture coordinates and normal, 0 for none, of polygons with the same number of
    corners and the same kinds of indices: (3, m, corners). None for other lines and for negative or longer indices.

    text: lines that start with "f ", between margins.
    """
    every = fields(text, text < ZERO)
    if every is None or np.count_nonzero(text > NINE) * len(every.separators) != len(every.ends):
        return None  # bytes that are neither digits nor separators, besides the first ones
    found = every.without_first()
    width, lengths = len(found.separators), found.ends - found.starts
    empty = lengths[:width] == 0
    columns = _columns(found.separators, empty)
    if columns is None or lengths.max() > MOST_DIGITS:
        return None
    if ((lengths.reshape(-1, width) == 0) != empty).any() if empty.any() else lengths.min() == 0:
        return None
    values = eight_digits(last_digits(text, found.ends, lengths)).reshape(-1, width // columns, columns)
    indices = np.zeros((3, *values.shape[:2]), np.int32)
    for column in range(columns):
        indices[column] = values[..., column]
    return indices


def _columns(separators: Bytes, empty: NDArray[np.bool_]) -> int | None:
    """Return how many fields each corner has, from the separators after the fields of a line; None unless there are
    at least three corners, all alike, of which at most the texture coordinates are empty."""
    columns = int((separators != SLASH).argmax()) + 1
    corners, rest = divmod(len(separators), columns)
    if rest or corners < 3 or columns > 3:
        return None
    one = [SLASH] * (columns - 1)
    if separators.tolist() != [*one, SPACE] * (corners - 1) + [*one, NEWLINE]:
        return None
    without = [False, columns == 3 and bool(empty[1]), False][:columns]
    return columns if empty.tolist() == without * corners else None
