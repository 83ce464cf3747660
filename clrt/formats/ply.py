"""Reader for the common PLY files, those of triangles only, in a few array operations.

trimesh reads the others; its import alone takes longer than reading such a file of a hundred thousand triangles.
The format: G. Turk, "The PLY Polygon File Format", 1994.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

_END = b"\nend_header\n"
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_TYPES = {
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
    "float32": "f4",
    "float64": "f8",
}
#: Left to trimesh: with texture coordinates it splits vertices, and it scales colors by their type.
_TEXTURE = {"u", "v", "s", "t", "texture_u", "texture_v"}
_COLORS = {"red", "green", "blue"}


Records = np.ndarray[tuple[int], np.dtype[np.void]]


def plain_ply(path: Path) -> dict[str, Any] | None:
    """Return trimesh's keyword arguments: vertices (n, 3), faces (m, 3), and vertex_normals (n, 3) if there are any.

    None unless it is an undamaged file of vertices without texture coordinates or colors, followed by faces, each with
    three indices and no other list.
    """
    records = ply_records(path)
    if records is None:
        return None
    vertices, faces = records
    names = set(vertices.dtype.names or ())
    if names & _TEXTURE or _COLORS <= names:
        return None
    parts = {
        "vertices": np.column_stack([vertices[axis] for axis in ("x", "y", "z")]),
        "faces": faces["corners list"]["indices"].astype(np.int64),
    }
    if {"nx", "ny", "nz"} <= names:
        parts["vertex_normals"] = np.column_stack([vertices[axis] for axis in ("nx", "ny", "nz")])
    return parts


def ply_records(path: Path) -> tuple[Records, Records] | None:
    """Return vertices with at least x, y and z, and faces, whose indices are ["corners list"]["indices"], (m, 3).

    None unless it is an undamaged file of only these two, in this order, with faces of three indices and no other list.
    """
    content = path.read_bytes()
    start = content.find(_END) + len(_END)
    try:
        (vertex_count, vertex), (face_count, face) = _elements(content[:start].decode().splitlines())
        if b"\nformat ascii " in content[:start]:
            content, start = np.array(content[start:].split(), np.float64).tobytes(), 0
    except (ValueError, KeyError, IndexError):
        return None
    middle = start + vertex_count * vertex.itemsize
    if (
        not {"x", "y", "z"} <= set(vertex.names or ())
        or "corners list" not in (face.names or ())
        or min(vertex_count, face_count) < 1
        or len(content) != middle + face_count * face.itemsize
    ):
        return None
    vertices = np.frombuffer(content, vertex, vertex_count, start)
    faces = np.frombuffer(content, face, face_count, middle)
    return None if np.any(faces["corners list"]["count"] != 3) else (vertices, faces)


def _elements(header: list[str]) -> list[tuple[int, np.dtype[np.void]]]:
    """Return the count and the record dtype of vertices and of faces; in text files all values are float64.

    Raises ValueError, KeyError or IndexError for an unsupported header.
    """
    magic, encoding, *lines = (line.split() for line in header if not line.startswith(("comment", "obj_info")))
    order = _ORDERS[encoding[1]]
    kinds = {name: order + kind if order else "f8" for name, kind in _TYPES.items()}
    names: list[str] = []
    counts: list[int] = []
    records: list[list[Any]] = []
    for line in lines[:-1]:
        match line:
            case ["element", name, count]:
                names.append(name)
                counts.append(int(count))
                records.append([])
            case ["property", "list", count, index, "vertex_indices" | "vertex_index"]:
                records[-1].append(("corners list", [("count", kinds[count]), ("indices", kinds[index], 3)]))
            case ["property", kind, name]:
                records[-1].append((name, kinds[kind]))
            case _:
                raise ValueError(f"not plain: {line}")
    if magic != ["ply"] or names != ["vertex", "face"]:
        raise ValueError("not plain")
    return [(count, np.dtype(record)) for count, record in zip(counts, records)]
