"""The lines of Wavefront OBJ files in array operations, a block of lines at a time."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...file_names import printable
from ..digit_words import DIGITS, MARGIN, Bytes, Flags, Floats, Ints, digits, padded, runs, words_at
from ..plain_text import plain_text
from ..regular_numbers import decimals, fields
from ..text_numbers import floats, per_line, table
from .regular_faces import regular_faces

#: Bytes that are parsed at a time.
BLOCK = 1 << 20
#: Lines of numbers: how many they must have, and how many are used; those of a vertex may include a color.
TABLES = {"v": (3, 6), "vt": (1, 2), "vn": (3, 3)}
NEWLINE, SPACE, HASH, PLUS, MINUS, SLASH, ZERO = b"\n #+-/0"
INDENT = re.compile(rb"^ +", re.MULTILINE)
LARGEST_INDEX = np.iinfo(np.int32).max


class Corners(NamedTuple):
    """Corners of polygons. indices: (n, 3) int32, of vertex, texture coordinates and normal, from 1, or 0 for none,
    by column in memory. relative: whether they count from the block's first one, (n, 3), or None if none do. sizes:
    corners per polygon."""

    indices: NDArray[np.int32]
    relative: Flags | None
    sizes: Ints


@dataclass
class Block:
    """Contents of a block. tables: numbers by key, (n, k), NaN where a line has fewer; counts: of their rows.
    bad_faces: those that are malformed; the first one in words. materials: names, each with the number of faces before
    it."""

    tables: dict[str, Floats]
    counts: list[int]
    corners: Corners
    bad_faces: int
    fault: str
    materials: list[tuple[int, str]]
    libraries: list[str]


def block_ranges(path: Path) -> Iterator[tuple[int, int]]:
    """Yield the start and the end of each block of the file: whole lines, with those that continue them."""
    with path.open("rb") as file:
        end, size = 0, os.fstat(file.fileno()).st_size
        while end < size:
            start = end
            file.seek(start + BLOCK)
            while file.readline().rstrip(b"\r\n").endswith(b"\\"):
                pass
            end = min(file.tell(), size)
            yield start, end


def read_block(path: Path, start: int, end: int) -> Block:
    """Read and parse a block. Raises SceneError for malformed lines of numbers."""
    with path.open("rb") as file:
        file.seek(start)
        text = plain_text(file.read(end - start), first=start == 0)
    lines = _Lines(text)
    if lines.starting_with("").any():
        lines = _Lines(INDENT.sub(b"", text))
    tables = {key: _parse_table(lines, key) for key in TABLES}
    corners, bad, fault = _parse_faces(lines)
    good = lines.starting_with("f").astype(np.int64)
    good[good > 0] -= bad
    before = np.cumsum(good)
    materials = [(int(before[line]), name) for line, name in lines.named("usemtl")]
    counts = list(map(len, tables.values()))
    return Block(tables, counts, corners, int(bad.sum()), fault, materials, [name for _, name in lines.named("mtllib")])


class _Lines:
    """Lines of text without indents."""

    def __init__(self, text: bytes) -> None:
        self._text = padded(text)
        self._ends = np.flatnonzero(self._text == NEWLINE)
        self._starts = np.concatenate([[MARGIN], self._ends + 1])[:-1]
        self._words = words_at(self._text, self._starts)

    def starting_with(self, key: str) -> Flags:
        """Return which lines start with this word, of at most 7 characters, and a space."""
        start = f"{key} ".encode()
        mask, wanted = (1 << 8 * len(start)) - 1, int.from_bytes(start, "little")
        return np.asarray(self._words & mask == wanted)

    def text(self, key: str) -> Bytes:
        """Return the lines that start with this word, between margins of any bytes; not to be changed."""
        return self._extract(np.flatnonzero(self.starting_with(key)))[0]

    def numbers(self, key: str) -> Bytes:
        """Return the lines that start with this word, with spaces in place of the word and of comments."""
        text, starts = self._extract(np.flatnonzero(self.starting_with(key)))
        text = text.copy()
        text[:MARGIN] = text[-MARGIN:] = SPACE
        for letter in range(len(key)):
            text[starts + letter] = SPACE
        if (hashes := text == HASH).any():
            places = np.arange(len(text))
            latest_hash = np.maximum.accumulate(np.where(hashes, places, -1))
            text[latest_hash > np.maximum.accumulate(np.where(text == NEWLINE, places, 0))] = SPACE
        return text

    def _extract(self, lines: Ints) -> tuple[Bytes, Ints]:
        """Return the text of these lines between margins, and where each starts in it."""
        if not len(lines):
            return padded(b""), lines
        starts, stops = self._starts[lines], self._ends[lines] + 1
        if lines[-1] - lines[0] + 1 == len(lines):
            text = self._text[starts[0] - MARGIN : stops[-1] + MARGIN]
            return text, starts - (starts[0] - MARGIN)
        chosen = np.zeros(len(self._ends) + 2, np.bool_)
        chosen[lines + 1] = chosen[[0, -1]] = True
        widths = np.concatenate([[MARGIN], self._ends + 1 - self._starts, [MARGIN]])
        return self._text[np.repeat(chosen, widths)], MARGIN + np.cumsum(stops - starts) - (stops - starts)

    def named(self, key: str) -> Iterator[tuple[int, str]]:
        """Yield the lines that start with this word: their numbers, and the rest as text."""
        for line in np.flatnonzero(self.starting_with(key)).tolist():
            rest = self._text[self._starts[line] + len(key) : self._ends[line]].tobytes()
            yield line, rest.decode("utf-8", "surrogateescape").strip()

    def counts_before(self, key: str) -> Ints:
        """Return how many lines of each table, (n, 3), come before each of the lines that start with this word."""
        chosen = self.starting_with(key)
        return np.stack([np.cumsum(self.starting_with(each))[chosen] for each in TABLES], axis=1)


def _parse_table(lines: _Lines, key: str) -> Floats:
    """Return the numbers on lines, (n, k), NaN where a line has fewer than k."""
    least, most = TABLES[key]
    text = lines.text(key)
    alike = fields(text, text <= SPACE)
    if alike is not None and (width := len(alike.separators) - 1) >= least:
        if (found := decimals(text, *alike.without_first()[:2])) is not None:
            return found.reshape(-1, width)[:, :most]
    text = lines.numbers(key)
    values, starts, malformed = floats(text)
    counts = per_line(text, starts)
    odd = np.concatenate([np.searchsorted(np.cumsum(counts), malformed, "right"), np.flatnonzero(counts < least)])
    if odd.size:
        line = _line(text, int(odd[0]))
        hint = "write points in decimals" if "," in line else "repair the file"
        raise SceneError(f'a line "{key} {line}" needs {least} numbers; {hint}')
    return table(values, counts, int(min(counts.max(initial=least), most)))


def _parse_faces(lines: _Lines) -> tuple[Corners, Flags, str]:
    """Return the corners of the faces, one per line, which lines are malformed, and what is wrong with the first."""
    if (alike := regular_faces(lines.text("f"))) is not None:
        _, count, size = alike.shape
        return Corners(alike.reshape(3, -1).T, None, np.full(count, size)), np.zeros(count, np.bool_), ""
    text = lines.numbers("f")
    starts, ends = runs(text - ZERO < 10)
    lengths, heads = ends - starts, starts
    values, _ = digits(text, ends, np.minimum(lengths, DIGITS))
    strange = np.flatnonzero((text - SLASH > 10) & (text > SPACE))
    if len(strange):
        heads = starts - np.isin(text[starts - 1], (PLUS, MINUS))
        strange = np.setdiff1d(strange, heads[heads < starts])
    slash = text[heads - 1] == SLASH
    columns, odd = _columns(text, heads, ends, slash)
    if lengths.max(initial=0) > DIGITS or values.max(initial=0) > LARGEST_INDEX:
        odd |= (lengths > DIGITS) | (values > LARGEST_INDEX)
    no_index = np.searchsorted(np.flatnonzero(text == NEWLINE), np.concatenate([starts[odd], strange]))
    sizes = per_line(text, starts[~slash])
    bad = sizes < 3
    bad[no_index] = True
    indices = _by_corner(values, slash, columns, odd)
    relative = None
    if (negative := (heads < starts) & (text[starts - 1] == MINUS) & (values > 0)).any():
        relative = _by_corner(negative, slash, columns, odd) > 0
        before = np.repeat(lines.counts_before("f"), sizes, axis=0)
        indices = np.where(relative, before + 1 - indices, indices).astype(np.int32)
    fault = _fault(text, int(bad.argmax()), no_index) if bad.any() else ""
    return without(bad, Corners(indices, relative, sizes)), bad, fault


def _columns(text: Bytes, heads: Ints, ends: Ints, slash: Flags) -> tuple[NDArray[np.uint8], Flags]:
    """Return which of a corner's three indices each number is, and which are preceded by something else than a space
    or by one or two slashes after a number. slash: whether there is one before the number, which starts at `heads`."""
    double = slash & (text[heads - 2] == SLASH)
    after_slash = _shifted(slash)
    third = double | (slash & after_slash)
    odd = ~slash & (text[heads - 1] > SPACE)
    odd |= slash & (heads - np.concatenate([[0], ends[:-1]])[: len(ends)] != 1 + double)
    odd |= slash & after_slash & (double | _shifted(double | after_slash))
    return slash.view(np.uint8) + third.view(np.uint8), odd


def _by_corner(values: NDArray[Any], slash: Flags, columns: NDArray[np.uint8], odd: Flags) -> NDArray[np.int32]:
    """Return numbers by corner and column, (n, 3), 0 where there are none."""
    rows = np.zeros((len(slash) - np.count_nonzero(slash), 3), np.int32)
    same = len(values) // max(len(rows), 1)
    if (
        same * len(rows) == len(values)
        and not odd.any()
        and (columns.reshape(-1, max(same, 1)) == columns[:same]).all()
    ):
        rows[:, columns[:same]] = values.reshape(-1, max(same, 1))
    else:
        places = 3 * (np.cumsum(~slash) - 1) + columns
        rows.reshape(-1)[places[~odd]] = values[~odd]
    return rows


def _shifted(flags: Flags) -> Flags:
    """Return the flag of the element before each one."""
    return np.concatenate([[False], flags[:-1]])[: len(flags)]


def _fault(text: Bytes, line: int, no_index: Ints) -> str:
    """Return what is wrong with the face on this line."""
    face = f'"f {_line(text, line)}"'
    if line in no_index:
        return f"a face has a corner that is not an index: {face}"
    return f"a face {face} has fewer than 3 corners"


def without(bad: Flags, corners: Corners) -> Corners:
    """Return the corners of the other polygons."""
    if not bad.any():
        return corners
    kept = np.repeat(~bad, corners.sizes)
    relative = None if corners.relative is None else corners.relative[kept]
    return Corners(corners.indices[kept], relative, corners.sizes[~bad])


def _line(text: Bytes, number: int) -> str:
    """Return the beginning of a line, for messages."""
    return printable(" ".join(text.tobytes().split(b"\n")[number].decode("utf-8", "surrogateescape").split()))[:60]
