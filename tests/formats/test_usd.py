"""USD files: geometry, placement, cameras and archives, by closed facts and against usd-core's own bounds."""

from __future__ import annotations

import logging
import math
import zipfile
from pathlib import Path

import imageio.v3 as imageio
import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.errors import SceneError
from clrt.formats.load_scene import load
from clrt.formats.model_choice import ModelChoice
from clrt.formats.models import read_model
from clrt.formats.usd.reader import read_usd
from clrt.scene.frame_model import bounds
from clrt.scene.geometry.instancing import baked
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Mesh, Model

from .usd_files import SQUARE, ST, mesh, usda, usdz

pytestmark = pytest.mark.needs("pxr")


def extent(model: Model) -> NDArray[np.float64]:
    return np.stack(bounds(model.meshes, model.instances))


def area(mesh: Mesh) -> float:
    a, b, c = mesh.vertices.astype(np.float64)[mesh.faces].swapaxes(0, 1)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def facing(mesh: Mesh) -> NDArray[np.float64]:
    """Return the sum of the faces' normals times their areas."""
    a, b, c = mesh.vertices.astype(np.float64)[mesh.faces].swapaxes(0, 1)
    return np.asarray(np.cross(b - a, c - a).sum(axis=0) / 2)


def at(mesh: Mesh, name: str, point: tuple[float, ...]) -> NDArray[np.float64]:
    """Return an attribute at the vertices in one place, without repetitions."""
    rows = np.flatnonzero((np.abs(mesh.vertices - point) < 1e-6).all(axis=1))
    return np.unique(getattr(mesh, name)[rows], axis=0)


@pytest.mark.parametrize(("up", "meters"), [("Y", 1.0), ("Z", 0.01), ("Y", 0.0254)])
def test_axes_and_units(tmp_path: Path, up: str, meters: float) -> None:
    """Points are in meters with +Y up; with +Z up, y becomes −Z."""
    path = usda(
        tmp_path,
        'def Xform "a" { double3 xformOp:translate = (1, 2, 3)\n'
        'uniform token[] xformOpOrder = ["xformOp:translate"]\n' + mesh() + "}",
        meters,
        up,
    )
    expected = np.array([[1, 2, 3], [2, 3, 3]]) * meters
    if up == "Z":
        expected = np.array([[1, 3, -3], [2, 3, -2]]) * meters
    np.testing.assert_allclose(extent(read_usd(path)), expected, rtol=1e-6)


def test_polygons_holes_and_orientation(tmp_path: Path) -> None:
    """A concave polygon and a triangle, less a hole; left-handed faces are turned."""
    base = """
    int[] faceVertexCounts = [5, 3, 4]
    int[] faceVertexIndices = [0, 1, 2, 3, 4, 0, 4, 3, 5, 6, 7, 8]
    int[] holeIndices = [2]
    point3f[] points = [(0, 0, 0), (4, 0, 0), (4, 4, 0), (2, 1, 0), (0, 4, 0),
        (9, 9, 9), (9, 9, 8), (9, 8, 8), (8, 8, 8)]
    uniform token subdivisionScheme = "none"
"""
    (right,) = read_usd(usda(tmp_path, mesh(base=base))).meshes
    (left,) = read_usd(usda(tmp_path, mesh('uniform token orientation = "leftHanded"', base=base))).meshes
    assert area(right) == pytest.approx(10 + 4)
    np.testing.assert_allclose(facing(right), [0, 0, 10 - 4])
    np.testing.assert_allclose(facing(left), [0, 0, -6])
    assert right.vertices.max() == 4


@pytest.mark.parametrize(
    ("interpolation", "values", "expected"),
    [
        ("constant", "[(1, 0, 0)]", None),
        ("uniform", "[(1, 0, 0), (0, 0, 1)]", [[0, 0, 1], [1, 0, 0]]),
        ("vertex", "[(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)]", [[0, 0, 1]]),
        ("varying", "[(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)]", [[0, 0, 1]]),
        (
            "faceVarying",
            "[(0, 0, 0), (0, 0, 0), (0.5, 0, 0), (0, 0, 0), (0, 0.25, 0), (0, 0, 0)]",
            [[0, 0.25, 0], [0.5, 0, 0]],
        ),
    ],
)
@pytest.mark.parametrize("indexed", [False, True])
def test_display_colors(
    tmp_path: Path, interpolation: str, values: str, expected: list[list[float]] | None, indexed: bool
) -> None:
    """Two triangles of a square; the colors at the corner that both share, which are linear."""
    base = SQUARE.replace("[4]", "[3, 3]").replace("[0, 1, 2, 3]", "[0, 1, 2, 0, 2, 3]")
    indices = ""
    if indexed:
        count = values.count("(")
        values = f"[{', '.join(reversed(values.strip('[]').replace('), ', ')|').split('|')))}]"
        indices = f"int[] primvars:displayColor:indices = [{', '.join(map(str, reversed(range(count))))}]"
    color = f'color3f[] primvars:displayColor = {values} (interpolation = "{interpolation}")\n{indices}'
    (read,) = read_usd(usda(tmp_path, mesh(color, base=base))).meshes
    if expected is None:
        assert read.material == Diffuse(color=(1.0, 0.0, 0.0)) and read.colors is None
    else:
        np.testing.assert_allclose(at(read, "colors", (1, 1, 0)), expected)
        assert read.material == Diffuse(color=(1.0, 1.0, 1.0))


def test_normals(tmp_path: Path) -> None:
    """Normals of vertices and corners are kept; the cage of a smooth surface without normals is shaded smoothly."""
    corners = 'normal3f[] normals = [(0, 0, 2), (1, 0, 1), (0, 1, 0), (0, 0, 1)] (interpolation = "faceVarying")'
    (read,) = read_usd(usda(tmp_path, mesh(corners))).meshes
    assert read.normals is not None
    np.testing.assert_allclose(at(read, "normals", (1, 0, 0)), [[math.sqrt(0.5), 0, math.sqrt(0.5)]], rtol=1e-6)
    np.testing.assert_allclose(at(read, "normals", (0, 0, 0)), [[0, 0, 1]])
    assert read_usd(usda(tmp_path, mesh())).meshes[0].normals is None
    cage = SQUARE.replace('"none"', '"catmullClark"')
    assert read_usd(usda(tmp_path, mesh(base=cage))).meshes[0].normals is not None


def test_visibility_purpose_and_activity(tmp_path: Path) -> None:
    hidden = "".join(
        f'def Xform "{name}" {extra} {mesh()} }}\n'
        for name, extra in {
            "shown": "{",
            "invisible": '{ token visibility = "invisible"\n',
            "proxy": '{ uniform token purpose = "proxy"\n',
            "guide": '{ uniform token purpose = "guide"\n',
            "render": '{ uniform token purpose = "render"\n',
            "inactive": "(active = false) {",
        }.items()
    )
    assert len(read_usd(usda(tmp_path, hidden)).meshes) == 2


INSTANCES = """
class "proto" { %s }
def Xform "one" (instanceable = true
    inherits = </proto>) { double3 xformOp:translate = (5, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"] }
def Xform "two" (instanceable = true
    inherits = </proto>) { double3 xformOp:scale = (-2, 1, 1)
    uniform token[] xformOpOrder = ["xformOp:scale"] }
"""


def test_instances_share_their_mesh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("clrt.scene.geometry.instancing.FEW_TRIANGLES", 1)
    model = read_usd(usda(tmp_path, INSTANCES % mesh()))
    assert len({id(each.mesh) for each in model.instances}) == 1 and len(model.instances) == 2
    np.testing.assert_allclose(extent(model), [[-2, 0, 0], [6, 1, 0]])
    facings = [facing(baked(each)) for each in model.instances]
    np.testing.assert_allclose(facings, [[0, 0, 1], [0, 0, 2]])  # a mirrored mesh still faces the same way


def test_point_instancers(tmp_path: Path) -> None:
    """Prototypes keep their own transform; ids that are invisible or inactive are left out; orientations turn."""
    path = usda(
        tmp_path,
        """
def PointInstancer "many" (inactiveIds = [12])
{
    double3 xformOp:translate = (0, 0, 100)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    rel prototypes = [</many/a>, </many/b>]
    int[] protoIndices = [0, 1, 1, 0]
    int64[] ids = [10, 11, 12, 13]
    int64[] invisibleIds = [13]
    point3f[] positions = [(10, 0, 0), (0, 20, 0), (7, 7, 7), (8, 8, 8)]
    quath[] orientations = [(1, 0, 0, 0), (0.70710678, 0, 0, 0.70710678), (1, 0, 0, 0), (1, 0, 0, 0)]
    float3[] scales = [(3, 1, 1), (1, 1, 1), (1, 1, 1), (1, 1, 1)]
"""
        + mesh(name="a")
        + 'def Xform "b" { double3 xformOp:translate = (0, 0, 1)\n'
        + 'uniform token[] xformOpOrder = ["xformOp:translate"]\n'
        + mesh()
        + "}}",
    )
    first, second = read_usd(path).meshes
    np.testing.assert_allclose([first.vertices.min(axis=0), first.vertices.max(axis=0)], [[10, 0, 100], [13, 1, 100]])
    ends = [second.vertices.min(axis=0), second.vertices.max(axis=0)]
    np.testing.assert_allclose(ends, [[-1, 20, 101], [0, 21, 101]], atol=2e-3)  # half-precision orientation


SOLIDS = {
    "Cube": ("double size = 3", 54.0, (3, 3, 3)),
    "Sphere": ("double radius = 2", 16 * math.pi, (4, 4, 4)),
    "Cylinder": ('double radius = 1\ndouble height = 5\nuniform token axis = "X"', 12 * math.pi, (5, 2, 2)),
    "Cone": ('double radius = 3\ndouble height = 4\nuniform token axis = "Y"', 24 * math.pi, (6, 4, 6)),
    "Capsule": ("double radius = 1\ndouble height = 2", 8 * math.pi, (2, 2, 4)),
    "Plane": ('double width = 2\ndouble length = 3\nuniform token axis = "Z"', 6.0, (2, 3, 0)),
}


@pytest.mark.parametrize("kind", SOLIDS)
def test_solids(tmp_path: Path, kind: str) -> None:
    """Areas and extents of shapes that have no points; all but the plane face outward."""
    attributes, expected, size = SOLIDS[kind]
    (read,) = read_usd(usda(tmp_path, f'def {kind} "solid" {{ {attributes} }}')).meshes
    assert area(read) == pytest.approx(expected, rel=5e-3)
    np.testing.assert_allclose(np.ptp(read.vertices, axis=0), size, rtol=1e-3)
    if kind == "Plane":
        np.testing.assert_allclose(facing(read), [0, 0, 6])
        return
    a, b, c = read.vertices.astype(np.float64)[read.faces].swapaxes(0, 1)
    assert (np.sum(np.cross(b - a, c - a) * (a + b + c), axis=1) > -1e-9).all()
    if kind == "Cone":
        assert at(read, "vertices", (0, 2, 0)).size  # the tip


def test_bounds_are_those_of_usd(tmp_path: Path) -> None:
    """Nested transforms of every kind against usd-core's BBoxCache, which is exact for axis-aligned rotations."""
    from pxr import Usd, UsdGeom

    path = usda(
        tmp_path,
        'def Xform "a" { float3 xformOp:rotateXYZ = (90, 0, 180)\ndouble3 xformOp:scale = (1, -2, 3)\n'
        'double3 xformOp:translate:pivot = (1, 2, 3)\nuniform token[] xformOpOrder = ["xformOp:translate:pivot", '
        '"xformOp:rotateXYZ", "xformOp:scale", "!invert!xformOp:translate:pivot"]\n'
        + mesh()
        + 'def Mesh "b" { matrix4d xformOp:transform = ((0, 1, 0, 0), (1, 0, 0, 0), (0, 0, 1, 0), (4, 5, 6, 1))\n'
        'uniform token[] xformOpOrder = ["!resetXformStack!", "xformOp:transform"]' + SQUARE + "}}",
    )
    stage = Usd.Stage.Open(str(path))
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.default_])
    box = cache.ComputeWorldBound(stage.GetPseudoRoot()).ComputeAlignedRange()
    np.testing.assert_allclose(extent(read_usd(path)), [box.GetMin(), box.GetMax()], atol=1e-6)


def test_cameras(tmp_path: Path) -> None:
    """The angle is that of the vertical aperture; an f-stop is a lens; lengths are in tenths of the stage's unit."""
    path = usda(
        tmp_path,
        mesh()
        + """
def Camera "main"
{
    float focalLength = 50
    float horizontalAperture = 36
    float verticalAperture = 24
    float fStop = 2
    float focusDistance = 400
    double3 xformOp:translate = (0, 100, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Camera "flat" { token projection = "orthographic"
    float verticalAperture = 200 }
""",
        meters=0.01,
    )
    scene = load(path)
    camera = scene.camera
    assert list(scene.cameras) == ["main", "flat"] and camera is scene.cameras["main"]
    assert camera.fov_degrees == pytest.approx(2 * math.degrees(math.atan(12 / 50)), rel=1e-5)
    assert camera.position == pytest.approx((0, 1, 0)) and camera.look_at == pytest.approx((0, 1, -4))
    assert camera.aperture_radius == pytest.approx(0.05 / 4)  # 5 units of 1 cm, over twice the f-stop
    assert load(path, camera="flat").camera.view_height == pytest.approx(0.2)


def test_times(tmp_path: Path) -> None:
    """The first time of the stage, or a time in seconds."""
    path = usda(
        tmp_path,
        'def Xform "a" { double3 xformOp:translate.timeSamples = { 12: (0, 0, 0), 36: (10, 0, 0) }\n'
        'uniform token[] xformOpOrder = ["xformOp:translate"]\n' + mesh() + "}",
    )
    text = path.read_text().replace("metersPerUnit", "startTimeCode = 12\n    endTimeCode = 36\n    metersPerUnit", 1)
    path.write_text(text)
    assert extent(read_usd(path))[0, 0] == 0
    assert extent(read_usd(path, choice=ModelChoice(time=0.5)))[0, 0] == pytest.approx(5)
    with pytest.raises(SceneError, match='a.usda: animation: 1 is unknown; use one of "stage"'):
        read_usd(path, choice=ModelChoice(animation=1))


def test_archives(tmp_path: Path) -> None:
    """Layers and textures are read out of the archive, unless it is compressed."""
    usda(tmp_path, mesh(), name="b.usda")
    content = b"#usda 1.0\n(subLayers = [@sub/b.usda@])\n"
    files = {"a.usda": content, "sub/b.usda": (tmp_path / "b.usda").read_bytes()}
    assert len(read_model(usdz(tmp_path / "a.usdz", files)).meshes) == 1
    with pytest.raises(SceneError, match='a.usdz: its file "a.usda" is compressed; pack it without compression'):
        read_model(usdz(tmp_path / "a.usdz", files, zipfile.ZIP_DEFLATED))


def test_what_is_ignored_is_counted(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    cage = SQUARE.replace('"none"', '"catmullClark"')
    content = (
        mesh(base=cage) + mesh(name="second", base=cage) + 'def BasisCurves "curves" {}\ndef GeometryLight "g" {}\n'
    )
    with caplog.at_level(logging.WARNING):
        read_usd(usda(tmp_path, content))
    assert (
        "ignored: prims of type BasisCurves (1), lights of type GeometryLight (1), subdivision of meshes" in caplog.text
    )
    assert "control cage (2)" in caplog.text


BROKEN = {
    "no usda": ("#usda 1.0\ndef Mesh {", "cannot be read as USD: "),
    "empty": ("", "cannot be read as USD: "),
    "nothing": ("#usda 1.0\n", "its stage contains no triangles"),
    "index": ("#usda 1.0\n" + mesh(base=SQUARE.replace("2, 3]", "2, 7]")), 'mesh "square": a face uses point 7'),
    "counts": ("#usda 1.0\n" + mesh(base=SQUARE.replace("[4]", "[5]")), "its faces have 5 corners, but it has 4"),
    "not finite": ("#usda 1.0\n" + mesh(base=SQUARE.replace("(1, 0, 0)", "(inf, 0, 0)")), "is not finite"),
    "unit": ("#usda 1.0\n(metersPerUnit = -1)\n" + mesh(), "metersPerUnit is -1"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_damaged_files_end_in_one_error(tmp_path: Path, name: str) -> None:
    content, message = BROKEN[name]
    (tmp_path / "a.usda").write_text(content)
    with pytest.raises(SceneError, match=f"a.usda: .*{message}") as raised:
        read_model(tmp_path / "a.usda")
    assert len(str(raised.value).splitlines()) == 1


def test_without_the_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("clrt.formats.usd.reader.find_spec", lambda _: None)
    with pytest.raises(SceneError, match="pip install usd-core"):
        read_model(usda(tmp_path, mesh()))


def test_textures_in_archives(tmp_path: Path) -> None:
    from .usd_files import BOUND, TEXTURED, material, texture

    imageio.imwrite(tmp_path / "image.png", np.full((2, 2, 3), 99, np.uint8))
    usda(tmp_path, mesh(ST + BOUND) + material(TEXTURED, texture("0/image.png")))
    files = {"a.usda": (tmp_path / "a.usda").read_bytes(), "0/image.png": (tmp_path / "image.png").read_bytes()}
    (read,) = read_model(usdz(tmp_path / "a.usdz", files)).meshes
    (used,) = read.material.textures()
    np.testing.assert_array_equal(used.picture.texels[..., :3], 99)
