from __future__ import annotations

import logging
import struct
from pathlib import Path

import numpy as np
import pytest

from clrt.errors import SceneError
from clrt.formats.models import read_mesh
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Mesh

from ..scene.shapes import cube, icosphere, volume

VERTICES, FACES = icosphere(1)


def text_rows(array: np.ndarray) -> list[str]:
    return [" ".join(str(value) for value in row) for row in array.tolist()]


def obj(path: Path) -> None:
    rows = [f"v {row}" for row in text_rows(VERTICES)] + [f"f {row}" for row in text_rows(FACES + 1)]
    path.write_text("\n".join(rows))


def obj_with_normals(path: Path) -> None:
    corners = [" ".join(f"{i}//{i}" for i in face) for face in (FACES + 1).tolist()]
    rows = [f"v {row}" for row in text_rows(VERTICES)] + [f"vn {row}" for row in text_rows(-VERTICES)]
    path.write_text("\n".join(rows + [f"f {face}" for face in corners]))


def ply_header(encoding: str, normals: bool = False) -> str:
    columns = ["x", "y", "z"] + ["nx", "ny", "nz"] * normals
    return "\n".join(
        [f"ply\nformat {encoding} 1.0\nelement vertex {len(VERTICES)}"]
        + [f"property float {column}" for column in columns]
        + [f"element face {len(FACES)}", "property list uchar int vertex_indices", "end_header\n"]
    )


def ply_ascii(path: Path) -> None:
    rows = text_rows(VERTICES) + [f"3 {row}" for row in text_rows(FACES)]
    path.write_text(ply_header("ascii") + "\n".join(rows) + "\n")


def ply_binary(path: Path, order: str = "<", encoding: str = "binary_little_endian") -> None:
    faces = np.zeros(len(FACES), [("n", "u1"), ("corners", f"{order}i4", 3)])
    faces["n"], faces["corners"] = 3, FACES
    path.write_bytes(ply_header(encoding).encode() + VERTICES.astype(f"{order}f4").tobytes() + faces.tobytes())


def ply_big_endian(path: Path) -> None:
    ply_binary(path, ">", "binary_big_endian")


def ply_with_normals(path: Path) -> None:
    faces = np.zeros(len(FACES), [("n", "u1"), ("corners", "<i4", 3)])
    faces["n"], faces["corners"] = 3, FACES
    path.write_bytes(
        ply_header("binary_little_endian", normals=True).encode()
        + np.hstack([VERTICES, -VERTICES]).astype("<f4").tobytes()
        + faces.tobytes()
    )


def stl_binary(path: Path) -> None:
    facets = np.zeros(len(FACES), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    facets["corners"] = VERTICES[FACES]
    path.write_bytes(bytes(80) + struct.pack("<I", len(FACES)) + facets.tobytes())


def stl_ascii(path: Path) -> None:
    facets = [
        "facet normal 0 0 0\nouter loop\n"
        + "\n".join(f"vertex {row}" for row in text_rows(corners))
        + "\nendloop\nendfacet"
        for corners in VERTICES[FACES]
    ]
    path.write_text("solid ball\n" + "\n".join(facets) + "\nendsolid ball\n")


def off(path: Path) -> None:
    rows = text_rows(VERTICES) + [f"3 {row}" for row in text_rows(FACES)]
    path.write_text(f"OFF\n# a ball\n{len(VERTICES)} {len(FACES)} 0\n" + "\n".join(rows) + "\n")


WRITERS = {
    "a.obj": obj,
    "n.obj": obj_with_normals,
    "a.ply": ply_ascii,
    "b.ply": ply_binary,
    "c.ply": ply_big_endian,
    "n.ply": ply_with_normals,
    "a.stl": stl_ascii,
    "b.STL": stl_binary,
    "a.off": off,
}


def triangles(mesh: Mesh) -> np.ndarray:
    """The corners' positions, (m, 3, 3), in an order that does not depend on how vertices are numbered."""
    corners = mesh.vertices[mesh.faces]
    return corners[np.lexsort(corners.reshape(-1, 9).T)]


@pytest.mark.parametrize("name", WRITERS)
def test_every_format_gives_back_the_ball(name: str, tmp_path: Path) -> None:
    WRITERS[name](tmp_path / name)
    (mesh,) = read_mesh(tmp_path / name)
    assert mesh.vertices.dtype == np.float32 and mesh.faces.dtype == np.int32
    np.testing.assert_array_equal(triangles(mesh), triangles(Mesh(VERTICES, FACES)))
    assert mesh.material == Diffuse()
    if name.startswith("n"):
        assert mesh.normals is not None
        np.testing.assert_allclose(mesh.normals, -mesh.vertices, atol=1e-6)
    else:
        assert mesh.normals is None
    assert read_mesh(tmp_path / name, "flat")[0].normals is None
    smooth = read_mesh(tmp_path / name, "smooth")[0]
    assert smooth.normals is not None
    assert np.einsum("ij,ij->i", smooth.normals, smooth.vertices).min() > 0.98


def test_polygons_are_cut_into_fans(tmp_path: Path) -> None:
    """A cube of quads and two triangles encloses 8; a hexagon has 4 triangles and its area is 3√3/2."""
    (tmp_path / "quads.off").write_text(
        "OFF\n8 7 0\n-1 -1 -1\n1 -1 -1\n1 1 -1\n-1 1 -1\n-1 -1 1\n1 -1 1\n1 1 1\n-1 1 1\n"
        "3 0 3 2\n3 0 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 2 3 7 6\n4 1 2 6 5\n4 3 0 4 7\n"
    )
    (mesh,) = read_mesh(tmp_path / "quads.off")
    assert volume(mesh.vertices, mesh.faces) == pytest.approx(8)
    angles = np.radians(60 * np.arange(6))
    (tmp_path / "hexagon.obj").write_text(
        "\n".join(f"v {x} {y} 0" for x, y in zip(np.cos(angles), np.sin(angles))) + "\nf 1 2 3 4 5 6\n"
    )
    (mesh,) = read_mesh(tmp_path / "hexagon.obj")
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    assert len(mesh.faces) == 4
    assert np.cross(b - a, c - a)[:, 2].sum() / 2 == pytest.approx(1.5 * 3**0.5)


BOX_OBJ = """mtllib {library}
usemtl red
f 1 2 3
o second object
usemtl lamp
f 3 2 4
usemtl red
f 4 1 3
usemtl lost
f 1 2 4
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
"""
BOX_MTL = """newmtl red
Kd 0.9 0.1 0.05
newmtl lamp
Kd 0.5 0.5 1.5
Ke 17 12 4
map_Kd wood.png
"""


@pytest.mark.parametrize("library", ["box.mtl", "renamed.mtl"])
def test_obj_materials(library: str, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """There is one mesh per material across objects; a library with the model's own name replaces a missing one."""
    (tmp_path / "box.obj").write_text(BOX_OBJ.format(library=library))
    (tmp_path / "box.mtl").write_text(BOX_MTL)
    with caplog.at_level(logging.WARNING):
        meshes = {len(mesh.faces): mesh for mesh in read_mesh(tmp_path / "box.obj") if mesh.material != Diffuse()}
    assert meshes[2].material == Diffuse(color=(0.9, 0.1, 0.05))
    assert meshes[1].material == Diffuse(color=(0.5, 0.5, 1.0), emission=(17.0, 12.0, 4.0))
    assert (meshes[2].name, meshes[1].name) == ("red", "lamp")
    assert len(read_mesh(tmp_path / "box.obj")) == 3
    assert "wood.png: no such picture file" in caplog.text
    assert ("no material library renamed.mtl" in caplog.text) == (library == "renamed.mtl")


def test_obj_relative_indices_count_from_the_latest_vertex(tmp_path: Path) -> None:
    lines = [
        "v 0 0 0",
        "v 1 0 0",
        "v 0 1 0",
        "vn 0 0 1",
        "f -3//-1 -2//-1 -1//-1",
        "v 5 0 0",
        "v 6 0 0",
        "v 5 0 1",
        "vn 0 -1 0",
        "f -3//-1 -2//-1 -1//2",
    ]
    (tmp_path / "a.obj").write_text("\n".join(lines))
    (mesh,) = read_mesh(tmp_path / "a.obj")
    expected = [[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[5, 0, 0], [6, 0, 0], [5, 0, 1]]]
    np.testing.assert_array_equal(triangles(mesh), expected)
    assert mesh.normals is not None
    np.testing.assert_array_equal(mesh.normals[mesh.faces[-1]], [[0, -1, 0]] * 3)


SQUARE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
TRIANGLE = (
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
)
STRIPS = TRIANGLE.replace("element face", "element tristrips")
BROKEN = {
    "nan.obj": (SQUARE.replace("1", "nan", 1) + "f 1 2 3", 'mesh "nan": vertices[1] = [nan, 0.0, 0.0] is not finite'),
    "huge.obj": (SQUARE.replace("1", "1e39", 1) + "f 1 2 3", "vertices[1] = [inf, 0.0, 0.0] is not finite"),
    "above.obj": (SQUARE + "f 1 2 4", "a face uses vertex 4, but the file has 3"),
    "uv.obj": (SQUARE + "vt 0 0\nf 1/1 2/2 3/1", "a face uses texture coordinate 2, but the file has 1"),
    "before.obj": (SQUARE + "f -1 -2 -4", "a face uses vertex 0, but OBJ counts from 1"),
    "two.obj": (SQUARE + "f 1 2\nf 3 1", 'a face "f 1 2" has fewer than 3 corners'),
    "short.obj": (SQUARE + "v 1 2\nf 1 2 3", 'a line "v 1 2" needs 3 numbers'),
    "long.obj": (SQUARE + "f 1 2 99999999999999999999", "a corner that is not an index"),
    "mixed.obj": (SQUARE + "f 1/ 2/x 3", "a corner that is not an index"),
    "zero.obj": (SQUARE + "f 0 1 2", "a face uses vertex 0, but OBJ counts from 1"),
    "points.obj": (SQUARE, "contains no triangles"),
    "words.obj": (SQUARE + "f one two three", "a face has a corner that is not an index"),
    "empty.obj": ("", "contains no triangles"),
    "above.ply": (TRIANGLE.replace("3 0 1 2", "3 0 1 3"), "faces[0] uses vertex 3, but valid indices are 0 to 2"),
    "below.ply": (TRIANGLE.replace("3 0 1 2", "3 0 1 -1"), "faces[0] uses vertex -1, but valid indices are 0 to 2"),
    "header.ply": (STRIPS[:90], "cannot be read as PLY"),
    "empty.ply": ("", "cannot be read as PLY"),
    "empty.stl": ("", "contains no triangles"),
    # Newer versions of trimesh reject it themselves.
    "above.off": ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n", "cannot be read as OFF|faces[0] uses vertex 7"),
    "a.fbx": ("", "a model must be one of .glb, .gltf"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_models(name: str, tmp_path: Path) -> None:
    content, sentences = BROKEN[name]
    (tmp_path / name).write_text(content)
    with pytest.raises(SceneError) as caught:
        read_mesh(tmp_path / name)
    (problem,) = caught.value.problems
    assert problem.startswith(f"{tmp_path / name}: ") and any(each in problem for each in sentences.split("|"))


def test_missing_model(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="no such model file"):
        read_mesh(tmp_path / "none.ply")


def test_stl_is_welded_for_smooth_normals(tmp_path: Path) -> None:
    """A cube from an STL file, whose triangles share no vertices, gets the corner normals (±1, ±1, ±1)/√3."""
    vertices, faces = cube()
    facets = np.zeros(len(faces), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    facets["corners"] = vertices[faces]
    (tmp_path / "cube.stl").write_bytes(bytes(80) + struct.pack("<I", len(faces)) + facets.tobytes())
    (mesh,) = read_mesh(tmp_path / "cube.stl", "smooth")
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.normals, mesh.vertices / 3**0.5, atol=1e-6)
