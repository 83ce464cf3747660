"""3MF files: geometry and placement against numpy, and appearance."""

from __future__ import annotations

import ctypes
import logging
import sys
import zipfile
from pathlib import Path

import imageio.v3 as imageio
import numpy as np
import pytest
from click.testing import CliRunner

from clrt.cli.convert import command as convert
from clrt.errors import SceneError
from clrt.formats.archives import FREE_BYTES
from clrt.formats.load_scene import load
from clrt.formats.models import read_model
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.materials.textures import Texture

from .threemf_files import TETRAHEDRON, Package, painted

pytestmark = pytest.mark.needs("lib3mf")
MODEL = "3D/3dmodel.model"


def bounds(meshes: list) -> np.ndarray:  # type: ignore[type-arg]
    points = np.concatenate([mesh.vertices for mesh in meshes])
    return np.stack([points.min(axis=0), points.max(axis=0)])


def edited(source: Path, path: Path, *texts: str) -> Path:
    """Copy a 3MF file with texts in its model replaced: old, new, old, new, …"""
    with zipfile.ZipFile(source) as given, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as copy:
        for name in given.namelist():
            content = given.read(name)
            for old, new in zip(texts[::2], texts[1::2]) if name == MODEL else ():
                assert old.encode() in content
                content = content.replace(old.encode(), new.encode())
            copy.writestr(name, content)
    return path


def test_build_items_and_components(tmp_path: Path) -> None:
    """Item and component transforms compose; +Z becomes +Y; inches become meters."""
    path = painted().write(tmp_path / "a.3mf")
    points = np.concatenate([TETRAHEDRON, 2 * (TETRAHEDRON + [0, 0, 10]) + [5, 0, 0]])
    model = read_model(path)
    assert (model.up, model.unit) == ("z", "in")
    np.testing.assert_allclose(bounds(model.meshes), [points.min(axis=0), points.max(axis=0)], rtol=1e-6)
    scene = load(path)
    turned = points[:, [0, 2, 1]] * [0.0254, 0.0254, -0.0254]
    np.testing.assert_allclose(bounds(scene.meshes), [turned.min(axis=0), turned.max(axis=0)], rtol=1e-5, atol=1e-6)
    assert np.ptp(bounds(load(path, up="y", unit="m").meshes), axis=0) == pytest.approx(np.ptp(points, axis=0))


@pytest.mark.parametrize(
    ("unit", "meters"),
    [("MicroMeter", 1e-6), ("MilliMeter", 1e-3), ("CentiMeter", 0.01), ("Foot", 0.3048), ("Meter", 1.0)],
)
def test_units(tmp_path: Path, unit: str, meters: float) -> None:
    package = Package()
    package.model.SetUnit(getattr(package.library.ModelUnit, unit))
    package.item(package.mesh())
    scene = load(package.write(tmp_path / "a.3mf"))
    assert np.ptp(scene.meshes[0].vertices, axis=0) == pytest.approx(meters * np.array([1, 3, 2]))


def test_scene_files_and_conversion(tmp_path: Path) -> None:
    """`clrt convert` writes axis and unit of the file into the scene file, which loads the same."""
    path, scene = painted().write(tmp_path / "a.3mf"), tmp_path / "a.toml"
    done = CliRunner().invoke(convert, [str(path), str(scene)])
    assert done.exit_code == 0, done.output
    assert 'up = "z"\nunit = "in"\n' in scene.read_text()
    np.testing.assert_array_equal(bounds(load(scene).meshes), bounds(load(path).meshes))


def test_base_materials(tmp_path: Path) -> None:
    """A mesh for each material by name; colors are decoded from sRGB, and alpha is opacity."""
    meshes = read_model(painted().write(tmp_path / "a.3mf")).meshes
    assert [(mesh.material_name, len(mesh.faces)) for mesh in meshes] == 2 * [("red", 3), ("blue", 1)]
    assert meshes[0].material == Diffuse(color=(1.0, 0.0, 0.0))
    assert meshes[1].material.opacity == pytest.approx(128 / 255)
    assert meshes[0].material is meshes[2].material


def test_color_groups_split_seams(tmp_path: Path) -> None:
    """Colors belong to the corners of triangles; vertices are shared where they agree."""
    package = Package()
    mesh, group = package.mesh(), package.model.AddColorGroup()
    red, grey = group.AddColor(package.color(255, 0, 0)), group.AddColor(package.color(188, 188, 188, 0))
    for triangle, entries in enumerate([[red] * 3, [red] * 3, [red] * 3, [red, grey, red]]):
        package.properties(mesh, triangle, group, entries)
    package.item(mesh)
    (read,) = read_model(package.write(tmp_path / "a.3mf")).meshes
    assert read.colors is not None and len(read.vertices) == 5
    expected = np.array([[1, 0, 0, 1], [0.5029, 0.5029, 0.5029, 0], [1, 0, 0, 1]])
    np.testing.assert_allclose(read.colors[read.faces[3]], expected, atol=1e-4)
    np.testing.assert_array_equal(read.colors[read.faces[:3]].reshape(-1, 4), [[1, 0, 0, 1]] * 9)


def image(folder: Path, alpha: bool = False) -> Path:
    texels = np.arange(48, dtype=np.uint8).reshape(3, 4, 4) * 5
    texels[..., 3] = 77 if alpha else 255
    imageio.imwrite(folder / "image.png", texels)
    return folder / "image.png"


def coordinates(package: Package, group: object, points: list[tuple[float, float]]) -> list[int]:
    return [group.AddTex2Coord(package.library.Tex2Coord(u, v)) for u, v in points]  # type: ignore[attr-defined]


def test_textures(tmp_path: Path) -> None:
    """v points up in the file and down in clrt; tile styles are wrap modes."""
    package = Package()
    mesh, group = package.mesh(), package.texture(image(tmp_path))
    entries = coordinates(package, group, [(0, 0), (1, 0), (0.25, 0.75)])
    for triangle in range(4):
        package.properties(mesh, triangle, group, entries)
    package.item(mesh)
    (read,) = read_model(package.write(tmp_path / "a.3mf")).meshes
    assert read.uv is not None and isinstance(read.material, Diffuse) and isinstance(read.material.color, Texture)
    np.testing.assert_allclose(read.uv[read.faces[0]], np.array([[0, 1], [1, 1], [0.25, 0.25]]))
    np.testing.assert_array_equal(read.material.color.picture.texels, imageio.imread(tmp_path / "image.png"))
    assert read.material.color.wrap == ("clamp", "mirror") and read.material.opacity == 1


@pytest.mark.parametrize("multiplies", [False, True])
def test_layers(tmp_path: Path, multiplies: bool) -> None:
    """A texture multiplies the color below it, or hides it; a color mixes with the material below it by its alpha."""
    package = Package()
    library = package.library
    mesh, plain = package.mesh(), package.mesh("plain")
    materials, colors = package.model.AddBaseMaterialGroup(), package.model.AddColorGroup()
    texture = package.texture(image(tmp_path))
    (uv,) = coordinates(package, texture, [(0.5, 0.5)])
    white = materials.AddMaterial("white", package.color(255, 255, 255))
    half = colors.AddColor(package.color(0, 100, 255, 51))
    method = library.BlendMethod.Multiply if multiplies else library.BlendMethod.Mix
    for shape, groups, entries in (
        (mesh, (materials, colors, texture), (white, half, uv)),
        (plain, (materials, colors), (white, half)),
    ):
        layers = package.model.AddMultiPropertyGroup()
        for group in groups:
            layers.AddLayer(library.MultiPropertyLayer(group.GetUniqueResourceID(), method))
        entry = layers.AddMultiProperty(list(entries))
        for triangle in range(4):
            package.properties(shape, triangle, layers, [entry] * 3)
        package.item(shape)
    textured, mixed = read_model(package.write(tmp_path / "a.3mf")).meshes
    assert isinstance(textured.material, Diffuse) and isinstance(textured.material.color, Texture)
    assert (textured.colors is not None) == multiplies
    expected = np.array([0, 100, 255]) if multiplies else np.array([204, 224, 255])  # 255 + (c − 255)/5
    assert mixed.colors is not None
    linear = ((expected / 255 + 0.055) / 1.055) ** 2.4 * (expected > 0)
    np.testing.assert_allclose(mixed.colors[0, :3], linear, rtol=1e-3)


def test_ignored_features_are_counted(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    package = Package()
    mesh, support = package.mesh(), package.mesh("support")
    mesh.SetType(package.library.ObjectType.Model)
    support.SetType(package.library.ObjectType.Support)
    lattice = mesh.BeamLattice()
    lattice.AddBeam(package.library.Beam((ctypes.c_uint32 * 2)(0, 3), (ctypes.c_double * 2)(0.1, 0.1)))
    package.item(mesh)
    package.item(support)
    with caplog.at_level(logging.WARNING):
        (read,) = read_model(package.write(tmp_path / "a.3mf")).meshes
    assert read.name == "part"
    assert "ignored: beams (1), supports (1)" in caplog.text


def test_damaged_files_end_in_one_error(tmp_path: Path) -> None:
    good = painted().write(tmp_path / "good.3mf")
    path = tmp_path / "a.3mf"
    cases = {
        "is not a ZIP archive": b"PK\3\4 not",
        "cannot be read as 3MF": edited(good, path, "</resources>", "").read_bytes(),
        "cannot be read as 3MF: ": edited(good, path, 'v3="1"', 'v3="77"').read_bytes(),
        "Invalid Model Coordinates": edited(good, path, 'x="1.000000"', 'x="1e39"').read_bytes(),
    }
    for message, content in cases.items():
        path.write_bytes(content)
        with pytest.raises(SceneError, match=f"a.3mf: .*{message}") as raised:
            read_model(path)
        assert len(str(raised.value).splitlines()) == 1


def test_archives_that_unpack_to_too_much_are_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.3mf"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(MODEL, bytes(FREE_BYTES + 1))
    monkeypatch.setattr("clrt.formats.threemf.reader.decode", lambda *_: pytest.fail("was read"))
    with pytest.raises(SceneError, match=f"cannot contain {FREE_BYTES + 1} bytes of files"):
        read_model(path)


def test_components_that_multiply_are_refused(tmp_path: Path) -> None:
    """Two components in each of 21 levels make 2²¹ meshes."""
    path = painted().write(tmp_path / "a.3mf")
    levels = "".join(
        f'<object id="{100 + i}" type="model"><components><component objectid="{99 + i if i else 1}"/>'
        f'<component objectid="{99 + i if i else 1}"/></components></object>'
        for i in range(21)
    )
    with pytest.raises(SceneError, match="components make more than"):
        read_model(
            edited(path, tmp_path / "b.3mf", "</resources>", f"{levels}</resources>", 'objectid="3"', 'objectid="120"')
        )


def test_without_the_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = painted().write(tmp_path / "a.3mf")
    monkeypatch.setitem(sys.modules, "lib3mf", None)
    monkeypatch.setattr("clrt.formats.threemf.reader.find_spec", lambda _: None)
    with pytest.raises(SceneError, match="pip install lib3mf"):
        read_model(path)
