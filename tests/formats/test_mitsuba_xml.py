"""Scenes in Mitsuba's XML: what is read, against the manual's words and closed forms, and what is said of mistakes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from clrt.errors import SceneError
from clrt.formats.images.image_reader import linear_from_srgb
from clrt.formats.load_scene import load
from clrt.formats.mitsuba.environment_map import rows_at_middles
from clrt.formats.mitsuba.primitives import cube, cylinder, disk, rectangle, sphere
from clrt.formats.mitsuba.reader import MitsubaScene, read_mitsuba
from clrt.formats.mitsuba.values import transform
from clrt.formats.mitsuba.xml import read_xml
from clrt.formats.scene_parts.notes import UnsupportedError
from clrt.formats.scene_parts.texture_images import pair_of_texels
from clrt.scene.materials.material_types import Conductor, Dielectric, Diffuse, Mirror
from clrt.scene.materials.textures import Texture
from clrt.scene.model import Mesh, Scene
from clrt.scene.spectra import rgb_of_spectrum

LIGHT = '<emitter type="constant"/>'


def scene(folder: Path, text: str) -> Scene:
    """The scene in an XML file of these elements."""
    path = folder / "scene.xml"
    path.write_text(f"<scene version='3.0.0'>{text}</scene>")
    return load(path)


def problem(folder: Path, text: str) -> str:
    """What is said of such a file."""
    with pytest.raises(SceneError) as error:
        scene(folder, text)
    return str(error.value)


def material(folder: Path, bsdf: str) -> object:
    return scene(folder, f'<shape type="rectangle">{bsdf}</shape>').meshes[0].material


def test_steps_of_a_transform_are_taken_in_the_order_written() -> None:
    """A point through each step by itself, by scipy's rotations."""
    rng = np.random.default_rng(5)
    for _ in range(20):
        axis, offset, factors = rng.normal(size=(3, 3))
        angle = rng.uniform(-360, 360)
        steps = {
            "rotate": {"value": " ".join(map(str, axis)), "angle": str(angle)},
            "translate": dict(zip("xyz", map(str, offset))),
            "scale": {"value": ", ".join(map(str, factors))},
        }
        turn = Rotation.from_rotvec(np.radians(angle) * axis / np.linalg.norm(axis))
        does = {"rotate": turn.apply, "translate": lambda p, by=offset: p + by, "scale": lambda p, by=factors: p * by}
        order = [str(name) for name in rng.permutation([*steps])]
        point = expected = rng.normal(size=3)
        for name in order:
            expected = does[name](expected)
        matrix = transform([(name, steps[name]) for name in order])
        np.testing.assert_allclose((matrix @ [*point, 1])[:3], expected, atol=1e-9)


def test_a_camera_looks_where_lookat_says_and_as_wide_as_fov_says(folder: Path) -> None:
    """fov is along x, by default; of the 50 mm that stand for it the diagonal of 36 x 24 mm."""
    text = """<sensor type="perspective">{}<transform name="to_world"><lookat origin="1, 2, 3" target="4, 6, 3"
              up="0, 0, 1"/></transform><film type="hdrfilm"><integer name="width" value="300"/>
              <integer name="height" value="200"/></film></sensor>"""
    camera = scene(folder, text.format('<float name="fov" value="60"/>')).camera
    np.testing.assert_allclose(camera.position, [1, 2, 3])
    np.testing.assert_allclose(np.subtract(camera.look_at, camera.position), [0.6, 0.8, 0], atol=1e-12)
    np.testing.assert_allclose(camera.up, [0, 0, 1], atol=1e-12)
    assert np.tan(np.radians(camera.fov_degrees / 2)) * 1.5 == pytest.approx(np.tan(np.radians(30)))
    film = scene(folder, text.format("")).camera
    diagonal = np.tan(np.radians(film.fov_degrees / 2)) * np.hypot(1.5, 1)
    assert diagonal == pytest.approx(np.hypot(36, 24) / 2 / 50)
    settings = scene(folder, text.format("")).render
    assert settings.size == (300, 200) and settings.filter == "gaussian"


def test_defaults_includes_references_and_paths(folder: Path) -> None:
    (folder / "parts").mkdir()
    (folder / "parts" / "look.xml").write_text(
        '<scene version="3.0.0"><bsdf type="diffuse" id="red">'
        '<rgb name="reflectance" value="$shade, 0, 0"/></bsdf></scene>'
    )
    read = scene(
        folder,
        """<default name="shade" value="0.25"/><default name="shade" value="0.75"/>
        <path value="parts"/><include filename="look.xml"/>
        <shape type="sphere"><ref id="red"/></shape><shape type="sphere"><ref id="red"/></shape>""",
    )
    first, second = read.spheres
    assert first.material == Diffuse(color=(0.25, 0, 0)) and second.material is first.material


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('<shape type="torus"/>', ["shape[0]", '"torus"', "use rectangle"]),
        ('<shape type="sphere"><bsdf type="velvet" id="v"/></shape>', ['bsdf "v"', '"velvet"', "diffuse"]),
        ('<shape type="sphere"><ref id="none"/></shape>', ["shape[0]", '"none"', "define it"]),
        ('<shape type="sphere"><float name="radius" value="wide"/></shape>', ["shape[0].radius", '"wide"', "a number"]),
        ('<shape type="sphere"><float name="girth" value="2"/></shape>', ["shape[0]", '"girth"', "leave it out"]),
        ('<shape type="sphere"><float name="radius" value="$r"/></shape>', ["line 1", "$r", "<default"]),
        ('<shape type="sphere"><frame name="x"/></shape>', ["shape[0]", "<frame>", "transform"]),
        ('<shape type="obj"><string name="filename" value="gone.obj"/></shape>', ["gone.obj", "no such model file"]),
        ('<emitter type="ies"/>', ["line 1: emitter[0]", '"ies"', "point", "--approximate"]),
        ('<integrator type="path"><boolean name="hide_emitters" value="true"/></integrator>', ["hide_emitters"]),
        (
            '<sensor type="perspective"><transform name="to_world"><scale x="-1"/></transform></sensor>',
            ["sensor[0]", "mirrors"],
        ),
        (
            '<sensor type="perspective"><transform name="to_world"><shear value="2"/></transform></sensor>',
            ["sensor[0].to_world", "rotate"],
        ),
        ('<emitter type="constant"/><emitter type="constant"/>', ["several environment lights"]),
        ('<shape type="sphere"><bsdf type="ggx"/></shape>', ["shape[0].bsdf", '"ggx"', "roughdielectric"]),
        (
            '<shape type="sphere"><bsdf type="conductor"><string name="material" value="Xy"/></bsdf></shape>',
            ['"Xy"', "Au"],
        ),
        (
            '<shape type="sphere"><bsdf type="dielectric"><string name="int_ior" value="jam"/></bsdf></shape>',
            ["int_ior", '"jam"', "bk7"],
        ),
        ('<include filename="scene.xml"/>', ["scene.xml", "included more than"]),
        ("<shape>", ["is not valid XML"]),
    ],
    ids=str,
)
def test_mistakes_are_named(folder: Path, text: str, words: list[str]) -> None:
    """By file, object, value and remedy."""
    said = problem(folder, text)
    assert str(folder / "scene.xml") in said and all(word in said for word in words), said


def test_all_that_is_unsupported_is_listed(folder: Path) -> None:
    (folder / "scene.xml").write_text("""<scene version="3.0.0"><shape type="torus"/><emitter type="collimated"/>
        <shape type="sphere"><bsdf type="hair"/></shape><integrator type="depth"/></scene>""")
    with pytest.raises(UnsupportedError) as error:
        read_mitsuba(folder / "scene.xml")
    assert error.value.features == ["shape torus", "bsdf hair", "emitter collimated", "integrator depth"]
    read = read_mitsuba_of(folder, '<shape type="sphere"><bsdf type="hair"/></shape><shape type="sphere"/>')
    assert read.missing == {"shape[0]": ["bsdf hair"]} and len(read.scene.spheres) == 2


def read_mitsuba_of(folder: Path, text: str) -> MitsubaScene:
    (folder / "scene.xml").write_text(f"<scene version='3.0.0'>{text}</scene>")
    return read_mitsuba(folder / "scene.xml", Diffuse())


def test_materials(folder: Path) -> None:
    assert material(folder, "") == Diffuse(color=(0.5, 0.5, 0.5))
    assert material(folder, '<emitter type="area"/>') == Diffuse(color=(0, 0, 0), emission=(1, 1, 1))
    twosided = '<bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="#ff0000"/></bsdf></bsdf>'
    assert material(folder, twosided) == Diffuse(color=(1, 0, 0))
    mask = '<bsdf type="mask"><float name="opacity" value="0.3"/><bsdf type="conductor"/></bsdf>'
    assert material(folder, mask) == Mirror(opacity=0.3)
    metal = (
        '<bsdf type="roughconductor"><spectrum name="eta" value="0.5"/><spectrum name="k" value="3"/>'
        '<float name="alpha" value="0.04"/><string name="distribution" value="ggx"/></bsdf>'
    )
    assert material(folder, metal) == Conductor(eta=(0.5,) * 3, k=(3.0,) * 3, roughness=0.2, smith="separable")
    glass = '<bsdf type="dielectric"><string name="int_ior" value="water"/><float name="ext_ior" value="1"/></bsdf>'
    assert material(folder, glass) == Dielectric(ior=1.333)
    medium = (
        '<medium type="homogeneous" name="interior"><rgb name="sigma_t" value="1, 2, 4"/>'
        '<float name="scale" value="0.5"/><rgb name="albedo" value="0"/></medium>'
    )
    inside = material(folder, glass + medium)
    assert isinstance(inside, Dielectric) and inside.attenuation_distance == 0.5
    np.testing.assert_allclose(-np.log(inside.attenuation_color) / 0.5, [0.5, 1, 2])


def test_a_blend_of_two_colors(folder: Path) -> None:
    colors = "".join(f'<bsdf type="diffuse"><rgb name="reflectance" value="{value}"/></bsdf>' for value in (0.2, 0.6))
    blend = f'<bsdf type="blendbsdf"><float name="weight" value="0.25"/>{colors}</bsdf>'
    found = material(folder, blend)
    assert isinstance(found, Diffuse) and found.color == pytest.approx((0.3, 0.3, 0.3))


@settings(max_examples=200, deadline=None)
@given(st.floats(0, 1), st.floats(0, 1), st.booleans())
def test_checkerboards_keep_both_colors(first: float, second: float, encoded: bool) -> None:
    """The brighter one to rounding, the other to half a step of 8 bits; those of the test scenes to 1e-4."""
    one, other, factor = pair_of_texels(first, second, encoded)
    texels = np.array([one, other], np.float32) / np.float32(255)
    values = linear_from_srgb(texels) if encoded else texels
    assert 0 <= factor <= 1 and 0 <= min(one, other) and max(one, other) <= 255
    np.testing.assert_allclose(max(values) * factor, max(first, second), rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(values * factor, [first, second], atol=4.6e-3 if encoded else 2e-3)


@pytest.mark.parametrize(("first", "second"), [(0.4, 0.2), (0.8, 0.1), (0.2, 0.4), (0.0, 0.3)])
def test_common_checkerboards_are_exact(first: float, second: float) -> None:
    one, other, factor = pair_of_texels(first, second, True)
    values = linear_from_srgb(np.array([one, other], np.float32) / np.float32(255)) * factor
    np.testing.assert_allclose(values, [first, second], atol=1e-4)


def test_textures_lie_as_to_uv_says(folder: Path) -> None:
    bsdf = """<bsdf type="diffuse"><texture type="checkerboard" name="reflectance"><transform name="to_uv">
        <scale x="3" y="-2"/><rotate z="1" angle="30"/><translate x="0.1" y="0.7"/></transform></texture></bsdf>"""
    found = material(folder, bsdf)
    assert isinstance(found, Diffuse) and isinstance(found.color, Texture)
    turn = Rotation.from_euler("z", 30, degrees=True).as_matrix()[:2, :2]
    expected = np.column_stack([turn @ np.diag([3, -2]), [0.1, 0.7]])
    np.testing.assert_allclose(found.color.to_picture, expected, atol=1e-12)


AREAS = [(rectangle, 4), (cube, 24), (sphere, 4 * np.pi), (disk, np.pi), (cylinder, 2 * np.pi)]


@pytest.mark.parametrize(("make", "area"), AREAS, ids=lambda value: getattr(value, "__name__", ""))
def test_shapes_without_a_file(make: object, area: float) -> None:
    """Area, and faces that are wound as their normals say and lie where texture coordinates say."""
    mesh = make()  # type: ignore[operator]
    assert isinstance(mesh, Mesh) and mesh.normals is not None and mesh.uv is not None
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.linalg.norm(cross, axis=1).sum() / 2 == pytest.approx(area, rel=2e-4)
    solid = np.linalg.norm(cross, axis=1) > 1e-9
    assert np.all(np.einsum("ij,ij->i", cross, mesh.normals[mesh.faces].sum(1))[solid] > 0)


def test_places_of_texture_coordinates() -> None:
    """After the manual's parametrizations."""
    u, v = sphere().uv.astype(np.float64).T  # type: ignore[union-attr]
    ball = [np.cos(2 * np.pi * u) * np.sin(np.pi * v), np.sin(2 * np.pi * u) * np.sin(np.pi * v), np.cos(np.pi * v)]
    np.testing.assert_allclose(sphere().vertices, np.transpose(ball), atol=1e-6)
    r, turn = disk().uv.astype(np.float64).T  # type: ignore[union-attr]
    np.testing.assert_allclose(disk().vertices[:, 0], r * np.cos(2 * np.pi * turn), atol=1e-6)
    np.testing.assert_allclose(rectangle().vertices[:, :2], 2 * rectangle().uv - 1)  # type: ignore[operator]


def test_spheres_and_instances(folder: Path) -> None:
    """A group of a mesh and a sphere, drawn by its instances alone."""
    read = scene(
        folder,
        """<shape type="shapegroup" id="group"><shape type="rectangle"/><shape type="sphere">
        <point name="center" value="1, 0, 0"/><float name="radius" value="0.5"/></shape></shape>
        <shape type="instance"><ref id="group"/><transform name="to_world"><scale value="2"/>
        <rotate z="1" angle="90"/></transform></shape><shape type="instance"><ref id="group"/></shape>""",
    )
    assert not read.meshes and len(read.instances) == 2 and read.instances[0].mesh is read.instances[1].mesh
    np.testing.assert_allclose(read.spheres[0].center, [0, 2, 0], atol=1e-12)
    assert read.spheres[0].radius == pytest.approx(1) and read.spheres[1].radius == pytest.approx(0.5)


PLY = """ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
property float u
property float v
property float color_0
property float color_1
property float color_2
element face 2
property list uchar int vertex_indices
property float weight_0
end_header
0 0 0 0 0 .1 .2 .3
1 0 0 1 0 .4 .5 .6
1 1 0 1 1 .7 .8 .9
0 1 0 0 1 0 0 1
3 0 1 2 .25
3 0 2 3 1
"""


def test_attributes_of_a_mesh(folder: Path) -> None:
    (folder / "a.ply").write_text(PLY)
    shape = '<shape type="ply"><string name="filename" value="a.ply"/>{}</shape>'
    texture = '<texture type="mesh_attribute" name="{}"><string name="name" value="{}"/></texture>'
    mesh = scene(
        folder, shape.format(f'<bsdf type="diffuse">{texture.format("reflectance", "vertex_color")}</bsdf>')
    ).meshes[0]
    assert mesh.colors is not None and mesh.uv is not None and mesh.normals is not None
    np.testing.assert_allclose(mesh.colors, [(0.1, 0.2, 0.3), (0.4, 0.5, 0.6), (0.7, 0.8, 0.9), (0, 0, 1)], rtol=1e-6)
    np.testing.assert_array_equal(mesh.uv, [(0, 0), (1, 0), (1, 1), (0, 1)])  # upright, unlike OBJ's
    np.testing.assert_allclose(mesh.normals, np.tile([0, 0, 1], (4, 1)), atol=1e-6)
    colors = "".join(
        f'<bsdf type="diffuse"><rgb name="reflectance" value="{value}"/></bsdf>' for value in ("0 0 0", "1 .5 .5")
    )
    blend = f'<bsdf type="blendbsdf">{texture.format("weight", "face_weight")}{colors}</bsdf>'
    mesh = scene(folder, shape.format(blend)).meshes[0]
    assert mesh.colors is not None
    np.testing.assert_allclose(mesh.colors, np.repeat([(0.25, 0.125, 0.125), (1, 0.5, 0.5)], 3, axis=0))
    assert "face_weight" in problem(folder, shape.format(blend.replace("face_weight", "face_wait")))


def test_spectra() -> None:
    """A surface that reflects all is white under D65; luminance is 1 for a radiance of 1 at all wavelengths."""
    np.testing.assert_allclose(rgb_of_spectrum((300, 900), (1, 1), lit=True), [1, 1, 1], atol=2e-4)
    equal = rgb_of_spectrum((300, 900), (1, 1), lit=False)
    assert np.dot([0.212671, 0.715160, 0.072169], equal) == pytest.approx(1, abs=1e-5)
    red, green, blue = rgb_of_spectrum((590, 600, 700, 710), (0, 1, 1, 0), lit=True)
    assert red > 0.3 and green < 0.1 and blue < 0.01


def test_skies_keep_what_varies_linearly_between_poles() -> None:
    rows = np.linspace(3, 7, 9, dtype=np.float32)[:, None, None] * np.ones((1, 4, 3), np.float32)
    image = rows_at_middles(rows)
    middles = (np.arange(len(image)) + 0.5) / len(image)
    np.testing.assert_allclose(image[:, 2, 1], 3 + 4 * middles, rtol=1e-6)


def test_the_tree_keeps_names_and_ids(folder: Path) -> None:
    (folder / "scene.xml").write_text(
        '<scene version="3.0.0"><bsdf type="diffuse" id="a"/><shape type="sphere"><ref id="a"/></shape></scene>'
    )
    root = read_xml(folder / "scene.xml")
    assert [child.where for _, child in root.children] == ['bsdf "a"', "shape[0]"]
    assert root.children[1][1].all("bsdf") == [root.children[0][1]]
