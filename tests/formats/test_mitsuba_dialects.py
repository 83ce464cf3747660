"""Scenes of Mitsuba 0.x, what clrt lacks of Mitsuba, and XML that is made to exhaust a reader."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from clrt.cli.convert import command as convert
from clrt.cli.info import command as info
from clrt.errors import SceneError, UsageError
from clrt.formats.images.image_reader import linear_from_srgb, read_picture
from clrt.formats.load_scene import load
from clrt.formats.mitsuba.environment_map import rows_at_middles, turned_map
from clrt.formats.mitsuba.values import blackbody
from clrt.output.images import write_image
from clrt.scene.lights import PointLight, SpotLight
from clrt.scene.materials.material_types import Conductor, Diffuse, Mirror, Phong
from clrt.scene.materials.textures import Texture
from clrt.scene.model import Scene

from .test_mitsuba_xml import material, problem, scene

GGX = '<string name="distribution" value="ggx"/>'


def old(folder: Path, text: str) -> Scene:
    """Return the scene in an XML file of Mitsuba 0.6."""
    (folder / "old.xml").write_text(f"<scene version='0.6.0'>{text}</scene>")
    return load(folder / "old.xml")


def test_old_names_are_read_as_mitsuba_3_renames_them(folder: Path) -> None:
    read = old(
        folder,
        """<default name="maxDepth" value="7"/><integrator type="sppm"><integer name="maxDepth" value="$maxDepth"/>
        <integer name="photonCount" value="1000"/></integrator>
        <sensor type="perspective"><float name="fov" value="60"/><string name="fovAxis" value="y"/>
        <float name="nearClip" value="1"/>
        <transform name="toWorld"><lookAt origin="1, 2, 3" target="1, 2, 0"/></transform>
        <film type="ldrfilm"><integer name="width" value="30"/><integer name="height" value="20"/>
        <float name="gamma" value="2.2"/><boolean name="highQualityEdges" value="true"/></film>
        <sampler type="sobol"><integer name="sampleCount" value="16"/></sampler></sensor>
        <shape type="rectangle"><transform name="toWorld"><translate x="5"/></transform>
        <bsdf type="roughconductor"><rgb name="eta" value="1"/><rgb name="k" value="3"/><float name="extEta" value="2"/>
        <float name="alphaU" value="0.04"/><float name="alphaV" value="0.04"/></bsdf></shape>
        <shape type="sphere"><bsdf type="diffuse"><rgb name="diffuseReflectance" value="0.25"/></bsdf></shape>""",
    )
    assert (read.render.max_depth, read.render.size, read.render.spp) == (7, (30, 20), 16)
    assert tuple(read.camera.position) == (1, 2, 3)
    assert read.camera.fov_degrees == pytest.approx(60)
    assert read.meshes[0].vertices[:, 0].min() == 4
    metal = Conductor(eta=(0.5,) * 3, k=(1.5,) * 3, roughness=0.2, distribution="beckmann", smith="separable")
    assert read.meshes[0].material == metal and read.spheres[0].material == Diffuse(color=(0.25,) * 3)


def test_old_textures(folder: Path) -> None:
    """(uv + offset)·scale, as Mitsuba 3 reads uoffset and the others; `gamma` 1 is linear."""
    write_image(folder / "a.png", np.full((1, 1, 3), 0.5, np.float32))
    for gamma, expected in ((1.0, 188 / 255), (2.2, float(linear_from_srgb(np.array([188 / 255], np.float32))[0]))):
        read = old(
            folder,
            f"""<shape type="rectangle"><bsdf type="diffuse"><texture name="reflectance" type="bitmap">
            <string name="filename" value="a.png"/><float name="gamma" value="{gamma}"/>
            <string name="filterType" value="ewa"/><string name="wrapModeV" value="clamp"/>
            <float name="uoffset" value="0.5"/><float name="uscale" value="3"/><float name="vscale" value="4"/>
            </texture></bsdf></shape>""",
        )
        found = read.meshes[0].material
        assert isinstance(found, Diffuse) and isinstance(found.color, Texture)
        np.testing.assert_allclose(found.color.to_picture, [[3.0, 0.0, 1.5], [0.0, 4.0, 0.0]], atol=1e-12)
        assert found.color.wrap == ("repeat", "clamp") and found.color.filter == "linear"
        encoded = np.asarray(found.color.picture.texels[0, 0, :3] / 255, np.float32)
        np.testing.assert_allclose(linear_from_srgb(encoded), expected, atol=4e-3)


def test_colors(folder: Path) -> None:
    light = '<emitter type="point">{}</emitter>'
    for text, expected in (
        ('<spectrum name="intensity" value="0.1, 0.2, 0.3"/>', (0.1, 0.2, 0.3)),
        ('<srgb name="intensity" value="#ff0080"/>', (1, 0, 0.21586)),
        ('<srgb name="intensity" value="0.5"/>', (0.21404,) * 3),
        ('<rgb name="intensity" value="#00ff00"/>', (0, 1, 0)),
    ):
        (found,) = scene(folder, light.format(text)).lights
        assert isinstance(found, PointLight) and found.intensity == pytest.approx(expected, abs=1e-4)
    for text in ("#12345", "#-10000", "1, 2", "", "1 2 3 4"):
        assert "cannot be read" in problem(folder, light.format(f'<rgb name="intensity" value="{text}"/>'))


def test_black_bodies() -> None:
    """The luminance at the freezing point of platinum, 2042 K, is 60 cd/cm², the definition of the candela from 1948 to
    1979 (683 lm/W, and the integral of the color matching function is 106.857 nm)."""
    weights = [0.212671, 0.715160, 0.072169]
    y = np.dot(weights, blackbody("2042", "1").values) * 106.857
    assert 683 * y == pytest.approx(6e5, rel=0.01)
    red, green, blue = blackbody("2000K", "2").values
    assert red > green > blue and red == 2 * blackbody("2000", "1").values[0]
    assert max(blackbody("1", "1").values) < 1e-99


def test_a_conductor_has_mitsubas_reflectance_and_distribution(folder: Path) -> None:
    rough = f'<bsdf type="roughconductor">{GGX}<float name="alpha" value="0.04"/>{{}}</bsdf>'
    tint = '<rgb name="specular_reflectance" value="0.5, 0.25, 1"/>'
    found = material(folder, rough.format('<string name="material" value="Au"/>' + tint))
    assert isinstance(found, Conductor)
    assert found.reflectance == pytest.approx((0.5, 0.25, 1))
    assert found.distribution == "ggx"
    perfect = material(folder, rough.format(tint).replace("ggx", "beckmann"))
    assert isinstance(perfect, Conductor) and perfect.distribution == "beckmann" and perfect.roughness == 0.2
    assert perfect.eta and perfect.k
    index = complex(perfect.eta[0], perfect.k[0])
    assert abs((index - 1) / (index + 1)) ** 2 == pytest.approx(1, abs=5e-4)  # material "none"
    assert material(folder, f'<bsdf type="conductor">{tint}</bsdf>') == Mirror(color=(0.5, 0.25, 1))


def test_alpha_may_be_a_texture(folder: Path) -> None:
    """roughness² = alpha."""
    texture = """<texture type="checkerboard" name="alpha"><float name="color0" value="0.09"/>
        <float name="color1" value="0.25"/></texture>"""
    found = material(folder, f'<bsdf type="roughconductor">{GGX}{texture}</bsdf>')
    assert isinstance(found, Conductor) and isinstance(found.roughness, Texture)
    values = found.roughness.picture.texels[0, :, 0] / 255 * found.roughness.factor
    np.testing.assert_allclose(sorted(values), [0.3, 0.5], atol=3e-3)


def test_phong_of_mitsuba_0(folder: Path) -> None:
    read = old(
        folder,
        """<shape type="sphere"><bsdf type="phong"><spectrum name="diffuseReflectance" value="0.1, 0.2, 0.3"/>
        <rgb name="specularReflectance" value="0.4"/><float name="exponent" value="20"/></bsdf></shape>""",
    )
    assert read.spheres[0].material == Phong(color=(0.1, 0.2, 0.3), specular=(0.4,) * 3, shininess=20)


def test_spots(folder: Path) -> None:
    """The cone inside which the light is constant is ¾ of the outer one, unless it is given."""
    text = """<emitter type="spot"><rgb name="intensity" value="1, 2, 3"/><float name="cutoff_angle" value="40"/>{}
        <transform name="to_world"><lookat origin="1, 2, 3" target="1, 2, 0" up="0, 1, 0"/></transform></emitter>"""
    for given, inner in (("", 30), ('<float name="beam_width" value="10"/>', 10)):
        (found,) = scene(folder, text.format(given)).lights
        assert found == SpotLight(
            position=(1, 2, 3),
            direction=(0, 0, -1),
            intensity=(1, 2, 3),
            inner_degrees=inner,
            outer_degrees=40,
            falloff="angle",
        )


def test_flipped_and_invisible_shapes(folder: Path) -> None:
    """flip_normals turns a shape over; a boundary without a BSDF is left out, unless it emits light."""
    flip, light = '<boolean name="flip_normals" value="true"/>', '<emitter type="area"/>'
    (mesh,) = scene(folder, f'<shape type="rectangle">{flip}{light}</shape>').meshes
    assert mesh.normals is not None and np.all(mesh.normals == (0, 0, -1))
    a, b, c = mesh.vertices[mesh.faces[0]]
    assert np.cross(b - a, c - a)[2] < 0
    (mesh,) = scene(folder, f'<shape type="sphere">{flip}{light}</shape>').meshes
    assert mesh.normals is not None and np.all(np.einsum("ij,ij->i", mesh.normals, mesh.vertices) < 0)
    assert len(scene(folder, f'<shape type="sphere">{flip}</shape>').spheres) == 1  # which looks the same
    assert not scene(folder, '<shape type="sphere"><bsdf type="null"/></shape>').spheres


def test_an_emitter_of_shapes_may_stand_outside(folder: Path) -> None:
    text = '<emitter type="area" id="lit"><rgb name="radiance" value="3"/></emitter>'
    assert scene(folder, text + '<shape type="sphere"><ref id="lit"/></shape>').spheres[0].material.radiance == (3,) * 3


def rotated(matrix: np.ndarray) -> np.ndarray:
    """Return an environment map of Mitsuba's, 1 + its direction, resampled after this matrix; and by direction."""
    height, width = 257, 512
    theta, phi = np.pi * np.arange(height) / (height - 1), 2 * np.pi * (np.arange(width) + 0.5) / width
    return turned_map(np.asarray(1 + directions(theta, phi), np.float32), matrix)


def directions(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """Return the directions (h, w, 3) of the manual's mapping: u = atan2(x, −z)/2π, v = acos(y)/π."""
    y, across = np.cos(theta)[:, None], np.sin(theta)[:, None]
    return np.stack([across * np.sin(phi), np.broadcast_to(y, (len(theta), len(phi))), -across * np.cos(phi)], axis=2)


@pytest.mark.parametrize("mirrored", [False, True])
def test_environment_maps_may_be_rotated_about_any_axis(mirrored: bool) -> None:
    rng = np.random.default_rng(3)
    matrix = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    matrix *= np.sign(np.linalg.det(matrix)) * (-1 if mirrored else 1)
    image = rotated(matrix)
    height, width = image.shape[:2]
    world = directions(np.pi * (np.arange(height) + 0.5) / height, 2 * np.pi * (np.arange(width) + 0.5) / width)
    np.testing.assert_allclose(image, 1 + world @ matrix, atol=2e-4)


def test_a_scaled_texture(folder: Path) -> None:
    """Mitsuba 0.x's `scale`, a texture times a color, of which a number takes the luminance."""
    write_image(folder / "a.png", np.full((1, 1, 3), 0.5, np.float32))
    text = """<shape type="rectangle"><bsdf type="{}"><texture name="{}" type="scale">
        <rgb name="scale" value="0.2, 0.4, 0.8"/><texture type="bitmap"><string name="filename" value="a.png"/>
        </texture></texture>{}</bsdf></shape>"""
    color = old(folder, text.format("diffuse", "reflectance", "")).meshes[0].material
    assert isinstance(color, Diffuse) and isinstance(color.color, Texture) and color.color.factor == (0.2, 0.4, 0.8)
    opacity = old(folder, text.format("mask", "opacity", '<bsdf type="diffuse"/>')).meshes[0].material.opacity
    assert isinstance(opacity, Texture) and opacity.factor == pytest.approx(
        0.2 * 0.2127 + 0.4 * 0.7152 + 0.8 * 0.0722, rel=1e-3
    )


def test_a_missing_ply_file_and_zero_normals(folder: Path) -> None:
    """A missing file is named like others; a vertex whose normal is zero gets the smooth one."""
    shape = '<shape type="ply"><string name="filename" value="a.ply"/></shape>'
    assert "a.ply: no such model file" in problem(folder, shape)
    vertices = "0 0 0 0 0 0\n1 0 0 0 1 0\n0 1 0 0 1 0\n"
    header = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
    (folder / "a.ply").write_text(
        f"ply\nformat ascii 1.0\nelement vertex 3\n{header}element face 1\nproperty list uchar int vertex_indices\n"
        f"end_header\n{vertices}3 0 1 2\n"
    )
    normals = scene(folder, shape).meshes[0].normals
    np.testing.assert_allclose(normals, [[0, 0, 1], [0, 1, 0], [0, 1, 0]])  # type: ignore[arg-type]


def test_a_rotation_about_y_is_not_resampled(folder: Path) -> None:
    write_image(folder / "sky.exr", np.random.default_rng(1).random((4, 8, 3), np.float32))
    text = """<emitter type="envmap"><string name="filename" value="sky.exr"/><transform name="to_world">{}
        </transform></emitter>"""
    turned = scene(folder, text.format('<rotate y="1" angle="30"/>')).environment
    assert turned.rotation_degrees == pytest.approx(30) and turned.image is not None
    upright = scene(folder, text.format('<rotate x="1" angle="90"/>')).environment
    assert upright.rotation_degrees == 0 and upright.image is not None
    np.testing.assert_array_equal(turned.image, rows_at_middles(read_picture(folder / "sky.exr")))
    assert "stretches" in problem(folder, text.format('<scale x="2"/>'))


STAND_INS = [
    ('<bsdf type="hair"/>', "a diffuse surface"),
    ('<bsdf type="coating"><bsdf type="diffuse"/></bsdf>', "the BSDF inside"),
    ('<bsdf type="roughplastic"><string name="distribution" value="phong"/></bsdf>', "GGX of the same alpha"),
    ('<bsdf type="twosided"><bsdf type="diffuse"/><bsdf type="diffuse"/></bsdf>', "the first is used"),
    ('<bsdf type="diffuse"><float name="shine" value="1"/></bsdf>', "ignored"),
    ('<bsdf type="plastic"><rgb name="diffuse_reflectance" value="255, 0, 9"/></bsdf>', "1 is used"),
    ('<bsdf type="dielectric"/><medium name="interior" type="homogeneous"/>', "left out"),
    ('<emitter type="sunny"/>', "left out"),
]


@pytest.mark.parametrize(("text", "stand_in"), STAND_INS)
def test_what_clrt_lacks_is_refused_or_replaced(
    folder: Path, caplog: pytest.LogCaptureFixture, text: str, stand_in: str
) -> None:
    """With the line and the remedy, which names the stand-in; and with a warning that says the same."""
    said = problem(folder, f'\n<shape type="sphere">{text}</shape>')
    assert "line 2: " in said and "--approximate" in said and stand_in in said, said
    caplog.clear()
    with caplog.at_level(logging.WARNING):
        read = load(folder / "scene.xml", approximate=True)
    assert len(read.spheres) == 1 and any(stand_in in message for message in caplog.messages)


def test_other_parts_that_clrt_lacks(folder: Path, caplog: pytest.LogCaptureFixture) -> None:
    text = """<shape type="sdfgrid"/><emitter type="collimated"/><integrator type="depth"/>
        <shape type="sphere"><bsdf type="hair"><float name="melanin" value="1"/></bsdf></shape>
        <sensor type="perspective"><transform name="to_world"><scale x="-1"/></transform>
        <film type="hdrfilm"><rfilter type="lanczos"/></film></sensor>"""
    said = problem(folder, text)
    assert all(word in said for word in ("sdfgrid", "collimated", "depth", "hair", "mirrors", "lanczos")), said
    read = load(folder / "scene.xml", approximate=True)
    assert (len(read.spheres), len(read.lights), read.render.integrator) == (1, 0, "path")
    assert isinstance(read.spheres[0].material, Diffuse)


def test_approximate_is_an_option_for_mitsubas_scenes_alone(folder: Path) -> None:
    (folder / "a.xml").write_text('<scene version="3.0.0"><shape type="sphere"><bsdf type="hair"/></shape></scene>')
    done = CliRunner().invoke(info, [str(folder / "a.xml")])
    assert isinstance(done.exception, SceneError) and "line 1: shape[0].bsdf" in str(done.exception)
    done = CliRunner().invoke(info, [str(folder / "a.xml"), "--approximate"])
    assert done.exit_code == 0, done.output
    (folder / "a.toml").write_text("[[sphere]]\nradius = 1\n")
    with pytest.raises(UsageError, match="approximate"):
        load(folder / "a.toml", approximate=True)


def test_convert_writes_the_same_scene(folder: Path) -> None:
    (folder / "a.xml").write_text(
        """<scene version="3.0.0"><shape type="rectangle"><bsdf type="roughconductor"><float name="alpha" value="0.04"/>
        <rgb name="specular_reflectance" value="0.5, 0.25, 1"/></bsdf></shape><emitter type="spot"/></scene>"""
    )
    done = CliRunner().invoke(convert, [str(folder / "a.xml"), str(folder / "a.toml")])
    assert done.exit_code == 0, done.output
    first, second = load(folder / "a.xml"), load(folder / "a.toml")
    assert (first.meshes[0].material, first.lights) == (second.meshes[0].material, second.lights)
    np.testing.assert_array_equal(first.meshes[0].vertices, second.meshes[0].vertices)


def bomb(levels: int, start: str, use: str) -> str:
    """Return declarations of which each uses the one before ten times."""
    names = [f"n{i}" for i in range(levels)]
    lines = [start.format(names[0], "x" * 10)]
    return "".join(lines + [start.format(b, use.format(a) * 10) for a, b in zip(names, names[1:])])


HUGE = {
    "entities": f"<!DOCTYPE scene [{bomb(9, '<!ENTITY {} {!r}>', '&{};')}]><scene version='3.0.0'>&n8;</scene>",
    "external": "<!DOCTYPE scene [<!ENTITY a SYSTEM 'file:///etc/passwd'>]><scene version='3.0.0'>&a;</scene>",
    "defaults": "<scene version='3.0.0'>" + bomb(9, "<default name='{}' value='{}'/>", "${}") + "</scene>",
    "depth": "<scene version='3.0.0'>" + "<shape type='sphere'>" * 100_000,
    "includes": "<scene version='3.0.0'>" + "<include filename='a.xml'/>" * 10 + "</scene>",
    "itself": "<scene version='3.0.0'><bsdf type='twosided' id='a'><ref id='a'/></bsdf><shape type='sphere'>"
    "<ref id='a'/></shape></scene>",
    "wrapper": "<scene version='3.0.0'><integrator type='moment' id='a'><ref id='a'/></integrator></scene>",
    "chain": "<scene version='3.0.0'>"
    + "".join(f"<bsdf type='twosided' id='a{i}'><ref id='a{i + 1}'/></bsdf>" for i in range(3000))
    + "<bsdf type='diffuse' id='a3000'/></scene>",
    "encoding": "<?xml version='1.0' encoding='nonsense'?><scene version='3.0.0'/>",
    "digits": f"<scene version='3.0.0'><sensor type='perspective'><film type='hdrfilm'><integer name='width' "
    f"value='{'9' * 5000}'/></film></sensor></scene>",
    "infinite": "<scene version='3.0.0'><shape type='sphere'><float name='radius' value='1e999'/></shape></scene>",
}


@pytest.mark.parametrize("kind", HUGE)
def test_bombs_and_loops_end_in_one_message(folder: Path, kind: str) -> None:
    (folder / "a.xml").write_text(HUGE[kind])
    with pytest.raises(SceneError) as error:
        load(folder / "a.xml")
    (said,) = error.value.problems
    assert len(said) < 500 and "\n" not in said, said


def test_many_uses_of_one_material_are_read_once(folder: Path) -> None:
    """2^40 paths through a graph of 40 blends."""
    blends = "".join(
        f"<bsdf type='blendbsdf' id='b{i}'><float name='weight' value='0.5'/>"
        f"<ref id='b{i + 1}'/><ref id='b{i + 1}'/></bsdf>"
        for i in range(40)
    )
    text = f"{blends}<bsdf type='diffuse' id='b40'/><shape type='sphere'><ref id='b0'/></shape>"
    assert scene(folder, text).spheres[0].material == Diffuse(color=(0.5,) * 3)
