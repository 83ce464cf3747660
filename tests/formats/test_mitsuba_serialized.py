"""Mitsuba's .serialized meshes, written here after the manual's description of the format."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from numpy.typing import NDArray

from clrt.errors import SceneError
from clrt.formats.mitsuba.serialized import read_serialized

from .test_mitsuba_xml import scene

Arrays = dict[str, NDArray[np.float64]]
FLAGS = {"normals": 1, "uv": 2, "colors": 8}
FLAT, SINGLE, DOUBLE = 0x10, 0x1000, 0x2000
TRIANGLE = {"points": np.array([(0.0, 0, 0), (1, 0, 0), (0, 1, 0)])}


def stream(arrays: Arrays, faces: NDArray[np.int64], version: int, double: bool = False, flat: bool = False) -> bytes:
    """Return the compressed part of a mesh."""
    flags = sum(flag for name, flag in FLAGS.items() if name in arrays) | (DOUBLE if double else SINGLE)
    head = struct.pack("<I", flags | (FLAT if flat else 0)) + (b"a mesh\0" if version == 4 else b"")
    head += struct.pack("<QQ", len(arrays["points"]), len(faces))
    columns = [arrays[name] for name in ("points", *FLAGS) if name in arrays]
    body = b"".join(each.astype("<f8" if double else "<f4").tobytes() for each in columns)
    return zlib.compress(head + body + faces.astype("<u4").tobytes())


def serialized(parts: list[bytes], version: int = 4) -> bytes:
    """Return a file of these meshes."""
    content, offsets = b"", []
    for part in parts:
        offsets.append(len(content))
        content += struct.pack("<HH", 0x041C, version) + part
    return content + struct.pack(f"<{len(parts)}{'Q' if version == 4 else 'I'}I", *offsets, len(parts))


def mesh(seed: int, count: int, names: list[str]) -> tuple[Arrays, NDArray[np.int64]]:
    rng = np.random.default_rng(seed)
    widths = {"points": 3, "normals": 3, "uv": 2, "colors": 3}
    arrays = {name: rng.normal(size=(count, widths[name])) for name in ("points", *names)}
    return arrays, rng.integers(count, size=(count + 2, 3))


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32), st.sampled_from([3, 4]), st.booleans(), st.sets(st.sampled_from(sorted(FLAGS))))
def test_arrays_are_read_as_written(seed: int, version: int, double: bool, names: set[str]) -> None:
    several = [mesh(seed + i, 3 + i, sorted(names)) for i in range(3)]
    content = serialized([stream(*each, version, double) for each in several], version)
    with TemporaryDirectory() as folder:
        file = Path(folder) / "a.serialized"
        file.write_bytes(content)
        read = [read_serialized(file, number) for number in range(3)]
    for (found, flat), (arrays, faces) in zip(read, several):
        assert not flat and found.name == "a"
        np.testing.assert_array_equal(found.vertices, arrays["points"].astype(np.float32))
        np.testing.assert_array_equal(found.faces, faces)
        for own, name in ((found.normals, "normals"), (found.uv, "uv")):
            assert (own is None) == (name not in names)
            np.testing.assert_array_equal(
                own if own is not None else 0, arrays.get(name, np.zeros(1)).astype(np.float32)
            )


def test_a_scene_refers_to_a_mesh_by_its_number(folder: Path) -> None:
    second = {"points": TRIANGLE["points"] + (0, 0, 5), "uv": TRIANGLE["points"][:, :2]}
    parts = [stream(TRIANGLE, np.array([[0, 1, 2]]), 4), stream(second, np.array([[0, 1, 2]]), 4, flat=True)]
    (folder / "a.serialized").write_bytes(serialized(parts))
    shape = """<shape type="serialized"><string name="filename" value="a.serialized"/>{}<transform name="to_world">
        <translate x="1"/></transform></shape>"""
    read = scene(folder, shape.format("") + shape.format('<integer name="shape_index" value="1"/>'))
    first, other = read.meshes
    np.testing.assert_array_equal(first.vertices[0], [1, 0, 0])
    np.testing.assert_array_equal(other.vertices[0], [1, 0, 5])
    assert first.normals is not None and other.normals is None and other.uv is not None
    np.testing.assert_array_equal(other.uv, TRIANGLE["points"][:, :2])  # v is not turned around


BROKEN = {
    "magic": b"\0" + serialized([stream(TRIANGLE, np.array([[0, 1, 2]]), 4)]),
    "version": serialized([stream(TRIANGLE, np.array([[0, 1, 2]]), 4)], 4).replace(b"\x1c\4\4\0", b"\x1c\4\7\0"),
    "index": serialized([stream(TRIANGLE, np.array([[0, 1, 3]]), 4)]),
    "stream": serialized([b"not zlib at all"]),
    "empty": b"",
    "counts": serialized([zlib.compress(struct.pack("<I7sQQ", SINGLE, b"a mesh\0", 2**60, 2**60))]),
    "bomb": serialized([zlib.compress(struct.pack("<I7sQQ", SINGLE, b"a mesh\0", 2**23, 1) + bytes(2**23 * 12 + 12))]),
    "name": serialized([zlib.compress(struct.pack("<I", SINGLE) + b"x" * 2**20)]),
    "number": struct.pack("<HH", 0x041C, 4) + struct.pack("<I", 2**32 - 1),
    "offset": struct.pack("<HH", 0x041C, 4) + struct.pack("<QI", 2**63, 1),
}


@pytest.mark.parametrize("kind", BROKEN)
def test_broken_files_are_one_message(folder: Path, kind: str) -> None:
    file = folder / "a.serialized"
    file.write_bytes(BROKEN[kind])
    with pytest.raises(SceneError, match=r"a\.serialized: "):
        read_serialized(file, 0)


def test_truncated_files_are_one_message(folder: Path) -> None:
    whole = serialized([stream(*mesh(1, 5, ["uv"]), 3)], 3)
    for length in range(len(whole)):
        (folder / "a.serialized").write_bytes(whole[:length])
        with pytest.raises(SceneError):
            read_serialized(folder / "a.serialized", 0)


def test_a_number_beyond_the_last_mesh(folder: Path) -> None:
    (folder / "a.serialized").write_bytes(serialized([stream(TRIANGLE, np.array([[0, 1, 2]]), 4)]))
    for number in (-1, 1):
        with pytest.raises(SceneError, match=f"shape_index {number} .*has 1 meshes"):
            read_serialized(folder / "a.serialized", number)
