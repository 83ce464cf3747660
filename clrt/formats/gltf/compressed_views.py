"""Buffer views that are compressed with meshopt (EXT_meshopt_compression, KHR_meshopt_compression)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ..meshopt.attributes import decode_attributes
from ..meshopt.filters import FILTERS
from ..meshopt.indices import decode_sequence, decode_triangles
from ..meshopt.streams import StreamError
from .schema import Meshopt

Bytes = NDArray[np.uint8]


def decompressed(view: Meshopt, stream: Bytes, user: str) -> Bytes:
    """Return the bytes that a stream stands for. Raises SceneError naming `user` for a damaged one."""
    try:
        if view.mode == "ATTRIBUTES":
            return _attributes(view, stream)
        if view.byteStride not in (2, 4):
            raise StreamError(f"its byteStride is {view.byteStride}; that of indices is 2 or 4")
        decode = decode_triangles if view.mode == "TRIANGLES" else decode_sequence
        indices = decode(stream, view.count)
        return indices.astype(f"<u{view.byteStride}").view(np.uint8)
    except StreamError as error:
        raise SceneError(f"{user}: its meshopt data cannot be decoded: {error}; export the file again") from None


def _attributes(view: Meshopt, stream: Bytes) -> Bytes:
    if view.byteStride % 4 or not 4 <= view.byteStride <= 256:
        raise StreamError(f"its byteStride is {view.byteStride}; that of attributes is a multiple of 4 up to 256")
    if view.filter == "NONE":
        return decode_attributes(stream, view.count, view.byteStride).reshape(-1)
    apply, strides = FILTERS[view.filter]
    if strides and view.byteStride not in strides:
        raise StreamError(f"its byteStride is {view.byteStride}, which its filter {view.filter} is not for")
    return apply(decode_attributes(stream, view.count, view.byteStride)).reshape(-1)
