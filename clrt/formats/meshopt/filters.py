"""Filters of attribute streams: what decoded elements stand for (appendix B)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
#: Limits of the exponent of the exponential filter.
LEAST_EXPONENT, MOST_EXPONENT = -100, 100


def octahedral(elements: Bytes) -> Bytes:
    """Return unit vectors, and a fourth component as it is, of 8 or 16 bits each."""
    dtype = np.dtype("<i1" if elements.shape[1] == 4 else "<i2")
    stored = elements.view(dtype)
    one = np.maximum(stored[:, 2], 1).astype(np.float32)
    x, y = stored[:, 0] / one, stored[:, 1] / one
    z = 1 - np.abs(x) - np.abs(y)
    under = np.minimum(z, 0)
    vectors = np.column_stack([x - np.copysign(under, x), y - np.copysign(under, y), z])
    vectors /= np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), np.finfo(np.float32).tiny)
    decoded = stored.copy()
    decoded[:, :3] = _rounded(vectors * np.iinfo(dtype).max)
    return decoded.view(np.uint8)


def quaternion(elements: Bytes) -> Bytes:
    """Return unit quaternions of 16 bits per component, of which the largest was left out."""
    stored = elements.view("<i2")
    one = (stored[:, 3] | 3).astype(np.float32)
    three = stored[:, :3] / np.where(one == 0, 1, one)[:, None] * np.float32(0.5**0.5)
    largest = np.sqrt(np.maximum(1 - np.sum(three * three, axis=1), 0))
    place = (stored[:, 3] & 3)[:, None] + np.arange(4) & 3
    values = np.column_stack([largest, three]) * 32767
    decoded = np.empty_like(stored)
    np.put_along_axis(decoded, place.astype(np.int64), _rounded(values).clip(-32768, 32767).astype("<i2"), axis=1)
    return decoded.view(np.uint8)


def exponential(elements: Bytes) -> Bytes:
    """Return floats, each a mantissa of 24 bits times a power of 2."""
    stored = np.ascontiguousarray(elements).view("<i4")
    exponent = (stored >> 24).clip(LEAST_EXPONENT, MOST_EXPONENT)
    values = np.ldexp((stored << 8 >> 8).astype(np.float32), exponent)
    return np.asarray(values, "<f4").view(np.uint8)


def color(elements: Bytes) -> Bytes:
    """Return red, green, blue and alpha, of 8 or 16 bits each, from luma and two chroma values."""
    dtype = np.dtype("<u1" if elements.shape[1] == 4 else "<u2")
    stored = elements.view(dtype).astype(np.int64)
    co, cg = (elements.view(dtype.str.replace("u", "i"))[:, part].astype(np.int64) for part in (1, 2))
    y, mark = stored[:, 0], np.maximum(stored[:, 3], 1)
    most = (1 << np.frexp(mark.astype(np.float64))[1].astype(np.int64)) - 1
    alpha = mark & most >> 1
    channels = np.column_stack([y + co - cg, y + cg, y - co - cg, alpha << 1 | alpha & 1])
    full = np.iinfo(dtype).max
    return _rounded(channels * (full / most)[:, None]).clip(0, full).astype(dtype).view(np.uint8)


#: Filters by their names in files, with the strides that each is for; any multiple of 4 if none are listed.
FILTERS: dict[str, tuple[Callable[[Bytes], Bytes], tuple[int, ...]]] = {
    "OCTAHEDRAL": (octahedral, (4, 8)),
    "QUATERNION": (quaternion, (8,)),
    "EXPONENTIAL": (exponential, ()),
    "COLOR": (color, (4, 8)),
}


def _rounded(values: NDArray[np.floating]) -> NDArray[np.floating]:
    """Round to the nearest integers, halves away from zero."""
    return np.asarray(np.trunc(values + np.copysign(0.5, values)))
