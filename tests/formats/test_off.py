"""OFF files and their variants, after Geomview's manual, and as trimesh reads them."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings, strategies as st

from clrt.errors import SceneError
from clrt.formats.images.image_reader import linear_from_srgb
from clrt.formats.models import read_mesh
from clrt.scene.geometry.transform import unit
from clrt.scene.model import Mesh

SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
FACES = "3 0 1 2\n3 0 2 3\n"


def rows(*columns: object) -> str:
    return "".join(" ".join(map(str, row)) + "\n" for row in np.column_stack([np.array(each) for each in columns]))


def read(path: Path, content: str | bytes) -> Mesh:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    (mesh,) = read_mesh(path)
    return mesh


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 50), st.sampled_from(["OFF\n", "OFF ", "OFF # a name\n# more\n\n"]), st.integers(0, 2**32 - 1))
def test_as_trimesh_reads_them(tmp_path_factory: pytest.TempPathFactory, count: int, head: str, seed: int) -> None:
    random = np.random.default_rng(seed)
    points, faces = random.normal(size=(count + 2, 3)), random.integers(0, count + 2, (count, 3))
    content = f"{head}{count + 2} {count} 0\n" + rows(points) + rows(np.full(count, 3), faces)
    mesh = read(tmp_path_factory.mktemp("off") / "a.off", content)
    theirs: Any = trimesh.load(io.StringIO(content), file_type="off", process=False)
    np.testing.assert_array_equal(mesh.vertices, theirs.vertices.astype(np.float32))
    np.testing.assert_array_equal(mesh.faces, theirs.faces)


@pytest.mark.parametrize("head", ["OFF4 2 0", "4 2 0", "OFF\n4 2", "\n# x\nOFF\n\n4 2 5 # y", "off\r\n4 2 0\r"])
def test_first_lines(head: str, tmp_path: Path) -> None:
    mesh = read(tmp_path / "a.off", f"{head}\n" + rows(SQUARE) + "# faces\n" + FACES)
    np.testing.assert_array_equal(mesh.vertices, SQUARE)
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize("white", [255, 1.0])
@pytest.mark.parametrize("alpha", [True, False])
def test_colors_of_vertices(white: float, alpha: bool, tmp_path: Path) -> None:
    colors = np.array([[1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 1, 0.2], [1, 1, 1, 1]])[:, : 3 + alpha] * white
    mesh = read(tmp_path / "a.off", "COFF\n4 2 0\n" + rows(SQUARE, colors) + FACES)
    assert mesh.colors is not None
    np.testing.assert_allclose(mesh.colors, colors / white, atol=1e-6)


def test_colors_of_faces(tmp_path: Path) -> None:
    """With three or four numbers; a color map's index, and a face without a color, have the default one."""
    mesh = read(
        tmp_path / "a.off", "OFF\n4 4 0\n" + rows(SQUARE) + "3 0 1 2 255 0 0\n3 0 2 3 0 0 255 255\n3 0 1 3 7\n3 1 2 3\n"
    )
    assert mesh.colors is not None
    plain = linear_from_srgb(np.full(3, 0.9063, np.float32))
    np.testing.assert_allclose(mesh.colors[mesh.faces][:, 1], np.array([[1, 0, 0], [0, 0, 1], plain, plain]))
    np.testing.assert_allclose(plain, 0.8, atol=1e-4)
    np.testing.assert_array_equal(
        mesh.vertices[mesh.faces], np.array(SQUARE, np.float32)[[[0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3]]]
    )


def test_variants(tmp_path: Path) -> None:
    """Normals, colors and texture coordinates follow a position in this order; a fourth coordinate divides it."""
    normals = np.array([[0, 0, 1], [1, 0, 0], [0, 3, 4], [0, 0, -1]], float)
    colors, uv = np.eye(4)[:, :3], np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) / 4
    mesh = read(
        tmp_path / "a.off", "STCN4OFF\n4 2 0\n" + rows(np.array(SQUARE) * 2, np.full(4, 2), normals, colors, uv) + FACES
    )
    np.testing.assert_array_equal(mesh.vertices, SQUARE)
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.normals, unit(normals), atol=1e-7)
    np.testing.assert_array_equal(mesh.colors, colors)
    np.testing.assert_array_equal(mesh.uv, np.column_stack([uv[:, 0], 1 - uv[:, 1]]))
    mesh = read(tmp_path / "b.off", "NOFF 4 2 0\n" + rows(SQUARE, normals) + FACES)
    assert mesh.normals is not None and mesh.colors is None and mesh.uv is None


WRONG = {
    "word": ("PLY\n3 1 0\n", 'it does not begin with "OFF"'),
    "binary": ("OFF BINARY\n\0\0\0\3", 'of the kind "OFF BINARY", which is not supported'),
    "dimensions": ("nOFF\n2\n3 1 0\n", 'of the kind "nOFF", which is not supported'),
    "no counts": ("OFF\n", "has no line with its numbers"),
    "short": ("OFF\n4 2 0\n" + rows(SQUARE) + "3 0 1 2\n", "counts 4 vertices and 2 faces, but has 5 lines"),
    "huge": ("OFF\n1e300 99999999999999 0\n0 0 0\n", "lines of them"),
    "not a number": ("OFF\n4 2 0\n" + rows(SQUARE).replace("1", "one") + FACES, 'has "one" in place of a number'),
    "ragged": ("OFF\n4 1 0\n0 0\n" + rows(SQUARE[1:]) + "3 0 1 2\n", "different numbers of values"),
    "few": ("COFF\n4 2 0\n" + rows(SQUARE) + FACES, "vertices of 3 values, fewer than its first line names"),
    "face": ("OFF\n4 1 0\n" + rows(SQUARE) + "4 0 1 2\n", "a face with fewer values than it counts"),
    "index": ("OFF\n4 1 0\n" + rows(SQUARE) + "3 0 1 4\n", "faces[0] uses vertex 4"),
}


@pytest.mark.parametrize("name", WRONG)
def test_malformed_files(name: str, tmp_path: Path) -> None:
    content, sentence = WRONG[name]
    with pytest.raises(SceneError) as caught:
        read(tmp_path / "a.off", content)
    assert len(caught.value.problems) == 1 and sentence in caught.value.problems[0]
