"""STL files, text and binary, as other programs write them."""

from __future__ import annotations

import io
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings, strategies as st

from clrt.errors import SceneError
from clrt.formats.images.image_reader import linear_from_srgb
from clrt.formats.models import read_mesh
from clrt.scene.model import Mesh

TRIANGLES = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0], [0, 1, 0.5]]], np.float32)


def binary(
    triangles: np.ndarray, header: bytes = b"x", attributes: list[int] | None = None, count: int | None = None
) -> bytes:
    facets = np.zeros(len(triangles), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    facets["corners"] = triangles
    if attributes is not None:
        facets["attribute"] = attributes
    number = len(triangles) if count is None else count
    return header.ljust(80, b"\0") + struct.pack("<I", number) + facets.tobytes()


def text(triangles: np.ndarray, name: str = "a", form: str = "%.9g", indent: str = "  ", newline: str = "\n") -> str:
    lines = [f"solid {name}"]
    for corners in triangles.tolist():
        lines += [f"{indent}facet normal 0 0 {form % 1}", f"{indent}outer loop"]
        lines += [f"{indent}vertex {' '.join(form % value for value in corner)}" for corner in corners]
        lines += [f"{indent}endloop", f"{indent}endfacet"]
    return newline.join([*lines, f"endsolid {name}", ""])


def read(path: Path, content: bytes | str) -> Mesh:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    (mesh,) = read_mesh(path)
    return mesh


def check(path: Path, content: bytes | str, triangles: np.ndarray = TRIANGLES) -> None:
    mesh = read(path, content)
    np.testing.assert_array_equal(mesh.vertices[mesh.faces], triangles)


@settings(max_examples=40, deadline=None)
@given(
    st.integers(1, 300),
    st.sampled_from(["%.9g", "%.9e", "%+.9E", "%.12f"]),
    st.sampled_from(["", "  ", "\t"]),
    st.sampled_from(["\n", "\r\n", "\r"]),
    st.sampled_from([str, str.upper, str.title]),
    st.integers(0, 2**32 - 1),
)
def test_text_as_trimesh_reads_it(
    tmp_path_factory: pytest.TempPathFactory, count: int, form: str, indent: str, newline: str, case: object, seed: int
) -> None:
    """Every layout gives the triangles that were written; trimesh agrees where lines end with line feeds."""
    triangles = np.random.default_rng(seed).normal(size=(count, 3, 3)).astype(np.float32)
    if form.endswith("f"):
        triangles = triangles.round(3)
    content = case(text(triangles, "part", form, indent, newline))  # type: ignore[operator]
    path = tmp_path_factory.mktemp("stl") / "a.stl"
    check(path, content, triangles)
    if newline == "\n":
        theirs: Any = trimesh.load(io.BytesIO(content.encode()), file_type="stl", process=False)
        np.testing.assert_array_equal(theirs.triangles.astype(np.float32), triangles)


ODD: dict[str, Callable[[str], str]] = {
    "no first line": lambda whole: whole.partition("\n")[2],
    "a comment first": lambda whole: "# exported by hand\n\n" + whole,
    "a byte order mark": lambda whole: "\ufeff" + whole,
    "no last line": lambda whole: whole.rpartition("endsolid")[0],
    "no end of the last facet": lambda whole: whole.rpartition("endfacet")[0],
    "on one line": lambda whole: " ".join(whole.split()),
    "words apart": lambda whole: whole.replace("facet normal", "facet   normal").replace("outer loop", "outer\tloop"),
    "no normals": lambda whole: whole.replace("facet normal 0 0 1", "facet"),
    "Windows' NaN": lambda whole: whole.replace("normal 0 0 1", "normal -nan(ind) -1.#IND 1"),
    "a name of keywords": lambda whole: whole.replace("solid a", "solid solid facet vertex endloop"),
    "no space before signs": lambda whole: whole.replace("vertex 0", "vertex-0"),
    "no name": lambda whole: whole.replace("solid a", "solid"),
}


@pytest.mark.parametrize("name", ODD)
def test_odd_text(name: str, tmp_path: Path) -> None:
    check(tmp_path / "a.stl", ODD[name](text(TRIANGLES)))


def test_solids_of_a_text_file_are_meshes(tmp_path: Path) -> None:
    parts = [text(TRIANGLES[:1], "lid"), text(TRIANGLES[:0], "empty"), text(TRIANGLES, "lid"), text(TRIANGLES, "")]
    (tmp_path / "a.stl").write_text("\n".join(parts))
    meshes = read_mesh(tmp_path / "a.stl")
    assert [len(mesh.faces) for mesh in meshes] == [1, 2, 2]
    assert len({mesh.name for mesh in meshes}) == 3 and meshes[0].name == "lid" and meshes[2].name == "a"


def test_facets_of_other_sizes(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """A facet of four vertices is a fan; one of two is ignored; a word that is not a number is named."""
    vertices = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    lines = [f"vertex {x} {y} {z}" for x, y, z in vertices]
    facet = "facet normal 0 0 1\nouter loop\n{}\nendloop\nendfacet\n"
    content = "solid a\n" + facet.format("\n".join(lines)) + facet.format("\n".join(lines[:2])) + "endsolid a\n"
    check(tmp_path / "a.stl", content, np.array(vertices, np.float32)[[[0, 1, 2], [0, 2, 3]]])
    assert "a.stl: ignored: 1 facets with fewer than 3 vertices" in caplog.text
    with pytest.raises(SceneError, match='a vertex "1 one 0" needs 3 numbers'):
        read(tmp_path / "a.stl", content.replace("1 1 0", "1 one 0"))


@pytest.mark.parametrize("header", [b"", b"solid part facet", b"solid\n vertex 1 2 3"])
@pytest.mark.parametrize("tail", [b"", b"\0\0", b"made by somebody " * 9])
def test_binary_with_any_header_and_tail(header: bytes, tail: bytes, tmp_path: Path) -> None:
    if tail and b"vertex" in header:
        header = b"solid"
    check(tmp_path / "a.stl", binary(TRIANGLES, header) + tail)


@pytest.mark.parametrize("count", [0, 3, 2**32 - 1])
def test_wrong_counts(count: int, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Facets that are there are read if the header counts none or more."""
    check(tmp_path / "a.stl", binary(TRIANGLES, count=count))
    assert f"its header counts {count} facets; the 2 that it contains are read" in caplog.text


def test_colors_of_viscam(tmp_path: Path) -> None:
    """The highest bit marks a color, blue in the lowest bits; other facets keep the default material's color."""
    red, green = 0x8000 | 31 << 10, 0x8000 | 15 << 5
    mesh = read(tmp_path / "a.stl", binary(np.repeat(TRIANGLES, 2, 0)[:3], attributes=[red, green, 31]))
    assert mesh.colors is not None
    half = linear_from_srgb(np.array([15 / 31], np.float32))[0]
    expected = [[1, 0, 0], [0, half, 0], [0.8, 0.8, 0.8]]
    np.testing.assert_allclose(mesh.colors, np.repeat(expected, 3, 0), atol=1e-4)
    assert read(tmp_path / "b.stl", binary(TRIANGLES, attributes=[5, 0])).colors is None


def test_colors_of_magics(tmp_path: Path) -> None:
    """The header has a color, which the highest bit stands for; others have red in the lowest bits."""
    header = b"COLOR=" + bytes([0, 255, 0, 255]) + b",MATERIAL=" + bytes(12)
    three = np.repeat(TRIANGLES, 2, 0)[:3]
    mesh = read(tmp_path / "a.stl", binary(three, header, [31, 31 << 10, 0x8000 | 31]))
    assert mesh.colors is not None
    np.testing.assert_array_equal(mesh.colors, np.repeat([[1, 0, 0], [0, 0, 1], [0, 1, 0]], 3, 0))
    mesh = read(tmp_path / "b.stl", binary(three, header))  # a color for the whole alone
    np.testing.assert_array_equal(mesh.colors, np.tile([0, 1, 0], (9, 1)))


@settings(max_examples=60, deadline=None)
@given(st.binary(max_size=300), st.booleans(), st.integers(0, 200))
def test_damaged_files(tmp_path_factory: pytest.TempPathFactory, junk: bytes, as_text: bool, place: int) -> None:
    """They load or raise a SceneError."""
    whole = text(TRIANGLES).encode() if as_text else binary(TRIANGLES)
    path = tmp_path_factory.mktemp("stl") / "a.stl"
    path.write_bytes(whole[:place] + junk + whole[place:])
    try:
        read_mesh(path)
    except SceneError as error:
        assert str(path) in error.problems[0]
