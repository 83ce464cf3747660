"""Decoder of attribute streams (mode 0, versions 0 and 1).

A stream stores each byte of the elements apart, as differences to the element before, in groups of 16. A loop over the
groups finds where each begins; all else is done for all of them at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .streams import ENDS_EARLY, StreamError, check_size

Bytes = NDArray[np.uint8]
GROUP = 16
#: Bits per difference that a group's two header bits select: in version 0, and by the control mode in version 1.
WIDTHS = {0xA0: [(0, 2, 4, 8)], 0xA1: [(0, 1, 2, 4), (1, 2, 4, 8)]}
#: Control modes without header bits: all differences are 0, or stored as bytes.
ZEROS, LITERAL = 2, 3
#: Bytes beyond the end of a stream that may be looked at before its end is noticed: a block of one byte.
BEYOND = 1024
#: The smallest tail of a stream, by its version.
TAILS = {0xA0: 32, 0xA1: 24}


def decode_attributes(stream: Bytes, count: int, stride: int) -> Bytes:
    """Return the elements (count, stride) of a stream. Raises StreamError for a damaged one."""
    check_size(len(stream), count * stride)
    version = int(stream[0]) if len(stream) else 0
    if version not in WIDTHS:
        raise StreamError(f"its first byte is 0x{version:02x}, not 0xa0 or 0xa1")
    channels = stride // 4 if version == 0xA1 else 0
    end = len(stream) - max(TAILS[version], stride + channels)
    if end < 1:
        raise StreamError(ENDS_EARLY)
    tail = stream[len(stream) - stride - channels :]
    groups = _Groups(stream[:end], version, stride)
    blocks = [groups.block(size) for size in _block_sizes(count, stride)]
    if groups.position != end:
        raise StreamError(ENDS_EARLY if groups.position > end else f"{end - groups.position} of its bytes are left")
    deltas = _elements(groups.deltas(), blocks, count, stride)
    return _summed(deltas, tail[:stride], tail[stride:] if channels else np.zeros(stride // 4, np.uint8))


def _block_sizes(count: int, stride: int) -> list[int]:
    most = min(8192 // stride & ~15, 256)
    return [most] * (count // most) + [count % most] * (count % most > 0)


class _Groups:
    """Groups of a stream in order: where each begins, and its bits per difference, 0 for zeros."""

    def __init__(self, stream: Bytes, version: int, stride: int) -> None:
        self._data = np.concatenate([stream, np.zeros(BEYOND, np.uint8)])
        self._content = self._data.tobytes()
        self._widths, self._stride, self._version = WIDTHS[version], stride, version
        self._sizes = {width: _sizes(self._data, width) for width in (1, 2, 4)}
        self._sizes |= {0: bytes(len(self._data)), 8: bytes([GROUP]) * len(self._data)}
        self._starts, self._bits = list[int](), list[int]()
        self.position = 1

    def block(self, size: int) -> int:
        """Find the groups of a block of `size` elements, and return how many each byte has."""
        count = -(-size // GROUP)
        for control in self._controls():
            if self.position > len(self._content) - BEYOND:
                raise StreamError(ENDS_EARLY)
            if control == ZEROS:
                self._starts += [0] * count
                self._bits += [0] * count
            elif control == LITERAL:
                self._starts += range(self.position, self.position + GROUP * count, GROUP)
                self._bits += [8] * count
                self.position += size
            else:
                self._read(count, self._widths[control])
        return count

    def _controls(self) -> list[int]:
        """Return the control mode of each byte of the elements in the block that begins here."""
        if self._version == 0xA0:
            return [0] * self._stride
        header = self._content[self.position : self.position + self._stride // 4]
        self.position += self._stride // 4
        return [byte >> shift & 3 for byte in header for shift in (0, 2, 4, 6)]

    def _read(self, count: int, widths: tuple[int, ...]) -> None:
        header, position = self.position, self.position + -(-count // 4)
        content, sizes = self._content, [self._sizes[width] for width in widths]
        for number in range(count):
            mode = content[header + (number >> 2)] >> 2 * (number & 3) & 3
            self._starts.append(position)
            self._bits.append(widths[mode])
            position += sizes[mode][position]
        self.position = position

    def deltas(self) -> Bytes:
        """Return the differences as stored, (groups, 16)."""
        starts, bits = np.array(self._starts, np.int64), np.array(self._bits, np.uint8)
        deltas = np.zeros((len(starts), GROUP), np.uint8)
        for width in (1, 2, 4, 8):
            which = np.flatnonzero(bits == width)
            deltas[which] = _unpacked(self._data, starts[which], width)
        return deltas


def _sizes(data: Bytes, width: int) -> bytes:
    """Return the size of a group of this width at each position: its packed values, and a byte for each that is all
    ones."""
    packed = 2 * width
    full = np.unpackbits(data).reshape(-1, width).all(axis=1).reshape(len(data), -1).sum(axis=1)
    before = np.concatenate([[0], np.cumsum(full)])
    sizes = packed + before[packed:] - before[: len(before) - packed]
    return bytes(sizes.astype(np.uint8)) + bytes(packed)


def _unpacked(data: Bytes, starts: NDArray[np.int64], width: int) -> Bytes:
    """Return the values (n, 16) of groups of one width."""
    packed = data[starts[:, None] + np.arange(2 * width)]
    if width == 8:
        return np.asarray(packed)
    bits = np.unpackbits(packed, axis=1, bitorder="little" if width == 1 else "big").reshape(-1, GROUP, width)
    values = np.packbits(bits, axis=2)[..., 0] >> (8 - width)
    full = values == (1 << width) - 1
    places = starts[:, None] + 2 * width + np.cumsum(full, axis=1) - 1
    return np.where(full, data[np.where(full, places, 0)], values)


def _elements(deltas: Bytes, blocks: list[int], count: int, stride: int) -> Bytes:
    """Return differences (groups, 16), by block, byte and group, as elements (count, stride). blocks: groups of each,
    equal but for the last."""
    first = len(blocks) - 1
    split = first * blocks[0] * stride
    whole = deltas[:split].reshape(first, stride, blocks[0] * GROUP).transpose(0, 2, 1).reshape(-1, stride)
    last = deltas[split:].reshape(stride, -1).T
    return np.concatenate([whole[: first * blocks[0] * GROUP], last])[:count]


def _summed(deltas: Bytes, baseline: Bytes, modes: Bytes) -> Bytes:
    """Return the elements from their differences, each four bytes by their channel mode."""
    decoded = np.empty_like(deltas)
    for channel, mode in enumerate(modes.tolist()):
        kind, turned = mode & 15, mode >> 4
        if kind > 2 or (kind < 2 and turned):
            raise StreamError(f"its channel mode 0x{mode:02x} is unknown")
        part = slice(4 * channel, 4 * channel + 4)
        dtype = np.dtype(("<u1", "<u2", "<u4")[kind])
        steps = np.ascontiguousarray(deltas[:, part]).view(dtype)
        start = np.ascontiguousarray(baseline[part]).view(dtype)
        if kind == 2:
            turned_back = steps >> np.uint32(turned) | steps << np.uint32(-turned & 31)
            values = np.bitwise_xor.accumulate(turned_back if turned else steps, axis=0) ^ start
        else:
            signed = steps >> 1 ^ (-(steps & 1)).astype(dtype)
            values = np.cumsum(signed, axis=0, dtype=dtype) + start
        decoded[:, part] = np.ascontiguousarray(values, dtype).view(np.uint8)
    return decoded
