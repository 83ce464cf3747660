"""OBJ and MTL features beyond those that all model files share."""

from __future__ import annotations

import logging
from pathlib import Path

import imageio.v3 as imageio
import numpy as np
import pytest

from clrt.errors import SceneError
from clrt.formats.models import read_mesh
from clrt.formats.wavefront.mtl import material, read_library
from clrt.formats.wavefront.mtl_maps import Maps
from clrt.formats.wavefront.obj import parse_obj
from clrt.scene.materials.material import as_color
from clrt.scene.materials.material_types import Dielectric, Diffuse, MetallicRoughness, Mirror
from clrt.scene.materials.textures import Texture

MTL = {
    "Kd 0.5 0.25 2": Diffuse(color=(0.5, 0.25, 1)),
    "Kd 0.5": Diffuse(color=(0.5, 0.5, 0.5)),
    "": Diffuse(color=(0.8, 0.8, 0.8)),
    "Kd 1 1 1 # white\nKe 3 2 1\nKs 0 0 0\nNs 50\nillum 2": Diffuse(color=(1, 1, 1), emission=(3, 2, 1)),
    "illum 1\nKs 1 1 1": Diffuse(),
    # A highlight of Blinn's exponent 30 is as wide as GGX's of alpha² = 2/32: roughness 1/2.
    "Kd 0.1 0.2 0.3\nKs 0.5 0.5 0.5\nNs 30\nillum 2": MetallicRoughness(color=(0.1, 0.2, 0.3), roughness=0.5),
    "Kd 0.1 0.2 0.3\nPr 0.25\nPm 1\nKs 1 1 1\nKe 1 1 1": MetallicRoughness(
        color=(0.1, 0.2, 0.3), roughness=0.25, metallic=1, emission=(1, 1, 1)
    ),
    "Kd 1 1 1\nd 0.25": Diffuse(color=(1, 1, 1), opacity=0.25),
    "Kd 1 1 1\nTr 0.25": Diffuse(color=(1, 1, 1), opacity=0.75),
    "Kd 0 0 0\nKs 0.9 0.8 0.7\nillum 3": Mirror(color=(0.9, 0.8, 0.7)),
    "Kd 0 0 0\nNi 1.33\nTf 0.9 1 1\nillum 7": Dielectric(color=(0.9, 1, 1), ior=1.33),
    "\tkd\t1 0 0\nillum\t4\nd -halo 0.5": Dielectric(),
}


@pytest.mark.parametrize("values", MTL)
def test_mtl(values: str) -> None:
    entry = read_library(f"newmtl Glass #3  a\n{values}\nnewmtl other\nKd 0 0 0")["Glass #3 a"]
    assert material(entry, Maps(Path())) == MTL[values]


def test_maps_and_coordinates(tmp_path: Path) -> None:
    """v points up in these files and down in clrt: a map shows the same at each point."""
    imageio.imwrite(tmp_path / "a b.png", np.zeros((2, 2, 3), np.uint8))
    (tmp_path / "a.mtl").write_text(
        "newmtl a\nKd 0.5 1 1\nmap_Kd -o 0.25 0.5 0 -s 2 3 1 -clamp on a b.png\nmap_d -imfchan g a b.png\n"
        "map_Pr a b.png\nPr 0.5\nmap_Pm lost.png\nmap_Ke a b.png\nnorm -bm 0.5 a b.png"
    )
    (tmp_path / "a.obj").write_text(
        "mtllib a.mtl\nv 0 0 0 1 0 0.5\nv 1 0 0 1 1 1\nv 0 1 0 0 0 0\nvt 0.1 0.2\nvt 1 0\n"
        "vt 0 1\nusemtl a\nf 1/1 2/2 3/3"
    )
    (mesh,) = read_mesh(tmp_path / "a.obj")
    made = mesh.material
    assert isinstance(made, MetallicRoughness) and isinstance(made.color, Texture) and isinstance(made.opacity, Texture)
    assert isinstance(made.roughness, Texture) and isinstance(made.emission, Texture) and made.normal_map is not None
    assert as_color(made.color.factor) == (0.5, 1, 1) and made.color.wrap == ("clamp", "clamp")
    assert made.opacity.channel == "green" and made.roughness.factor == 0.5 and made.metallic == 0
    assert as_color(made.emission.factor) == (1, 1, 1) and made.normal_map.factor == 0.5
    assert mesh.uv is not None and mesh.colors is not None
    upward = np.array([[0.1, 0.2], [1, 0], [0, 1]])
    shown = mesh.uv @ made.color.to_picture[:, :2].T + made.color.to_picture[:, 2]
    assert np.allclose(shown, (upward * (2, 3) + (0.25, 0.5)) * (1, -1) + (0, 1))
    assert np.allclose(mesh.colors, [[1, 0, ((0.5 + 0.055) / 1.055) ** 2.4], [1, 1, 1], [0, 0, 0]])
    (tmp_path / "a.obj").write_text("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3")
    (bare,) = read_mesh(tmp_path / "a.obj")
    assert bare.material == MetallicRoughness(color=(0.5, 1, 1), roughness=0.5, emission=(1, 1, 1))


def test_mtl_tells_what_it_leaves_out(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "a.obj").write_text(
        "mtllib my library.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 3 2 1"
    )
    library = tmp_path / "my library.mtl"
    library.write_text("newmtl a\nmap_Ka a.png\nbump c.png\nnewmtl b\nPc 1\nPr 1")
    with caplog.at_level(logging.WARNING):
        meshes = read_mesh(tmp_path / "a.obj")
    assert [mesh.material_name for mesh in meshes] == ["a", "b"]
    (warning,) = caplog.messages
    assert warning.endswith("a.obj: ignored: textures (bump, map_ka), clearcoat (Pc)")
    for wrong, sentence in [
        ("Kd 1 2", 'Kd is "1 2"; write three numbers'),
        ("Ns nan", 'Ns is "nan"; write a number'),
        ("Kd spectral a.rfl", 'Kd is "spectral a.rfl"; write three numbers'),
    ]:
        library.write_text(f"newmtl a\n{wrong}")
        with pytest.raises(SceneError, match=f'a.obj: my library.mtl: material "a": {wrong[:2]} is'):
            read_mesh(tmp_path / "a.obj")


def test_obj_of_many_forms(tmp_path: Path) -> None:
    """Corners of all forms, quads and triangles, comments, continued lines, colours, arbitrary spacing."""
    (tmp_path / "a.obj").write_text(
        "# made by hand\n  v 0 0 0 1 0 0 # red\nv\t1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0 1 1 1\nvt 0 0\nvt 1 0 0\n"
        "vn 0 0 2\ns off\ng one\nf 1/1/1 2/2/1 3 \\\n4//1\n f 1 3 4 # last\nl 1 2\n"
    )
    (mesh,) = read_mesh(tmp_path / "a.obj")
    expected = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])[[[0, 1, 2], [0, 2, 3], [0, 2, 3]]]
    np.testing.assert_array_equal(mesh.vertices[mesh.faces], expected)
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.normals, np.tile([0, 0, 1], (len(mesh.vertices), 1)), atol=1e-6)
    piece = parse_obj(tmp_path / "a.obj")["a"]
    np.testing.assert_array_equal(piece["uv"][piece["faces"][0]], [[0, 0], [1, 0], [0, 0]])
    np.testing.assert_array_equal(piece["vertex_colors"][piece["faces"][0]], np.eye(3))


def test_a_material_of_the_file_s_own_name(tmp_path: Path) -> None:
    """Faces before it become a separate mesh, and none is lost."""
    path = tmp_path / "box.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nusemtl box\nf 1 3 2\nf 1 2 3\n")
    assert {name: len(mesh["faces"]) for name, mesh in parse_obj(path).items()} == {"box 2": 1, "box": 2}
