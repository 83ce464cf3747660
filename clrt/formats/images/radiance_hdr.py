"""Reader for Radiance images (.hdr), the most common format of environment maps, without the decoder process.

The format: G. Ward, "Real Pixels", Graphics Gems II, 1991; Radiance's file format documentation.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

#: Row 0 on top and columns from the left, the only order in use; widths that run-length encoding supports.
_HEADER = re.compile(rb"#\?(?:RADIANCE|RGBE)\n(?:[^\n]{0,4096}\n){0,1000}?\n-Y (\d{1,6}) \+X (\d{1,5})\n")
_SCALED = re.compile(rb"^(?:EXPOSURE|COLORCORR|FORMAT=32-bit_rle_xyze)", re.MULTILINE)
_BYTES = [bytes((value,)) for value in range(256)]


def read_radiance(path: Path) -> NDArray[np.float32] | None:
    """Read pixels, (h, w, 3) float32, linear; None unless it is an undamaged file of run-length encoded RGB rows."""
    content = path.read_bytes() if path.suffix.lower() == ".hdr" else b""
    header = _HEADER.match(content)
    if header is None or _SCALED.search(header[0]):
        return None
    height, width = int(header[1]), int(header[2])
    # A run encodes at most 127 bytes in two.
    if not 8 <= width < 2**15 or height * (4 + 8 * -(-width // 127)) > len(content) - header.end():
        return None
    rows = np.empty((height, 4, width), np.uint8)
    start, mark = header.end(), bytes((2, 2, width >> 8, width & 255))
    for row in rows:
        if content[start : start + 4] != mark:
            return None
        planes, start = _row(content, start + 4, 4 * width)
        if planes is None:
            return None
        row.reshape(-1)[:] = np.frombuffer(planes, np.uint8)
    exponents = np.arange(256)
    scale = np.ldexp(np.float32(1), np.where(exponents > 0, exponents - 136, -1000))[rows[:, 3]]
    colours = np.empty((height, width, 3), np.float32)
    for channel in range(3):
        np.multiply(rows[:, channel], scale, out=colours[..., channel])
    return colours


def _row(content: bytes, start: int, size: int) -> tuple[bytes | None, int]:
    """Decode a row of `size` bytes, and return the next row's start; None if the bytes decode to more or fewer."""
    parts, missing = [], size
    try:
        while missing > 0:
            count = content[start]
            first = start + 1
            if count > 128:
                count -= 128
                parts.append(_BYTES[content[first]] * count)
                start += 2
            else:
                start = first + count
                parts.append(content[first:start])
            missing -= count or size + 1
    except IndexError:
        return None, start
    planes = b"".join(parts)
    return (planes if len(planes) == size else None), start
