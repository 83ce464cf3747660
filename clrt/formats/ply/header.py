"""The header of a PLY file: its encoding, and the elements and properties that follow."""

from __future__ import annotations

import re
from typing import NamedTuple

from ...errors import SceneError
from ...file_names import printable

#: Byte order of each encoding, as numpy writes it; empty for text.
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
KINDS = {
    "char": "i1",
    "uchar": "u1",
    "short": "i2",
    "ushort": "u2",
    "int": "i4",
    "uint": "u4",
    "float": "f4",
    "double": "f8",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "int64": "i8",
    "uint64": "u8",
    "float32": "f4",
    "float64": "f8",
}


class Property(NamedTuple):
    """Property of an element. kind: its type, such as "f4"; count_kind: that of the counts if it is a list."""

    name: str
    kind: str
    count_kind: str | None = None


class Element(NamedTuple):
    """Element: `number` records of the same properties."""

    name: str
    number: int
    properties: list[Property]


class Header(NamedTuple):
    """Header. orders: one value of ORDERS; comments: the text of each; size: in bytes."""

    orders: list[str]
    elements: list[Element]
    comments: list[str]
    size: int


def parse_header(content: bytes) -> Header:
    """Parse the header of a file's content; lines end as its first one does. Raises SceneError for a malformed one."""
    magic = re.match(rb"ply[ \t]*(\r\n|\n|\r)", content)
    if magic is None:
        raise _malformed('it does not begin with a line "ply"')
    newline = rb"\r" if magic[1] == b"\r" else rb"\r?\n"
    end = re.compile(rb"[\r\n]end_header[ \t]*(?:" + newline + rb"|\Z)").search(content)
    if end is None:
        raise _malformed('its header has no line "end_header"')
    text = content[magic.end() : end.start()].decode("utf-8", "surrogateescape")
    header = Header([], [], [], end.end())
    for line in re.split(r"\r\n|\n|\r", text):
        _parse_line(line, header)
    if not header.orders:
        raise _malformed("its header has no line that names the format")
    return header


def _parse_line(line: str, header: Header) -> None:
    """Add what a line says to the header."""
    orders, elements, comments, _ = header
    match line.split():
        case [] | ["obj_info", *_]:
            pass
        case ["comment", *_]:
            comments.append(line.strip()[len("comment") :].strip())
        case ["format", encoding, _] if encoding in ORDERS:
            orders.append(ORDERS[encoding])
        case ["element", name, count] if count.isdecimal():
            elements.append(Element(name, int(count), []))
        case ["property", "list", count, kind, name] if elements and count in KINDS and kind in KINDS:
            elements[-1].properties.append(Property(name, KINDS[kind], KINDS[count]))
        case ["property", kind, name] if elements and kind in KINDS:
            elements[-1].properties.append(Property(name, KINDS[kind]))
        case _:
            raise _malformed(f'its header has the line "{printable(line.strip())[:60]}"')
    if elements and len(elements[-1].properties) > len({each.name for each in elements[-1].properties}):
        raise _malformed(f'its header names the property "{printable(elements[-1].properties[-1].name)[:60]}" twice')


def _malformed(fault: str) -> SceneError:
    return SceneError(f"cannot be read as PLY: {fault}; export the model again")
