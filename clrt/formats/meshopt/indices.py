"""Decoders of index streams: of triangle lists (mode 1), and of any sequence (mode 2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .streams import ENDS_EARLY, StreamError, check_size

Bytes = NDArray[np.uint8]
Indices = NDArray[np.uint32]
MASK = 0xFFFFFFFF
#: Bytes of the last part of a stream: the table of a triangle stream, and padding.
TABLE, PADDING = 16, 4
#: Entry of a queue that nothing was written to.
UNSET = -1


def decode_triangles(stream: Bytes, count: int) -> Indices:
    """Return the `count` indices of a stream of triangles. Raises StreamError for a damaged one."""
    check_size(len(stream), 4 * count)
    if not len(stream) or stream[0] != 0xE1:
        raise StreamError(f"its first byte is 0x{int(stream[0]) if len(stream) else 0:02x}, not 0xe1")
    if count % 3:
        raise StreamError(f"its {count} indices are not a multiple of 3")
    if len(stream) < 1 + count // 3 + TABLE:
        raise StreamError(ENDS_EARLY)
    reader = _TriangleReader(stream[: len(stream) - TABLE].tobytes(), 1 + count // 3, stream[-TABLE:].tolist())
    indices = reader.triangles(stream[1 : 1 + count // 3].tolist())
    if UNSET in indices:
        raise StreamError("it refers to an edge or a vertex before the first one")
    return np.array(indices, np.uint32)


class _TriangleReader:
    """State of the decoder: the next new index, the last explicit one, and the latest 16 edges and vertices."""

    def __init__(self, content: bytes, position: int, table: list[int]) -> None:
        self._content, self._position, self._table = content, position, table
        self._next, self._last = 0, 0
        self._edges, self._edge = [(UNSET, UNSET)] * 16, 0
        self._vertices, self._vertex = [UNSET] * 16, 0

    def triangles(self, codes: list[int]) -> list[int]:
        """Return the indices of a triangle for each code, three each."""
        indices = list[int]()
        edges = self._edges
        try:
            for code in codes:
                if code >= 0xF0:
                    a, b, c = self._free(code)
                    edges[self._edge] = b, a
                    self._edge = self._edge + 1 & 15
                else:
                    a, b = edges[self._edge - 1 - (code >> 4) & 15]
                    c = self._third(code & 15)
                indices += (a, b, c)
                edges[self._edge] = c, b
                edges[self._edge + 1 & 15] = a, c
                self._edge = self._edge + 2 & 15
        except IndexError:
            raise StreamError(ENDS_EARLY) from None
        if self._position != len(self._content):
            raise StreamError(f"{len(self._content) - self._position} of its bytes are left")
        return indices

    def _third(self, code: int) -> int:
        """Return the vertex that forms a triangle with an edge."""
        if code == 0:
            return self._new()
        if code < 0xD:
            return self._vertices[self._vertex - 1 - code & 15]
        if code == 0xF:
            return self._explicit()
        self._last = self._last + (1 if code == 0xE else -1) & MASK
        return self._pushed(self._last)

    def _free(self, code: int) -> tuple[int, int, int]:
        """Return a triangle that shares no recent edge."""
        if code < 0xFE:
            pair, a = self._table[code & 15], self._new
        else:
            pair = self._content[self._position]
            self._position += 1
            self._next = self._next if pair else 0
            a = self._new if code == 0xFE else self._explicit
        # The vertices are found before any is added to the latest ones, and added in their order.
        vertices, first = self._vertices, self._vertex
        known = [vertices[first - part & 15] if 0 < part < 0xF else None for part in (pair >> 4, pair & 15)]
        one = a()
        two, three = (
            index if index is not None else self._new() if part == 0 else self._explicit()
            for index, part in zip(known, (pair >> 4, pair & 15))
        )
        return one, two, three

    def _new(self) -> int:
        index = self._next
        self._next = index + 1 & MASK
        return self._pushed(index)

    def _explicit(self) -> int:
        """Read an index as a difference to the last one."""
        value = shift = 0
        while True:
            byte = self._content[self._position]
            self._position += 1
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                break
            if shift == 35:
                raise StreamError("it has a number of more than 5 bytes")
        value &= MASK
        self._last = self._last + (-(value >> 1) - 1 if value & 1 else value >> 1) & MASK
        return self._pushed(self._last)

    def _pushed(self, index: int) -> int:
        self._vertices[self._vertex] = index
        self._vertex = self._vertex + 1 & 15
        return index


def decode_sequence(stream: Bytes, count: int) -> Indices:
    """Return the `count` indices of a stream of any. Raises StreamError for a damaged one."""
    check_size(len(stream), 4 * count)
    if not len(stream) or stream[0] != 0xD1:
        raise StreamError(f"its first byte is 0x{int(stream[0]) if len(stream) else 0:02x}, not 0xd1")
    if len(stream) < 1 + count + PADDING:
        raise StreamError(ENDS_EARLY)
    values = _numbers(stream[1 : len(stream) - PADDING], count)
    steps = np.where(values & 2, ~(values >> 2), values >> 2).astype(np.uint32)
    which, indices = values & 1, np.empty(count, np.uint32)
    for baseline in (0, 1):
        mine = which == baseline
        indices[mine] = np.cumsum(steps[mine], dtype=np.uint32)
    return indices


def _numbers(content: Bytes, count: int) -> Indices:
    """Return `count` numbers of seven bits per byte, each ending with a byte below 128."""
    ends = np.flatnonzero(content < 128)
    if len(ends) < count:
        raise StreamError(ENDS_EARLY)
    if len(ends) > count or ends[-1] != len(content) - 1:
        raise StreamError("some of its bytes are left")
    starts = np.concatenate([[0], ends[:-1] + 1])
    if (ends - starts).max() > 4:
        raise StreamError("it has a number of more than 5 bytes")
    place = np.arange(len(content)) - np.repeat(starts, ends - starts + 1)
    parts = (content & 127).astype(np.uint64) << (7 * place).astype(np.uint64)
    return np.add.reduceat(parts, starts).astype(np.uint32)
