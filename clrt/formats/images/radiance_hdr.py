"""Reader for Radiance images (.hdr), the most common format of environment maps, without the decoder process.

The format: G. Ward, "Real Pixels", Graphics Gems II, 1991; Radiance's file format documentation.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...scene.spectra import RGB_FROM_XYZ
from .stored_images import fits

Bytes = NDArray[np.uint8]
_HEADER = re.compile(rb"#\?[^\r\n]{0,4096}\r?\n((?:[^\r\n]{1,4096}\r?\n){0,1000}?)\r?\n")
#: Length and direction of the slow axis, then of the fast one.
_SIZE = re.compile(rb"([-+])([XY]) (\d{1,6}) ([-+])([XY]) (\d{1,6})\r?\n")
_VARIABLE = re.compile(rb"^(FORMAT|EXPOSURE|COLORCORR)[ \t]*=[ \t]*(.*?)[ \t\r]*$", re.MULTILINE)
#: Lengths of rows whose channels may be run-length encoded one by one.
SHORTEST, LONGEST = 8, 1 << 15
_BYTES = [bytes((value,)) for value in range(256)]


def read_radiance(path: Path) -> NDArray[np.float32] | None:
    """Read pixels, (h, w, 3) float32, linear Rec. 709, upright; divided by the exposures in the header.

    None for files of other formats. Raises SceneError naming a damaged file.
    """
    content = path.read_bytes() if path.suffix.lower() in (".hdr", ".pic", ".rgbe", ".xyze") else b""
    header = _HEADER.match(content)
    size = _SIZE.match(content, header.end()) if header else None
    if header is None or size is None or size[2] == size[5]:
        return None
    height, width = int(size[3]), int(size[6])
    try:
        if not height or not width or not fits(12 * height * width, len(content)):
            raise ValueError(f"{len(content)} bytes cannot contain {width}x{height} pixels")
        with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is rejected where it is used
            is_xyz, scale = _variables(header[1])
            pixels = _colors(_decoded(content, size.end(), height, width))
            if is_xyz:
                pixels = np.asarray(pixels @ RGB_FROM_XYZ.T, np.float32)
            if np.any(scale != 1):
                pixels *= scale
    except ValueError as error:
        raise SceneError(f"{path}: cannot be decoded as an image: {error}; save it again") from None
    by_axis = {size[2]: size[1], size[5]: size[4]}
    pixels = pixels if size[2] == b"Y" else pixels.transpose(1, 0, 2)
    return np.ascontiguousarray(pixels[:: -1 if by_axis[b"Y"] == b"+" else 1, :: -1 if by_axis[b"X"] == b"-" else 1])


def _variables(header: bytes) -> tuple[bool, NDArray[np.float32]]:
    """Return whether pixels are XYZ, and the factors (3,) by which they are to be multiplied. Raises ValueError."""
    is_xyz, scale = False, np.ones(3)
    for name, value in _VARIABLE.findall(header):
        if name == b"FORMAT":
            if value not in (b"32-bit_rle_rgbe", b"32-bit_rle_xyze"):
                raise ValueError(f"its pixel format {value[:40].decode('ascii', 'backslashreplace')} is unknown")
            is_xyz = value.endswith(b"xyze")
            continue
        numbers = list(map(float, value.split()))
        if len(numbers) not in (1, 3) or not all(0 < number < math.inf for number in numbers):
            raise ValueError(f"its {name.decode()} is {value[:40].decode('ascii', 'backslashreplace')}")
        scale /= numbers
    return is_xyz, scale.astype(np.float32)


def _colors(rows: Bytes) -> NDArray[np.float32]:
    """Convert rows (h, 4, w) of mantissas and exponents to colors (h, w, 3)."""
    exponents = np.arange(256)
    scale = np.ldexp(np.float32(1), np.where(exponents > 0, exponents - 136, -1000))[rows[:, 3]]
    colors = np.empty((len(rows), rows.shape[2], 3), np.float32)
    for channel in range(3):
        np.multiply(rows[:, channel], scale, out=colors[..., channel])
    return colors


def _decoded(content: bytes, start: int, height: int, width: int) -> Bytes:
    """Decode rows (h, 4, w): run-length encoded by channel, or from the first row on that is not, by pixel."""
    mark = bytes((2, 2, width >> 8, width & 255)) if SHORTEST <= width < LONGEST else b"none"
    rows = np.empty((height, 4, width), np.uint8)
    for number, row in enumerate(rows):
        if content[start : start + 4] != mark:
            pixels = _pixels(content, start, (height - number) * width)
            rows[number:] = pixels.reshape(-1, width, 4).transpose(0, 2, 1)
            break
        planes, start = _row(content, start + 4, 4 * width)
        if planes is None:
            raise ValueError(f"it ends or is damaged in row {number} of {height}")
        row.reshape(-1)[:] = np.frombuffer(planes, np.uint8)
    return rows


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


def _pixels(content: bytes, start: int, size: int) -> Bytes:
    """Decode `size` pixels, (size, 4), of which (1, 1, 1, n) repeats the one before n times, consecutive ones 256 times
    as often each. Raises ValueError if there are fewer."""
    records = np.frombuffer(content, np.uint8, (len(content) - start) // 4 * 4, start).reshape(-1, 4)[:size]
    is_run = (records[:, :3] == 1).all(axis=1)
    place = np.arange(len(records))
    pixel = np.maximum.accumulate(np.where(is_run, -1, place))
    digit = np.clip(place - pixel - 1, 0, 3)
    counts = np.where(is_run, records[:, 3].astype(np.int64) << 8 * digit, 1)
    ends = np.cumsum(counts)
    if len(records) == 0 or pixel[0] < 0 or ends[-1] < size:
        raise ValueError(f"it ends or is damaged after {0 if len(records) == 0 else ends[-1]} more pixels of {size}")
    return records[pixel[np.searchsorted(ends, np.arange(size), "right")]]
