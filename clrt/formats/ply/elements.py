"""The records of a PLY file, in array operations."""

from __future__ import annotations

import struct
from array import array
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ..polygons import ranges
from ..text_numbers import numbers
from .header import Element, Header, Property, parse_header

Array = NDArray[Any]
Content = bytes | memoryview
#: numpy's types in the notation of `struct`.
CODES = {"i2": "h", "u2": "H", "i4": "i", "u4": "I", "i8": "q", "u8": "Q", "f4": "f", "f8": "d"}


class Lists(NamedTuple):
    """A list property: the length of each list (n,), and the items of all lists in one array."""

    counts: Array
    items: Array


class Columns(NamedTuple):
    """Properties of one element by name, which are scalars (n,) or lists; kinds: the types that the header names."""

    number: int
    scalars: dict[str, Array]
    lists: dict[str, Lists]
    kinds: Mapping[str, str] = {}


class _Truncated(Exception):
    """The file ends within the record of this number."""


def read_elements(content: bytes, wanted: Collection[str]) -> tuple[Header, dict[str, Columns]]:
    """Return the header, and the wanted elements that the file has. What follows the last of them is not read.

    Raises SceneError for a malformed header and for a file that ends too early.
    """
    header = parse_header(content)
    elements, start, order = header.elements, header.size, header.orders[0]
    records: Content = content
    if not order:  # text is read like a binary file of doubles
        values = numbers(content.replace(b"\r", b"\n"), start).values
        records, start, order = values.view(np.uint8).data, 0, "="
        elements = [each._replace(properties=list(map(_as_double, each.properties))) for each in elements]
    last = max((i for i, element in enumerate(elements) if element.name in wanted), default=-1)
    found = {}
    for element, given in zip(elements[: last + 1], header.elements):
        try:
            columns, start = _records(records, start, element, order)
        except _Truncated as end:
            raise SceneError(
                f"cannot be read as PLY: it ends or is damaged in {element.name} {end} of {element.number}; "
                "export the model again"
            ) from None
        found[element.name] = columns._replace(kinds={each.name: each.kind for each in given.properties})
    return header, {name: columns for name, columns in found.items() if name in wanted}


def _as_double(given: Property) -> Property:
    return given._replace(kind="f8", count_kind=given.count_kind and "f8")


def _records(content: Content, start: int, element: Element, order: str) -> tuple[Columns, int]:
    """Return an element's properties, and where the next element starts. Raises _Truncated."""
    if element.number == 0 or not element.properties:
        nothing = np.zeros(0)
        return Columns(
            0,
            {each.name: nothing for each in element.properties if not each.count_kind},
            {each.name: Lists(nothing, nothing) for each in element.properties if each.count_kind},
        ), start
    first, _ = _uneven(content, start, element._replace(number=1), order)
    sizes = [int(each.counts[0]) for each in first.lists.values()]
    return _even(content, start, element, order, sizes) or _uneven(content, start, element, order)


def _even(
    content: Content, start: int, element: Element, order: str, sizes: Sequence[int]
) -> tuple[Columns, int] | None:
    """Read records whose lists all have the lengths of those in the first record, `sizes`; None for others."""
    lengths = iter(sizes)
    widths = [next(lengths) if each.count_kind else 1 for each in element.properties]
    record = sum(width * _size(each.kind) + _size(each.count_kind) for each, width in zip(element.properties, widths))
    if start + element.number * record > len(content):
        return None
    columns, place = Columns(element.number, {}, {}), start

    def column(kind: str, width: int) -> Array:
        nonlocal place
        here, place = place, place + width * _size(kind)
        if width == 1:
            return np.ndarray(element.number, order + kind, content, here, record)
        block = np.ndarray(element.number, f"V{width * _size(kind)}", content, here, record)
        return block.copy().view(order + kind)  # three times as fast as a copy of single items

    for each, width in zip(element.properties, widths):
        if each.count_kind is None:
            columns.scalars[each.name] = column(each.kind, 1)
            continue
        counts = column(each.count_kind, 1)
        if np.any(counts != width):
            return None
        columns.lists[each.name] = Lists(counts, column(each.kind, width))
    return columns, start + element.number * record


def _uneven(content: Content, start: int, element: Element, order: str) -> tuple[Columns, int]:
    """Read records whose lists have any lengths. Raises _Truncated."""
    place, end = _starts(content, start, element, order)
    columns = Columns(element.number, {}, {})
    for each in element.properties:
        if each.count_kind is None:
            columns.scalars[each.name] = _values(content, order + each.kind, place)
            place = place + _size(each.kind)
            continue
        kind = "u1" if _size(each.count_kind) == 1 else order + each.count_kind
        counts = _values(content, kind, place).astype(np.int64)
        place = place + _size(each.count_kind)
        offsets = np.repeat(place, counts) + ranges(np.zeros_like(counts), counts) * _size(each.kind)
        columns.lists[each.name] = Lists(counts, _values(content, order + each.kind, offsets))
        place = place + counts * _size(each.kind)
    return columns, end


def _starts(content: Content, start: int, element: Element, order: str) -> tuple[NDArray[np.int64], int]:
    """Return at which byte each record starts (n,), and at which the last one ends. Raises _Truncated."""
    lists: list[tuple[int, Callable[[int], int], int, int]] = []
    gap = 0
    for each in element.properties:
        if each.count_kind is None:
            gap += _size(each.kind)
        else:
            lists.append((gap, _counter(content, order, each.count_kind), _size(each.count_kind), _size(each.kind)))
            gap = 0
    starts, place, last = array("q"), start, len(content)
    for number in range(element.number):
        starts.append(place)
        try:
            for before, count, own, size in lists:
                place += before
                place += own + size * count(place)
        except (IndexError, struct.error, ValueError, OverflowError):
            raise _Truncated(number) from None
        place += gap
        if not starts[-1] < place <= last:
            raise _Truncated(number)
    return np.frombuffer(starts, np.int64), place


def _counter(content: Content, order: str, kind: str) -> Callable[[int], int]:
    """Return a function that reads a list's length at a byte; it may raise IndexError, ValueError and the like."""
    if _size(kind) == 1:
        return content.__getitem__  # also for "char", which some writers mean to be unsigned
    unpack = struct.Struct(order + CODES[kind]).unpack_from
    return lambda place: int(unpack(content, place)[0])


def _values(content: Content, kind: str, offsets: NDArray[np.int64]) -> Array:
    """Return the values of a type that start at these bytes."""
    if len(offsets) == 0:
        return np.zeros(0, kind)
    every: Array = np.ndarray((len(content) - np.dtype(kind).itemsize + 1,), kind, content, strides=(1,))
    return every[offsets]


def _size(kind: str | None) -> int:
    return int(kind[1]) if kind else 0
