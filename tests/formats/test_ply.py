"""PLY files of every kind, from a writer of the tests' own after Turk's description, and as other readers read them."""

from __future__ import annotations

import io
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings, strategies as st

from clrt.errors import SceneError
from clrt.formats.images.image_reader import linear_from_srgb
from clrt.formats.load_scene import load
from clrt.formats.models import read_mesh
from clrt.formats.ply.points import spacing_radius
from clrt.output.images import write_image
from clrt.scene.geometry.transform import unit
from clrt.scene.model import Mesh

from ..scene.shapes import volume

CODES = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d"}
ENCODINGS = ("ascii", "binary_little_endian", "binary_big_endian")
#: An element: its name, its properties as in the header, and a row of values or lists for each record.
Element = tuple[str, Sequence[str], Sequence[Sequence[Any]]]
XYZ = ("float x", "float y", "float z")
CORNERS = ("list uchar int vertex_indices",)
SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
IMPORTANT = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"


def written(elements: Sequence[Element], encoding: str, comments: Sequence[str] = (), newline: str = "\n") -> bytes:
    """Return a PLY file."""
    lines = ["ply", f"format {encoding} 1.0", *(f"comment {comment}" for comment in comments)]
    body = b""
    for name, properties, rows in elements:
        lines += [f"element {name} {len(rows)}", *(f"property {each}" for each in properties)]
        body += b"".join(record(properties, row, encoding, newline) for row in rows)
    return (newline.join([*lines, "end_header"]) + newline).encode("latin-1") + body


def record(properties: Sequence[str], row: Sequence[Any], encoding: str, newline: str) -> bytes:
    """Return one record."""
    order = "<" if encoding == "binary_little_endian" else ">"
    packed, text = b"", list[str]()
    for given_as, value in zip(properties, row, strict=True):
        words = given_as.split()
        if words[0] == "list":
            packed += struct.pack(order + CODES[words[1]], len(value))
            packed += struct.pack(f"{order}{len(value)}{CODES[words[2]]}", *value)
            text += [str(len(value)), *map(repr, value)]
        else:
            packed += struct.pack(order + CODES[words[0]], value)
            text.append(repr(value))
    return (" ".join(text) + newline).encode() if encoding == "ascii" else packed


def read(path: Path, content: bytes) -> Mesh:
    path.write_bytes(content)
    (mesh,) = read_mesh(path)
    return mesh


def area(mesh: Mesh) -> float:
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2).astype(float)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 2


def corners(mesh: Mesh, values: np.ndarray) -> np.ndarray:
    """Positions and other values of all corners, in an order that does not depend on how vertices are numbered."""
    rows = np.column_stack([mesh.vertices, values])[mesh.faces].reshape(len(mesh.faces), -1)
    return rows[np.lexsort(rows.T)]


@st.composite
def polygon_files(draw: st.DrawFn) -> tuple[bytes, np.ndarray, list[list[int]]]:
    """A file of convex polygons, with other properties and elements between, and its vertices and faces."""
    encoding, newline = draw(st.sampled_from(ENCODINGS)), draw(st.sampled_from(["\n", "\r\n"]))
    seed = draw(st.integers(0, 2**32 - 1))
    random = np.random.default_rng(seed)
    faces: list[list[int]] = []
    points: list[list[float]] = []
    for size in draw(st.lists(st.integers(3, 7), min_size=1, max_size=12)):
        angles = np.sort(random.random(size)) * 2 * np.pi
        faces.append(list(range(len(points), len(points) + size)))
        points += np.column_stack([np.cos(angles), np.sin(angles), np.full(size, len(faces))]).tolist()
    place = draw(st.sampled_from(["float", "double"]))
    count, index = draw(st.sampled_from(["uchar", "int", "ushort"])), draw(st.sampled_from(["int", "uint", "ushort"]))
    label = draw(st.booleans())
    vertex = ("vertex", ["uchar flags", *(f"{place} {axis}" for axis in "xyz")], [(7, *point) for point in points])
    lists = [f"list {count} {index} {draw(st.sampled_from(['vertex_index', 'vertex_indices']))}"]
    face = (
        "face",
        ["list uchar float weights", *lists, "double quality"] if label else lists,
        [([0.5] * (i % 3), each, 2.5) if label else (each,) for i, each in enumerate(faces)],
    )
    extra = ("edge", ["int a", "list uchar short b"], [(1, [2] * (i % 4)) for i in range(draw(st.integers(0, 3)))])
    elements: list[Element] = [vertex, extra, face, extra] if draw(st.booleans()) else [extra, vertex, face]
    return written(elements, encoding, ["made in Zürich", "x"], newline), np.array(points), faces


@settings(max_examples=60, deadline=None)
@given(polygon_files())
def test_polygons_of_any_size(tmp_path_factory: pytest.TempPathFactory, case: tuple[bytes, Any, Any]) -> None:
    """The fans of random polygons have the polygons' vertices and, by the shoelace formula, their areas."""
    content, points, faces = case
    mesh = read(tmp_path_factory.mktemp("ply") / "a.ply", content)
    np.testing.assert_array_equal(mesh.vertices, points.astype(np.float32))
    sizes = [len(face) - 2 for face in faces]
    first = np.cumsum([0, *sizes])
    for face, start, end in zip(faces, first, first[1:]):
        assert set(mesh.faces[start:end].ravel()) == set(face)
        x, y = points[face, 0], points[face, 1]
        shoelace = abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2
        part = Mesh(mesh.vertices, mesh.faces[start:end])
        assert area(part) == pytest.approx(shoelace, abs=1e-5)


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("tail", [b"", b"\0\x17made by hand"])
def test_trimesh_reads_the_same(encoding: str, tail: bytes, tmp_path: Path) -> None:
    """Both read the same triangles, normals and colors; clrt also if there are bytes after the last record."""
    random = np.random.default_rng(5)
    rows = [
        (*p, *n, *c)
        for p, n, c in zip(
            random.random((9, 3)).tolist(),
            random.normal(size=(9, 3)).tolist(),
            random.integers(0, 256, (9, 3)).tolist(),
        )
    ]
    vertex = ("vertex", [*XYZ, "float nx", "float ny", "float nz", "uchar red", "uchar green", "uchar blue"], rows)
    face = ("face", CORNERS, [([0, 1, 2],), ([3, 4, 5],), ([8, 7, 6],)])
    content = written([vertex, face], encoding)
    theirs: Any = trimesh.load(io.BytesIO(content), file_type="ply", process=False)
    ours = read(tmp_path / "a.ply", content + tail)
    np.testing.assert_allclose(ours.vertices, theirs.vertices, atol=1e-7)
    np.testing.assert_array_equal(ours.faces, theirs.faces)
    assert ours.normals is not None and ours.colors is not None
    np.testing.assert_allclose(ours.normals, unit(theirs.vertex_normals), atol=1e-6)
    linear = linear_from_srgb((theirs.visual.vertex_colors[:, :3] / 255).astype(np.float32))
    np.testing.assert_allclose(ours.colors, linear, atol=1e-6)


@pytest.mark.parametrize("names", ["s t", "u v", "texture_u texture_v", "texture_s texture_t"])
@pytest.mark.parametrize("encoding", ENCODINGS[:2])
def test_texture_coordinates_of_vertices(names: str, encoding: str, tmp_path: Path) -> None:
    """v points up in PLY files, and down here."""
    properties = [*XYZ, *(f"float {name}" for name in names.split())]
    rows = [(*p, p[0] * 0.5, p[1] * 0.25) for p in SQUARE]
    mesh = read(
        tmp_path / "a.ply", written([("vertex", properties, rows), ("face", CORNERS, [([0, 1, 2, 3],)])], encoding)
    )
    np.testing.assert_array_equal(mesh.uv, [(0, 1), (0.5, 1), (0.5, 0.75), (0, 0.75)])


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("pairs", [True, False])
def test_seams_split_vertices(encoding: str, pairs: bool, tmp_path: Path) -> None:
    """Coordinates of faces' corners keep their values; only vertices on the seam between faces are split."""
    faces = [[0, 1, 2], [0, 2, 3], [0, 3, 4, 5]]
    uv = [[0.0, 0.0, 1.0, 0.0, 1.0, 1.0], [0.5, 0.0, 1.0, 1.0, 0.0, 0.5], []]
    points = [*SQUARE, (-1, 1, 0), (-1, 0, 0)]
    if pairs:
        properties = ["list uchar float texcoord", *CORNERS]
        rows: list[Any] = list(zip(uv, faces))
    else:
        properties = [*CORNERS, "list uchar float u", "list uchar float v"]
        rows = [(face, each[::2], each[1::2]) for face, each in zip(faces, uv)]
    content = written([("vertex", XYZ, points), ("face", properties, rows)], encoding)
    mesh = read(tmp_path / "a.ply", content)
    assert mesh.uv is not None
    expected = np.array([*uv[:2], [0.0] * 6, [0.0] * 6]).reshape(-1, 2)
    np.testing.assert_array_equal(
        mesh.uv[mesh.faces].reshape(-1, 2), np.column_stack([expected[:, 0], 1 - expected[:, 1]])
    )
    fans = [*faces[:2], [0, 3, 4], [0, 4, 5]]
    np.testing.assert_array_equal(mesh.vertices[mesh.faces], np.array(points, np.float32)[fans])
    assert len(mesh.vertices) == 6 + 2  # vertices 0 and 3 twice


def test_textures(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Files named in comments are used, several of them by the faces' numbers; a missing one is a warning."""
    for name, value in (("a b.png", 1.0), ("b.png", 0.0)):
        write_image(tmp_path / name, np.full((2, 2, 3), value, np.float32))
    properties, rows = ["list uchar float texcoord", "int texnumber", *CORNERS], []
    for number, face in enumerate([[0, 1, 2], [0, 2, 3], [1, 2, 3]]):
        rows.append(([0.0, 0.0, 1.0, 0.0, 1.0, 1.0], number, face))
    elements: list[Element] = [("vertex", XYZ, SQUARE), ("face", properties, rows)]
    single = read(tmp_path / "one.ply", written(elements, "ascii", ["TextureFile a b.png"]))
    (texture,) = single.material.textures()
    assert (texture.picture.texels == 255).all()
    assert single.material_name == "a b.png" and not caplog.text
    comments = ["TextureFile C:\\models\\a b.png", "TextureFile b.png", "TextureFile lost.png"]
    (tmp_path / "many.ply").write_bytes(written(elements, "binary_little_endian", comments))
    meshes = read_mesh(tmp_path / "many.ply")
    assert [len(mesh.faces) for mesh in meshes] == [1, 1, 1]
    textures = [texture for mesh in meshes for texture in mesh.material.textures()]
    texels = [texture.picture.texels.max(axis=(0, 1)).tolist() for texture in textures]
    assert texels == [[255] * 4, [0, 0, 0, 255]]
    assert not meshes[2].material.textures() and "lost.png: no such picture file" in caplog.text


@pytest.mark.parametrize(
    "kind, white", [("uchar", 255), ("ushort", 65535), ("float", 1.0), ("double", 1.0), ("int", 255)]
)
@pytest.mark.parametrize("encoding", ENCODINGS)
def test_colors_of_every_type(kind: str, white: float, encoding: str, tmp_path: Path) -> None:
    """Of vertices and of faces; white is the greatest value of unsigned types, and 1 for floats."""
    properties = [f"{kind} {name}" for name in ("red", "green", "blue")]
    fifth = linear_from_srgb(np.full(1, 0.2, np.float32))[0]
    rows = (np.eye(3) * white + (np.eye(3)[[1, 2, 0]] * (white / 5))).astype(type(white)).tolist()
    expected = np.eye(3) + np.eye(3)[[1, 2, 0]] * fifth
    vertices = ("vertex", [*XYZ, *properties], [(*p, *row) for p, row in zip(SQUARE, rows)])
    mesh = read(tmp_path / "a.ply", written([vertices, ("face", CORNERS, [([0, 1, 2],)])], encoding))
    assert mesh.colors is not None
    np.testing.assert_allclose(mesh.colors, expected, atol=1e-6)
    faces = ("face", [*CORNERS, *properties], [([0, 1, 2, 3], *rows[0]), ([0, 1, 2], *rows[2])])
    mesh = read(tmp_path / "b.ply", written([("vertex", XYZ, SQUARE), faces], encoding))
    assert mesh.colors is not None
    np.testing.assert_allclose(mesh.colors[mesh.faces][:, 0], expected[[0, 0, 2]], atol=1e-6)


@pytest.mark.parametrize("alphas, kept", [((255, 51, 0), True), ((255, 255, 255), False), ((0, 0, 0), False)])
def test_alpha(alphas: tuple[int, ...], kept: bool, tmp_path: Path) -> None:
    properties = [*XYZ, *(f"uchar {name}" for name in ("red", "green", "blue", "alpha"))]
    vertices = ("vertex", properties, [(*p, 255, 255, 255, alpha) for p, alpha in zip(SQUARE, alphas)])
    mesh = read(tmp_path / "a.ply", written([vertices, ("face", CORNERS, [([0, 1, 2],)])], "ascii"))
    expected = np.ones((3, 4))
    expected[:, 3] = np.array(alphas) / 255
    assert mesh.colors is not None
    np.testing.assert_allclose(mesh.colors, expected if kept else expected[:, :3], atol=1e-7)


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_triangle_strips(encoding: str, tmp_path: Path) -> None:
    """A cube from one strip of 14 vertices, then a triangle after −1, encloses 8 with all faces outwards."""
    order = [3, 2, 7, 6, 4, 2, 1, 3, 0, 7, 5, 4, 0, 1]
    points = [(1, 1, 1), (-1, 1, 1), (-1, 1, -1), (1, 1, -1), (-1, -1, -1), (1, -1, 1), (-1, -1, -1), (1, -1, -1)]
    points[4], points[6] = (-1, -1, 1), (-1, -1, -1)
    strips = ("tristrips", ["list int int vertex_indices"], [([*order, -1, 0, 1, 2, 2, 2],), ([0, 1],)])
    mesh = read(tmp_path / "a.ply", written([("vertex", XYZ, points), strips], encoding))
    assert len(mesh.faces) == 13
    assert abs(volume(mesh.vertices, mesh.faces[:12])) == pytest.approx(8)


def test_points_become_spheres(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """With their radii and colors; the volume is that of spheres, from below, since the vertices are on them."""
    properties = [*XYZ, "float radius", "uchar red", "uchar green", "uchar blue"]
    rows = [
        (0, 0, 0, 1.0, 255, 0, 0),
        (5, 0, 0, 2.0, 0, 0, 255),
        (9, 9, 9, 0.0, 1, 1, 1),
        (float("nan"), 0, 0, 1.0, 1, 1, 1),
    ]
    mesh = read(tmp_path / "a.ply", written([("vertex", properties, rows)], "ascii"))
    assert 0.97 * 9 < volume(mesh.vertices, mesh.faces) / (4 / 3 * np.pi) < 9
    assert mesh.colors is not None and mesh.normals is not None
    near = mesh.vertices[:, 0] < 2.5
    radii = np.linalg.norm(mesh.vertices - np.where(near[:, None], [0, 0, 0], [5, 0, 0]), axis=1)
    np.testing.assert_allclose(radii, np.where(near, 1, 2), rtol=1e-6)
    np.testing.assert_array_equal(mesh.colors, np.where(near[:, None], [1, 0, 0], [0, 0, 1]))
    assert "a.ply: ignored: 2 points without a finite position and a positive radius" in caplog.text
    load(tmp_path / "a.ply")


@pytest.mark.parametrize("dimensions", [1, 2, 3])
def test_spacing_of_points(dimensions: int) -> None:
    """The spheres of a line, a square and a cube of points nearly touch, whatever the scale."""
    line = np.arange({1: 400, 2: 40, 3: 12}[dimensions])
    grid = np.stack(np.meshgrid(*[line] * dimensions), axis=-1).reshape(-1, dimensions) * 0.25
    points = np.zeros((len(grid), 3))
    points[:, :dimensions] = grid
    for scale in (1e-12, 1.0, 1e12):
        assert 0.35 < spacing_radius(points * scale) / (0.25 * scale) < 0.75
    twice = np.concatenate([points, points])
    assert spacing_radius(twice) == spacing_radius(points)


def test_missing_points_of_scans(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Points that are NaN are accepted unless faces use them; faces with fewer than three corners are counted."""
    nan, inf = float("nan"), float("inf")
    vertices = ("vertex", XYZ, [*SQUARE, (nan, nan, nan), (-inf, 0, 0)])
    faces = [([0, 1, 2],), ([0, 1],), ([],), ([0, 2, 3],)]
    for encoding in ENCODINGS:
        mesh = read(tmp_path / "a.ply", written([vertices, ("face", CORNERS, faces)], encoding))
        assert area(mesh) == 1 and np.isfinite(mesh.vertices).all()
    assert "a.ply: ignored: 2 faces with fewer than 3 corners" in caplog.text
    content = written([vertices, ("face", CORNERS, faces)], "ascii")
    assert area(read(tmp_path / "a.ply", content.replace(b"nan", b"-1.#IND").replace(b"-inf", b"-nan(ind)"))) == 1
    with pytest.raises(SceneError, match=r"vertices\[4\] = \[nan, nan, nan\] is not finite"):
        read(tmp_path / "a.ply", written([vertices, ("face", CORNERS, [([0, 1, 4],)])], "ascii"))


WRONG = {
    "no magic": (b"PLY\n", 'it does not begin with a line "ply"'),
    "no end": (b"ply\nformat ascii 1.0\n", 'its header has no line "end_header"'),
    "no format": (b"ply\nelement vertex 0\nend_header\n", "its header has no line that names the format"),
    "unknown type": (
        b"ply\nformat ascii 1.0\nelement vertex 3\nproperty real x\nend_header\n",
        'the line "property real x"',
    ),
    "middle endian": (b"ply\nformat binary_middle_endian 1.0\nend_header\n", 'line "format binary_middle_endian 1.0"'),
    "twice": (
        b"ply\nformat ascii 1.0\nelement vertex 3\nproperty int x\nproperty int x\nend_header\n",
        'property "x" twice',
    ),
    "no coordinates": (b"ply\nformat ascii 1.0\nelement face 0\nend_header\n", "its vertices have no x, y and z"),
    "a word": (IMPORTANT.encode() + b"end_header\n0 0 0\n1 one 0\n0 1 0\n", "it ends or is damaged in vertex 1 of 3"),
    "huge": (
        IMPORTANT.replace("3", "9" * 12, 1).encode() + b"end_header\n0 0 0\n",
        "damaged in vertex 1 of 999999999999",
    ),
    "list": (
        IMPORTANT.encode()
        + b"element face 2\nproperty list uchar int vertex_index\nend_header\n0 0 0 1 0 0 0 1 0 3 0 1 2 1e99 0",
        "it ends or is damaged in face 1 of 2",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_malformed_files(name: str, tmp_path: Path) -> None:
    content, sentence = WRONG[name]
    (tmp_path / "a.ply").write_bytes(content)
    with pytest.raises(SceneError) as caught:
        read_mesh(tmp_path / "a.ply")
    (problem,) = caught.value.problems
    assert problem.startswith(f"{tmp_path / 'a.ply'}: ") and sentence in problem


@settings(max_examples=60, deadline=None)
@given(polygon_files(), st.data())
def test_truncated_files(
    tmp_path_factory: pytest.TempPathFactory, case: tuple[bytes, Any, Any], data: st.DataObject
) -> None:
    """A file that ends anywhere before its last face is an error that says so."""
    content, _, faces = case
    path = tmp_path_factory.mktemp("ply") / "a.ply"
    whole = len(read(path, content).faces)
    path.write_bytes(content[: data.draw(st.integers(0, len(content)))])
    try:
        (mesh,) = read_mesh(path)
    except SceneError as error:
        assert "cannot be read as PLY: " in error.problems[0]
    else:
        assert len(mesh.faces) == whole
