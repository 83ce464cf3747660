"""OBJ, MTL and OFF files as other programs write them, and damaged ones."""

from __future__ import annotations

from pathlib import Path

import imageio.v3 as imageio
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from clrt.errors import SceneError
from clrt.formats.models import read_mesh
from clrt.formats.wavefront import obj_lines
from clrt.formats.wavefront.distinct import distinct
from clrt.formats.wavefront.obj import parse_obj
from clrt.scene.materials.material_types import Dielectric, Diffuse, Material, MetallicRoughness
from clrt.scene.materials.textures import Texture

POINTS = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
TRIANGLE = POINTS + "f 1 2 3\n"
FACE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def corners(path: Path, content: str | bytes) -> list[object]:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    (mesh,) = read_mesh(path)
    found: list[object] = mesh.vertices[mesh.faces].tolist()
    return found


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize(
    "text",
    [
        TRIANGLE,
        "\ufeff" + TRIANGLE,
        "\ufeff# comment\n" + TRIANGLE,
        "\n\n\t" + TRIANGLE.replace(" ", "\t\t").replace("\n", " \n \t"),
        POINTS + "f 1 2 \\\n 3 \\\n",
        POINTS + "f -3 -2 -1",
        POINTS.replace("1", "1e+0").replace(" 0", " -.0") + "f 1//9 2//9 3//9\n",
        "# C:\\models\\\n" + POINTS + "f 1/1/1 2/2/2 3/3/3 # no vt, no vn",
        POINTS + "v nan nan nan\nf 1 2 3",
        "g all\no it\ns off\nl 1 2\np 1\nvp 0.5\ncstype bezier\n" + TRIANGLE + "call x.obj\nend",
        POINTS.replace("\n", " 1.0 # w\n") + "f +1 +2 +3",
    ],
)
def test_layouts(text: str, end: str, tmp_path: Path) -> None:
    assert corners(tmp_path / "a.obj", text.replace("\n", end)) == [FACE]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (TRIANGLE.encode("utf-16"), "is encoded as UTF-16; save it as UTF-8"),
        (b"v 0,5 0 0\n" + TRIANGLE.encode(), 'a line "v 0,5 0 0" needs 3 numbers; write points in decimals'),
        (TRIANGLE.encode() + b"vn 0 zero 1", 'a line "vn 0 zero 1" needs 3 numbers'),
        (TRIANGLE.encode() + b"vt # none", "needs 1 numbers"),
    ],
)
def test_refused(content: bytes, message: str, tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_bytes(content)
    with pytest.raises(SceneError, match="a.obj: .*") as caught:
        read_mesh(tmp_path / "a.obj")
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("face", "fault"),
    [
        ("f 1 2", 'a face "f 1 2" has fewer than 3 corners'),
        ("f ", "has fewer than 3 corners"),
        ("f 1 2 9", "a face uses vertex 9, but the file has 3"),
        ("f 1 2 -9", "a face uses vertex -5, but the file has 3"),
        ("f 1 2 0", "a face uses vertex 0, but OBJ counts from 1"),
        ("f 1/1 2/1 3/2", "a face uses texture coordinate 2, but the file has 1"),
        ("f 1/1 2/1 3/-2", "a face uses texture coordinate -1, but the file has 1"),
        ("f 1//1 2//4 3//1", "a face uses normal 4, but the file has 1"),
        *(
            (f"f 1 2 {word}", f'not an index: "f 1 2 {word}"')
            for word in ("x", "1.5", "1/2/3/4", "1///2", "2-1", "--1")
        ),
        ("f 1 2 99999999999999999999", "not an index"),
        ("f /1 2 3", "not an index"),
    ],
)
@pytest.mark.parametrize("block", [1, 1 << 20])
def test_an_invalid_face_is_ignored(
    face: str, fault: str, block: int, tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The others are read as without it, and a warning counts it."""
    monkeypatch.setattr(obj_lines, "BLOCK", block)
    tables = "vt 0 0\nvn 0 0 1\n"
    assert corners(tmp_path / "a.obj", f"{POINTS}{tables}f 1/1/1 2/1/1 3/1/1\n{face}\nf 3/1/1 2/1/1 1/1/1\n") == [
        FACE,
        FACE[::-1],
    ]
    (warning,) = caplog.messages
    assert "a.obj: ignored: 1 invalid faces; the first: " in warning and fault in warning
    (tmp_path / "a.obj").write_text(f"{POINTS}{tables}{face}")
    with pytest.raises(SceneError) as caught:
        read_mesh(tmp_path / "a.obj")
    assert fault in str(caught.value)


def test_undefined_normals_are_replaced(tmp_path: Path) -> None:
    """As programs built by Microsoft's compilers write those of degenerate faces."""
    path = tmp_path / "a.obj"
    path.write_text(POINTS + "vn -nan(ind) -nan(ind) 1.#QNAN\nvn 0 0 1\nf 1//1 2//2 3//2\n")
    (mesh,) = read_mesh(path)
    np.testing.assert_array_equal(mesh.normals, [[0, 0, 1]] * 3)


def test_vertex_colors(tmp_path: Path) -> None:
    """Up to 1 or 255; vertices without are white, and meshes without have none."""
    path = tmp_path / "a.obj"
    faces = "usemtl a\nf 1 2 3\nusemtl b\nf 4 5 6\n"
    for one, factor in ((1, 1), (255, 1 / 255)):
        path.write_text(f"v 0 0 0 {one} 0 0\nv 1 0 0\nv 0 1 0 0 {one} 0 {one}\n{POINTS}{faces}")
        first, second = parse_obj(path).values()
        np.testing.assert_allclose(first["vertex_colors"], [[1, 0, 0], [1, 1, 1], [0, 1, 0]])
        assert second["vertex_colors"] is None
    path.write_text("v 0 0 0 1.25 0 0\nv 1 0 0 0 0 0\nv 0 1 0 0 0 0\nf 1 2 3")
    assert parse_obj(path)["a"]["vertex_colors"][0].tolist() == [1.25, 0, 0]


@pytest.mark.parametrize("block", [30, 1 << 20])
@pytest.mark.parametrize("negative", [False, True])
def test_random_files(block: int, negative: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tables and faces in any order, several forms of corners, indices from both ends, blocks of any size."""
    monkeypatch.setattr(obj_lines, "BLOCK", block)
    for seed in range(5):
        rng = np.random.default_rng(seed)
        form = rng.choice(["{0}", "{0}/{1}", "{0}//{2}", "{0}/{1}/{2}"])
        tables = [rng.normal(size=(count, width)) for count, width in ((14, 3), (8, 2), (6, 3))]
        lines, used, counts = [], [], np.zeros(3, np.int64)
        for key in [0, 1, 2, *rng.permutation(np.repeat([0, 1, 2, 3], [13, 7, 5, 20])).tolist(), 3]:
            if key < 3:
                lines.append(f"{('v', 'vt', 'vn')[key]} " + " ".join(map(repr, tables[key][counts[key]].tolist())))
                counts[key] += 1
            else:
                used.append(rng.integers(0, counts, (3, 3)))
                written = used[-1] - counts if negative else used[-1] + 1
                lines.append("f " + " ".join(form.format(*each) for each in written.tolist()))
        (tmp_path / "a.obj").write_text("\n".join(lines))
        piece = parse_obj(tmp_path / "a.obj")["a"]
        for column, name in enumerate(("vertices", "uv", "vertex_normals")):
            assert (piece[name] is None) == (f"{{{column}}}" not in form)
            if piece[name] is not None:
                expected = tables[column][np.array(used)[:, :, column]]
                np.testing.assert_allclose(piece[name][piece["faces"]], expected, rtol=1e-15)


@settings(max_examples=50, deadline=None)
@given(st.lists(st.tuples(*[st.integers(0, 4)] * 3), min_size=1), st.sampled_from([1, 10**6]))
def test_distinct_rows(rows: list[tuple[int, int, int]], spread: int) -> None:
    given = np.array(rows) * spread
    numbers, found = distinct(given)
    expected, inverse = np.unique(given, axis=0, return_inverse=True)
    np.testing.assert_array_equal(found, expected)
    np.testing.assert_array_equal(numbers, inverse.ravel())


MTL: dict[str, Material] = {
    # MeshLab: Tr is the opacity.
    "# Converted by Meshlab Group\nnewmtl a\nTr 1.000000": Diffuse(),
    "# Converted by Meshlab Group\nnewmtl a\nTr 0.25": Diffuse(opacity=0.25),
    "newmtl a\nTr 1.000000": Diffuse(),
    "newmtl a\nTr 0.25": Diffuse(opacity=0.75),
    "newmtl a\nd 0.25\nTr 0.75": Diffuse(opacity=0.25),
    "newmtl a\nTr 0.75\nd 0.25": Diffuse(opacity=0.25),
    # Blender: of a transparent surface, and of an opaque one.
    "newmtl a\nNs 250\nKa 1 1 1\nKd 0.5 0.5 0.5\nNi 1.45\nd 0.5\nillum 9": Diffuse(color=(0.5, 0.5, 0.5), opacity=0.5),
    "newmtl a\nKd 0.5 0.5 0.5\nNi 1.45\nd 1\nillum 9": Dielectric(ior=1.45),
    "newmtl a\nKs 0.5 0.5 0.5\nNs 30\nNi 1.5\nd 1.0\nillum 2": MetallicRoughness(color=(0.8,) * 3, roughness=0.5),
    # Maya.
    "newmtl a\nillum 4\nKd 0.50 0.50 0.50\nKa 0.00 0.00 0.00\nTf 1.00 1.00 1.00\nNi 1.00": Diffuse(color=(0.5,) * 3),
    "newmtl a\nillum 4\nKd 0.50 0.50 0.50\nTf 0.25 0.25 0.25\nNi 1.00": Diffuse(color=(0.5,) * 3, opacity=0.25),
    "\ufeffnewmtl a\r\nKd 1 0 0#red\r\n": Diffuse(color=(1, 0, 0)),
}


@pytest.mark.parametrize("text", MTL)
def test_materials_of_programs(text: str, tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_text(text, newline="", encoding="utf-8")
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\n{POINTS}usemtl a\nf 1 2 3")
    assert read_mesh(tmp_path / "a.obj")[0].material == MTL[text]


def textured(tmp_path: Path, words: str, library: str = "m/a.mtl") -> Diffuse:
    """Read a model whose library, in another folder, has these lines."""
    (tmp_path / "m").mkdir(exist_ok=True)
    (tmp_path / "m" / "a.mtl").write_text(f"newmtl a\n{words}")
    (tmp_path / "a.obj").write_text(f"mtllib {library}\n{POINTS}vt 0 0\nusemtl a\nf 1/1 2/1 3/1")
    material = read_mesh(tmp_path / "a.obj")[0].material
    assert isinstance(material, Diffuse)
    return material


@pytest.mark.parametrize(
    "name",
    [
        "my wood#1.png",
        '"my wood#1.png"',
        "my wood#1.png # the floor",
        "..\\m\\my wood#1.png",
        "C:\\Users\\me\\textures\\my wood#1.png",
        "/home/me/my wood#1.png",
        "textures/my wood#1.png",
        "-s 2 2 1 -o 0.5 my wood#1.png",
        "MY WOOD#1.PNG",
    ],
)
def test_textures_are_found(name: str, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Next to the library, whatever path and letter case it has on the computer that it is from."""
    (tmp_path / "m").mkdir()
    imageio.imwrite(tmp_path / "m" / "my wood#1.png", np.full((2, 2, 3), 9, np.uint8))
    material = textured(tmp_path, f"map_Kd {name}", "M\\A.mtl" if name.isupper() else "m\\a.mtl")
    assert isinstance(material.color, Texture) and material.color.picture.texels[0, 0, 0] == 9
    assert any("using my wood#1.png" in each for each in caplog.messages) == name.isupper()


def image(path: Path, *colors: tuple[int, ...]) -> None:
    imageio.imwrite(path, np.array([colors], np.uint8))


@pytest.mark.parametrize(
    ("options", "colors", "values"),
    [
        ("", [(9, 9, 9), (200, 200, 200)], [9, 200]),
        ("", [(0, 255, 0), (255, 255, 255)], [182, 255]),  # luminance, Rec. 709
        ("", [(0, 255, 0, 0), (9, 9, 9, 255)], [0, 255]),
        ("-imfchan m", [(0, 255, 0, 7), (9, 9, 9, 255)], [7, 255]),
        ("-imfchan l", [(9, 9, 9, 0), (30, 30, 30, 255)], [9, 30]),
        ("-imfchan g", [(0, 255, 0), (9, 8, 9)], [255, 8]),
    ],
)
def test_map_d(options: str, colors: list[tuple[int, ...]], values: list[int], tmp_path: Path) -> None:
    (tmp_path / "m").mkdir()
    image(tmp_path / "m" / "a.png", *colors)
    opacity = textured(tmp_path, f"map_d {options} a.png").opacity
    assert isinstance(opacity, Texture)
    assert opacity.picture.texels[0, :, ["red", "green", "blue", "alpha"].index(opacity.channel)].tolist() == values


@pytest.mark.parametrize("key", ["norm", "map_Kn", "map_Bump", "bump", "map_bump"])
def test_normals_in_bump_maps(key: str, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Blender and others write normal maps as map_Bump; heights are ignored with a warning."""
    (tmp_path / "m").mkdir()
    image(tmp_path / "m" / "a.png", (128, 128, 255), (100, 140, 240))
    normal_map = textured(tmp_path, f"{key} -bm 0.5 a.png").normal_map
    assert normal_map is not None and normal_map.factor == 0.5 and not caplog.messages
    image(tmp_path / "m" / "a.png", (128, 128, 128), (20, 20, 20))
    if "ump" in key:
        assert textured(tmp_path, f"{key} a.png").normal_map is None
        assert caplog.messages[0].endswith(f"a.obj: ignored: textures ({key.lower()})")


def test_names_of_materials(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """With spaces and #; a comment after them is not part of the name; undefined ones are named."""
    (tmp_path / "a.mtl").write_text("newmtl red paint\nKd 1 0 0\nnewmtl blue #2\nKd 0 0 1\n")
    uses = ["red paint", "red   paint # of the car", "blue #2", "blue #3", "lost"]
    faces = "".join(f"usemtl {name}\nf 1 2 3\n" for name in uses)
    path = tmp_path / "b.obj"
    path.write_text(f"mtllib ./A.mtl\n{POINTS}{faces}")
    meshes = {mesh.material_name: mesh for mesh in read_mesh(path)}
    assert {name: len(mesh.faces) for name, mesh in meshes.items()} == {
        "red paint": 2,
        "blue #2": 1,
        "blue": 1,
        "lost": 1,
    }
    assert meshes["blue #2"].material == Diffuse(color=(0, 0, 1))
    case, undefined = caplog.messages
    assert case.endswith("b.obj: no file ./A.mtl; using a.mtl")
    assert undefined.endswith('b.obj: no library defines these materials, which are plain gray: "blue", "lost"')


OFF: dict[str, str] = {
    "OFF": "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    "glued": "OFF3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    "one line": "OFF 3 1 3\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    "no edges": "\ufeffOFF\r\n3 1\r\n0 0 0\r\n1 0 0\r\n0 1 0\r\n3 0 1 2",
    "comments": "# x\nOFF # y\n\n3 1 0 # z\n\n0 0 0\n# v\n1 0 0 # w\n0 1 0\n\n3\t0 1  2 # f\n",
    "edges": "OFF\n3 3 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1\n3 0 1 2\n1 0\n",
    "COFF": "COFF\n3 1 0\n0 0 0 255 0 0 255\n1 0 0 255 0 0 255\n0 1 0 255 0 0 255\n3 0 1 2\n",
    "CNOFF": "CNOFF\n3 1 0\n0 0 0 0 0 2 1 0 0 1\n1 0 0 0 0 2 1 0 0 1\n0 1 0 0 0 2 1 0 0 1\n3 0 1 2\n",
    "STOFF": "STOFF\n3 1 0\n0 0 0 0.5 0.25\n1 0 0 0.5 0.25\n0 1 0 0.5 0.25\n3 0 1 2\n",
}


@pytest.mark.parametrize("name", OFF)
def test_off(name: str, tmp_path: Path) -> None:
    assert corners(tmp_path / "a.off", OFF[name]) == [FACE]
    (mesh,) = read_mesh(tmp_path / "a.off")
    assert (mesh.colors is None) == ("C" not in name) and (mesh.uv is None) == ("ST" not in name)
    if mesh.colors is not None:
        np.testing.assert_allclose(mesh.colors, [[1, 0, 0]] * 3)
    if mesh.uv is not None:
        np.testing.assert_allclose(mesh.uv, [[0.5, 0.75]] * 3)
    if name == "CNOFF":
        assert mesh.normals is not None
        np.testing.assert_allclose(mesh.normals, [[0, 0, 1]] * 3)
