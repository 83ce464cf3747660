"""Reader for STL files, text and binary, with the colors of Materialise Magics and of VisCAM.

The format: "StereoLithography Interface Specification", 3D Systems, 1989.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from ..file_names import printable
from ..scene.editing import free_name
from ..threads import in_parallel
from .digit_words import Bytes, Ints, padded, runs, words_at
from .referenced_files import name_of
from .seams import PLAIN
from .text_numbers import floats_at, reuse_memory

log = logging.getLogger(__name__)
#: Sizes in bytes of a binary file's header with the number of facets, and of a facet: normal, corners, attribute.
HEADER, FACET = 84, 50
#: A text file has a vertex among its first bytes.
START = 1 << 16
#: The words of a facet, as nearly all programs write it; 0 in place of numbers.
WORDS = b"facet normal 0 0 0 outer loop vertex 0 0 0 vertex 0 0 0 vertex 0 0 0 endloop endfacet".split()
COORDINATES = [place for place, word in enumerate(WORDS) if word == b"0"][3:]
#: Bytes that are parsed at a time.
CHUNK = 1 << 18
#: A line that begins a solid, up to a facet on the same line.
_SOLID = re.compile(rb"solid[^\r\n]*?(?=\s+facet\s+normal\s|[\r\n]|\Z)")
#: Programs that print numbers of a fixed width may leave no space before the first one.
_VERTEX = re.compile(rb"vertex(?:\s+|(?=[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?\s))(\S+)\s+(\S+)\s+(\S+)")


def parse_stl(path: Path) -> dict[str, Any]:
    """Read an STL file, with trimesh's names of arrays: vertices (3m, 3), faces (m, 3), vertex_colors (3m, 3) or None;
    those of a text file's solids are in `geometry`, by name. +Z is up, as in CAD.

    Raises SceneError for malformed vertices.
    """
    content = path.read_bytes()
    if _is_binary(content):
        return _binary(path, content)
    if b"vertex" not in content[:START]:
        content = content.lower()
    solids: dict[str, dict[str, Any]] = {}
    for name, limits in _solids(content):
        if len(corners := _corners(path, content, *limits)):
            solids[free_name(printable(name) or name_of(path), solids)] = _soup(corners)
    return {"geometry": solids, "up": "z"}


def _is_binary(content: bytes) -> bool:
    """Return whether a file is binary; its header may begin like a text file."""
    if len(content) >= HEADER and len(content) == HEADER + FACET * int.from_bytes(content[80:HEADER], "little"):
        return True
    return b"vertex" not in content[:START].lower()


def _soup(corners: NDArray[np.floating]) -> dict[str, Any]:
    return {"vertices": corners, "faces": np.arange(len(corners), dtype=np.int32).reshape(-1, 3)}


def _binary(path: Path, content: bytes) -> dict[str, Any]:
    """Return the facets of a binary file: as many as its header counts, or those that are there."""
    count, stored = int.from_bytes(content[80:HEADER], "little"), max(len(content) - HEADER, 0) // FACET
    if stored == 0:
        return {"geometry": {}}
    if not 0 < count <= stored:
        log.warning("%s: its header counts %d facets; the %d that it contains are read", path, count, stored)
        count = stored
    corners = np.ndarray(count, "V36", content, HEADER + 12, FACET).copy().view("<f4").reshape(-1, 3)
    attributes = np.ndarray(count, "<u2", content, HEADER + 48, FACET)
    colors = _colors(content[:80], attributes)
    return _soup(corners) | {"up": "z", "vertex_colors": None if colors is None else np.repeat(colors, 3, axis=0)}


def _colors(header: bytes, attributes: NDArray[np.uint16]) -> NDArray[np.float32] | None:
    """Return the facets' colors (m, 3), from 0 to 1, or None if they have none.

    Five bits per channel. In Magics' files, whose header has the color of the whole, the highest bit stands for that
    color, and red is in the lowest bits; in others, it marks facets with a color, and blue is in the lowest bits.
    """
    marked, start = attributes >= 0x8000, header.find(b"COLOR=") + len(b"COLOR=")
    is_magics = start >= len(b"COLOR=") and start + 3 <= len(header)
    own = ~marked & attributes.any() if is_magics else marked
    if not is_magics and not own.any():
        return None
    plain = np.frombuffer(header, np.uint8, 3, start) / np.float32(255) if is_magics else np.full(3, PLAIN, np.float32)
    shifts = np.array([0, 5, 10] if is_magics else [10, 5, 0], np.uint16)
    colors = (attributes[:, None] >> shifts & 31) / np.float32(31)
    return np.where(own[:, None], colors, plain)


def _solids(text: bytes) -> Iterator[tuple[str, tuple[int, int]]]:
    """Yield the name of each solid and where the text of its facets starts and stops, also of facets before the first
    solid."""
    name, start, place = "", 0, 0
    # Facets have no s, and single bytes are found faster.
    while (place := text.find(b"s", place)) >= 0 and (place := text.find(b"solid", place)) >= 0:
        is_end = text[max(place - 3, 0) : place] == b"end"
        yield name, (start, place - 3 * is_end)
        line = _SOLID.match(text, place)
        assert line is not None
        words = b"" if is_end else line[0][len(b"solid") :].strip()
        name, start = words.decode("utf-8", "surrogateescape"), line.end()
        place = start
    yield name, (start, len(text))


def _corners(path: Path, text: bytes, start: int, stop: int) -> NDArray[np.float32]:
    """Return the corners of a solid's triangles, (3m, 3)."""
    reuse_memory()
    parts = in_parallel(lambda limits: _regular(path, text[slice(*limits)]), _chunks(text, start, stop))
    return np.concatenate([np.zeros((0, 3), np.float32), *parts])


def _chunks(text: bytes, start: int, stop: int) -> Iterator[tuple[int, int]]:
    """Yield the start and the stop of pieces of the text that end after a facet."""
    while start < stop:
        end = text.rfind(b"endfacet", start, min(start + CHUNK, stop))
        end = text.find(b"endfacet", start, stop) if end < 0 else end
        end = stop if end < 0 else end + len(b"endfacet")
        yield start, end
        start = end


def _regular(path: Path, text: bytes) -> NDArray[np.float32]:
    """Return the corners in a text of facets, each with a normal and three vertices."""
    given = padded(text)
    starts, ends = runs(given > ord(" "))
    if len(starts) % len(WORDS):
        return _irregular(path, text)
    starts, ends = starts.reshape(-1, len(WORDS)), ends.reshape(-1, len(WORDS))
    for place, word in enumerate(WORDS):
        if word != b"0" and not _are(word, given, starts[:, place], ends[:, place]):
            return _irregular(path, text)
    values, malformed = floats_at(given, starts[:, COORDINATES].ravel(), ends[:, COORDINATES].ravel())
    return _irregular(path, text) if malformed.size else _single(values).reshape(-1, 3)


def _are(word: bytes, text: Bytes, starts: Ints, ends: Ints) -> bool:
    """Return whether this word, of at most eight letters, is at all places."""
    same = words_at(text, starts) << 64 - 8 * len(word) == int.from_bytes(word, "little") << 64 - 8 * len(word)
    return bool((same & (ends - starts == len(word))).all())


def _single(values: NDArray[np.float64]) -> NDArray[np.float32]:
    with np.errstate(over="ignore", under="ignore"):  # those that are not finite are reported
        return values.astype(np.float32)


def _irregular(path: Path, text: bytes) -> NDArray[np.float32]:
    """Return the corners in any text: of each facet with three vertices or more, a fan."""
    corners, ignored = list[tuple[float, ...]](), 0
    for facet in text.split(b"endfacet"):
        points = list(map(_point, _VERTEX.findall(facet)))
        ignored += 0 < len(points) < 3
        for second, third in zip(points[1:], points[2:]):
            corners += [points[0], second, third]
    if ignored:
        log.warning("%s: ignored: %d facets with fewer than 3 vertices", path, ignored)
    return _single(np.array(corners, np.float64)).reshape(-1, 3)


def _point(words: tuple[bytes, ...]) -> tuple[float, ...]:
    try:
        return tuple(map(float, words))
    except ValueError:
        given = b" ".join(words)[:60].decode("utf-8", "backslashreplace")
        raise SceneError(f'a vertex "{given}" needs 3 numbers; repair the file') from None
