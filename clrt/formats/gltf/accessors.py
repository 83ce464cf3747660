"""Binary data of a glTF file: its container (.gltf or .glb), its buffers, and the arrays that accessors describe."""

from __future__ import annotations

import struct
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from .compressed_views import decompressed
from .resources import read_uri
from .schema import Accessor, BufferView, Document, Meshopt, Sparse, entry, parse_document

COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
DTYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
#: An accessor without a buffer view is all zeros; one larger than this is rejected as malformed.
MOST_ZEROS = 2**24

Array = NDArray[Any]
Bytes = NDArray[np.uint8]


class GltfData:
    """Document and bytes of one file. Every method raises SceneError for data that lies out of bounds."""

    def __init__(self, path: Path, ignored: Collection[str] = ()) -> None:
        content = path.read_bytes()
        text, self._chunk = split_glb(content) if content.startswith(b"glTF") else (content, None)
        self.document: Document = parse_document(text, ignored)
        self.path = path
        #: Decompressed values of accessors, (count, components), by index; see draco.py.
        self.decoded: dict[int, Array] = {}
        self._buffers: dict[int, Bytes] = {}
        self._decompressed: dict[int, Bytes] = {}

    def resource(self, uri: str, user: str) -> bytes:
        """Return the content of a URI, see `read_uri`."""
        return read_uri(self.path, uri, user)

    def view(self, index: int, user: str) -> Bytes:
        """Return the bytes of a buffer view, decompressed if it is compressed."""
        view = entry(self.document.bufferViews, index, "bufferView", user)
        if (compressed := view.extensions.meshopt) is None:
            return self._stored(view, f"bufferView {index}")
        if index not in self._decompressed:
            stream = self._stored(compressed, f"bufferView {index}")
            self._decompressed[index] = decompressed(compressed, stream, f"bufferView {index}")
        return self._decompressed[index]

    def _stored(self, view: BufferView | Meshopt, user: str) -> Bytes:
        data = self._buffer(view.buffer, user)
        end = view.byteOffset + view.byteLength
        if end > len(data):
            raise SceneError(
                f"{user}: ends at byte {end}, but buffer {view.buffer} has {len(data)}; export the file again"
            )
        return data[view.byteOffset : end]

    def array(self, index: int, kind: str, user: str) -> Array:
        """Return the values of an accessor of the type `kind`, (count, components): float32 if they are floats or
        normalised integers, otherwise the file's integers."""
        accessor = entry(self.document.accessors, index, "accessor", user)
        if accessor.type != kind:
            raise SceneError(f"{user}: accessor {index} is {accessor.type}, not {kind}; export the file again")
        size = COMPONENTS[kind]
        if index in self.decoded:
            values = self.decoded[index]
            if values.shape[1] != size:
                raise SceneError(
                    f"{user}: accessor {index} has {values.shape[1]} components, not {size}; export the file again"
                )
        elif accessor.bufferView is not None:
            stride = entry(self.document.bufferViews, accessor.bufferView, "bufferView", f"accessor {index}").byteStride
            values = self._strided(
                accessor.bufferView,
                accessor.byteOffset,
                accessor.componentType,
                (accessor.count, size),
                stride,
                f"accessor {index}",
            )
        elif accessor.count > MOST_ZEROS:
            raise SceneError(f"accessor {index}: {accessor.count} elements without a bufferView; export the file again")
        else:
            values = np.zeros((accessor.count, size), DTYPES[accessor.componentType])
        if accessor.sparse is not None:
            values = self._replaced(values, accessor.sparse, accessor, f"accessor {index}")
        return normalised(values) if accessor.normalized else values

    def _strided(
        self, view: int, offset: int, component: int, shape: tuple[int, int], stride: int | None, user: str
    ) -> Array:
        """Return (count, components) values from a buffer view, each element `stride` bytes after the last."""
        data = self.view(view, user)
        dtype = np.dtype(DTYPES[component])
        step = stride or shape[1] * dtype.itemsize
        end = offset + step * (shape[0] - 1) + shape[1] * dtype.itemsize
        if end > len(data):
            raise SceneError(
                f"{user}: needs {end} bytes of bufferView {view}, which has {len(data)}; export the file again"
            )
        return np.ndarray(shape, dtype, data.data, offset, (step, dtype.itemsize))

    def _replaced(
        self,
        values: Array,
        sparse: Sparse,
        accessor: Accessor,
        user: str,
    ) -> Array:
        """Return a copy of `values` with the elements that `sparse` replaces."""
        where, new = sparse.indices, sparse.values
        indices = self._strided(
            where.bufferView, where.byteOffset, where.componentType, (sparse.count, 1), None, f"{user} (sparse indices)"
        )[:, 0].astype(np.int64)
        if indices.max() >= len(values):
            raise SceneError(
                f"{user}: its sparse index {indices.max()} is beyond its {len(values)} elements; export the file again"
            )
        values = values.copy()
        values[indices] = self._strided(
            new.bufferView,
            new.byteOffset,
            accessor.componentType,
            (sparse.count, values.shape[1]),
            None,
            f"{user} (sparse values)",
        )
        return values

    def _buffer(self, index: int, user: str) -> Bytes:
        if index not in self._buffers:
            buffer = entry(self.document.buffers, index, "buffer", user)
            if buffer.uri is not None:
                data = self.resource(buffer.uri, f"buffer {index}")
            elif index == 0 and self._chunk is not None:
                data = self._chunk
            else:
                raise SceneError(f"buffer {index}: has neither a URI nor a binary chunk; export the file again")
            if len(data) < buffer.byteLength:
                raise SceneError(
                    f"buffer {index}: has {len(data)} of its {buffer.byteLength} bytes; "
                    "the file is truncated, copy it again"
                )
            self._buffers[index] = np.frombuffer(data, np.uint8)[: buffer.byteLength]
        return self._buffers[index]


def split_glb(content: bytes) -> tuple[bytes, bytes | None]:
    """Split a .glb file into the JSON text and the binary chunk, if there is one."""
    chunks: dict[bytes, bytes] = {}
    version, length = struct.unpack_from("<II", content, 4) if len(content) >= 12 else (2, 12)
    if version != 2:
        raise SceneError(f"is glTF version {version}; only version 2 is supported, export it again")
    if length > len(content):
        raise SceneError(f"has {len(content)} of its {length} bytes; the file is truncated, copy it again")
    position = 12
    while position + 8 <= length:
        size, kind = struct.unpack_from("<I4s", content, position)
        if position + 8 + size > length:
            raise SceneError(f"its chunk at byte {position} is longer than the file; copy it again")
        chunks.setdefault(kind, content[position + 8 : position + 8 + size])
        position += 8 + size
    if b"JSON" not in chunks:
        raise SceneError("contains no JSON chunk; export it again")
    return chunks[b"JSON"], chunks.get(b"BIN\0")


def normalised(values: Array) -> Array:
    """Convert integers to floats: unsigned 0 … 1, signed −1 … 1 (specification 3.6.2.2)."""
    if not np.issubdtype(values.dtype, np.integer):
        return values
    largest = np.iinfo(values.dtype).max
    return np.maximum(values.astype(np.float64) / largest, -1.0).astype(np.float32)
