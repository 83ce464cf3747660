"""Scenes of pbrt: what is read, against closed forms and the format's description, and what is said of mistakes."""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

import clrt
from clrt.errors import SceneError
from clrt.formats.load_scene import load
from clrt.formats.pbrt.equal_area import direction_of, looked_up, square_of
from clrt.formats.pbrt.loop_subdivision import subdivided
from clrt.formats.pbrt.reader import read_pbrt
from clrt.formats.pbrt.tokens import Tokens
from clrt.formats.scene_parts.notes import UnsupportedError
from clrt.output.images import write_image
from clrt.scene.lights import DirectionalLight, PointLight, SpotLight
from clrt.scene.materials.material_types import Conductor, Dielectric, Diffuse, MetallicRoughness, Mirror
from clrt.scene.materials.presets import F0_PRESETS
from clrt.scene.materials.textures import Texture
from clrt.scene.model import Scene

TRIANGLE = 'Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 2]'
#: A camera that mirrors, so that coordinates are those of the file.
UPRIGHT = 'Scale -1 1 1 Camera "perspective"\n'


def scene(folder: Path, world: str, before: str = UPRIGHT, approximate: bool = False) -> Scene:
    """The scene in a file of these directives."""
    path = folder / "scene.pbrt"
    path.write_text(f"{before}\nWorldBegin\n{world}\n")
    return load(path, approximate=approximate)


def problem(folder: Path, world: str, before: str = UPRIGHT) -> str:
    """What is said of such a file."""
    with pytest.raises(SceneError) as error:
        scene(folder, world, before)
    return str(error.value)


def material(folder: Path, directive: str) -> Any:
    return scene(folder, f"{directive}\n{TRIANGLE}").meshes[0].material


@settings(max_examples=100, deadline=None)
@given(st.lists(st.floats(-1e6, 1e6, width=32), min_size=1, max_size=1500), st.booleans())
def test_arrays_of_any_length_keep_their_numbers(values: list[float], commented: bool) -> None:
    between = " # a comment ] \n" if commented else "\n"
    text = f'"float x" [{between.join(map(repr, values))}] 7'
    tokens = Tokens(text.encode(), "")
    assert tokens.take("a name") == ("float x", True, 0)
    np.testing.assert_array_equal(tokens.values("x"), values)
    np.testing.assert_array_equal(tokens.values("y"), [7])


def test_words_strings_and_lines() -> None:
    tokens = Tokens(b'# first\nShape "a \\"b\\" \\n\\\\" [ "one" "two" ] true [false true]\nEnd', "part.pbrt ")
    word = tokens.take("a word")
    assert word.text == "Shape" and tokens.place(word) == "part.pbrt line 2"
    assert tokens.take("a string").text == 'a "b" \n\\'
    assert tokens.values("x") == ["one", "two"] and tokens.values("y") == [True] and tokens.values("z") == [False, True]
    assert tokens.place(tokens.take("a word")) == "part.pbrt line 3" and tokens.peek() is None


def test_the_last_transformation_is_applied_first(folder: Path) -> None:
    """A point through each transformation by itself, by scipy's rotations."""
    rng = np.random.default_rng(5)
    for _ in range(10):
        axis, offset, factors = rng.normal(size=(3, 3))
        angle = rng.uniform(-360, 360)
        linear = np.eye(4)
        linear[:3] = rng.normal(size=(3, 4))
        texts = {
            "Rotate": f"Rotate {angle} {' '.join(map(str, axis))}",
            "Translate": f"Translate {' '.join(map(str, offset))}",
            "Scale": f"Scale {' '.join(map(str, factors))}",
            "ConcatTransform": f"ConcatTransform [{' '.join(map(str, linear.T.ravel()))}]",
        }
        turn = Rotation.from_rotvec(np.radians(angle) * axis / np.linalg.norm(axis))
        does = {
            "Rotate": turn.apply,
            "Translate": lambda p, by=offset: p + by,
            "Scale": lambda p, by=factors: p * by,
            "ConcatTransform": lambda p, by=linear: by[:3] @ [*p, 1],
        }
        order = [str(name) for name in rng.permutation([*texts])]
        points = rng.normal(size=(3, 3))
        expected = points
        for name in reversed(order):
            expected = np.array([does[name](point) for point in expected])
        shape = f'Shape "trianglemesh" "point3 P" [{" ".join(map(str, points.ravel()))}] "integer indices" [0 1 2]'
        mesh = scene(folder, "\n".join(texts[name] for name in order) + f"\n{shape}").meshes[0]
        np.testing.assert_allclose(mesh.vertices, expected, rtol=1e-5, atol=1e-5)


def seen_at(camera: Any, point: Any) -> tuple[float, float]:
    """Where a clrt camera shows a point: to the right and up from the middle, in tangents."""
    position, forward = np.array(camera.position), np.subtract(camera.look_at, camera.position)
    right = np.cross(forward, camera.up)
    upward = np.cross(right, forward)
    x, y, z = ((np.array(point) - position) @ axis / np.linalg.norm(axis) for axis in (right, upward, forward))
    return x / z, y / z


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10**6), st.booleans())
def test_a_point_is_seen_where_the_left_handed_camera_sees_it(tmp_path_factory: Any, seed: int, mirrored: bool) -> None:
    """x, y and z in the camera's coordinates, to the right, up and forward, are CTM · point."""
    rng = np.random.default_rng(seed)
    eye, target, up, point = rng.normal(size=(4, 3))
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(up, forward)
    right /= np.linalg.norm(right)
    x, y, z = (point - eye) @ np.array([right, np.cross(forward, right), forward]).T
    before = ("Scale -1 1 1\n" if mirrored else "") + f"LookAt {' '.join(map(str, [*eye, *target, *up]))}\n"
    before += 'Camera "perspective"\n'
    world = f'Translate {" ".join(map(str, point))}\nShape "sphere" "float radius" 0.1'
    read = scene(tmp_path_factory.mktemp("seen"), world, before)
    expected = (-x if mirrored else x) / z, y / z
    np.testing.assert_allclose(seen_at(read.camera, read.spheres[0].center), expected, rtol=1e-6, atol=1e-6)


def test_an_image_is_not_mirrored(folder: Path) -> None:
    """A light at +x is on the right, at +y above, for a camera at the origin that looks along +z."""
    before = 'Film "rgb" "integer xresolution" 32 "integer yresolution" 16 Camera "perspective" "float fov" 60\n'
    light = 'AreaLightSource "diffuse"\nTranslate 1 0.3 4\nShape "sphere" "float radius" 0.4'
    image = clrt.render(scene(folder, light, before), spp=4).pixels[..., 0]
    rows, columns = np.nonzero(image > 0.5)
    assert columns.min() >= 16 and rows.max() < 8


def test_cameras(folder: Path) -> None:
    """fov is along the shorter side; a screen window and the film's shape change the height."""
    film = 'Film "rgb" "integer xresolution" {} "integer yresolution" {}\n'
    wide = scene(folder, "", film.format(300, 200) + 'Camera "perspective" "float fov" 60').camera
    assert wide.fov_degrees == pytest.approx(60)
    high = scene(folder, "", film.format(200, 300) + 'Camera "perspective" "float fov" 60').camera
    assert np.tan(np.radians(high.fov_degrees / 2)) == pytest.approx(1.5 * np.tan(np.radians(30)))
    text = 'Camera "perspective" "float fov" 90 "float screenwindow" [-1.5 1.5 -1 1]'
    assert scene(folder, "", film.format(300, 200) + text).camera.fov_degrees == pytest.approx(90)
    lens = 'Scale 2 2 2 Camera "perspective" "float lensradius" 0.5 "float focaldistance" 8'
    camera = scene(folder, "", film.format(200, 200) + lens).camera
    assert camera.aperture_radius == pytest.approx(0.25) and camera.focus_distance == pytest.approx(4)
    flat = scene(folder, "", film.format(300, 200) + 'Camera "orthographic" "float screenwindow" [-3 3 -2 2]').camera
    assert flat.projection == "orthographic" and flat.view_height == pytest.approx(4)
    settings_ = scene(folder, "", 'Sampler "halton" "integer pixelsamples" 32 Integrator "path" "integer maxdepth" 1')
    assert settings_.render.spp == 32 and settings_.render.max_depth == 2


def test_a_spherical_camera_sees_longitude_from_left_to_right(folder: Path) -> None:
    """The ray of column u and row v: (sin πv cos 2πu, cos πv, sin πv sin 2πu), in the camera's coordinates."""
    before = 'Film "rgb" "integer xresolution" 64 "integer yresolution" 32\n'
    before += 'Camera "spherical" "string mapping" "equirectangular"\n'
    for u, v in ((0.1, 0.4), (0.3, 0.6), (0.55, 0.5), (0.9, 0.3)):
        direction = np.array([np.sin(np.pi * v) * np.cos(2 * np.pi * u), np.cos(np.pi * v), 0])
        direction[2] = np.sin(np.pi * v) * np.sin(2 * np.pi * u)
        place = " ".join(map(str, 4 * direction))
        world = f'AreaLightSource "diffuse"\nTranslate {place}\nShape "sphere" "float radius" 0.4'
        image = clrt.render(scene(folder, world, before), spp=4).pixels[..., 0]
        row, column = np.argwhere(image > 0.5).mean(0)
        assert column == pytest.approx(64 * u - 0.5, abs=0.7) and row == pytest.approx(32 * v - 0.5, abs=0.7)


PLANE = """Material "diffuse" "rgb reflectance" [{0} {0} {0}]
Shape "bilinearmesh" "point3 P" [-50 0 -50  50 0 -50  -50 0 50  50 0 50]
"""
DOWN = """Film "rgb" "integer xresolution" 1 "integer yresolution" 1 {}
LookAt 0 1 0  0 0 0  0 0 1
Camera "orthographic" "float screenwindow" [-.001 .001 -.001 .001]
"""


def radiance(folder: Path, light: str, film: str = "", spp: int = 256) -> Any:
    """What is seen of a diffuse plane of reflectance .5 at the origin, lit by a light."""
    return clrt.render(scene(folder, f"{light}\n{PLANE.format(0.5)}", DOWN.format(film)), spp=spp).pixels[0, 0]


@pytest.mark.parametrize(
    ("light", "irradiance"),
    [
        ('LightSource "point" "rgb I" [8 4 2] "point3 from" [0 2 0]', (2, 1, 0.5)),
        ('LightSource "point" "float power" 100 "point3 from" [0 2 0]', (100 / (16 * np.pi),) * 3),
        ('LightSource "distant" "rgb L" [3 3 3] "point3 from" [0 1 0] "point3 to" [0 0 0]', (3, 3, 3)),
        ('LightSource "distant" "rgb L" [2 1 1] "float illuminance" 5 "point3 from" [1 1 0] "point3 to" [0 0 0]', None),
        ('LightSource "infinite" "rgb L" [2 3 4] "float scale" 0.5', (np.pi, 1.5 * np.pi, 2 * np.pi)),
        ('LightSource "infinite" "float illuminance" 7', (7, 7, 7)),
        (
            'LightSource "spot" "rgb I" [8 8 8] "point3 from" [0 2 0] "point3 to" [0 0 0] "float conedeltaangle" 0.001',
            (2, 2, 2),
        ),
    ],
)
def test_lights_illuminate_by_closed_forms(folder: Path, light: str, irradiance: Any) -> None:
    """Diffuse reflection is ρE/π; E = I/d² and the like."""
    expected = np.array((2, 1, 1)) * 5 / np.sqrt(2) if irradiance is None else np.array(irradiance)
    np.testing.assert_allclose(radiance(folder, light), 0.5 / np.pi * expected, rtol=2e-3)


def test_a_spherical_light_of_a_power_illuminates_like_a_point(folder: Path) -> None:
    """Φ/(4πd²) on a plane that faces it, whatever its radius, also if it is scaled."""
    black = 'Material "diffuse" "rgb reflectance" [0 0 0]'
    for size in (0.5, 2.0):
        light = f"""AttributeBegin Translate 0 4 0 Scale {size} {size} {size} {black}
        AreaLightSource "diffuse" "float power" 500 Shape "sphere" "float radius" .5 AttributeEnd"""
        np.testing.assert_allclose(radiance(folder, light), 0.5 / np.pi * 500 / (4 * np.pi * 16), rtol=1e-2)


def test_the_film_scales_light(folder: Path) -> None:
    """By ISO/100 and the shutter's seconds."""
    light = 'LightSource "infinite" "rgb L" [1 1 1]'
    np.testing.assert_allclose(radiance(folder, light, '"float iso" 250'), 1.25, rtol=2e-3)
    before = 'Film "rgb" "float iso" 400 Camera "perspective" "float shutterclose" 0.5'
    assert scene(folder, light, before).environment.color == pytest.approx((2, 2, 2))


def test_a_closed_furnace(folder: Path) -> None:
    """In an emissive sphere that reflects half of it, radiance doubles."""
    world = """Material "diffuse" "rgb reflectance" [.5 .5 .5] AreaLightSource "diffuse" "rgb L" [.5 .5 .5]
    ReverseOrientation Shape "sphere" "float radius" 3"""
    before = 'Integrator "path" "integer maxdepth" 40 Film "rgb" "integer xresolution" 8 "integer yresolution" 8\n'
    image = clrt.render(scene(folder, world, before), spp=64).pixels
    np.testing.assert_allclose(image.mean((0, 1)), 1, rtol=1e-2)


def chromaticity(folder: Path, parameter: str) -> tuple[float, float]:
    """x and y of an emission, whose luminance must be 1."""
    color = scene(folder, f'LightSource "infinite" {parameter}').environment.color
    matrix = np.array([(0.412391, 0.357584, 0.180481), (0.212639, 0.715169, 0.072192), (0.019331, 0.119195, 0.950532)])
    xyz = matrix @ color
    assert xyz[1] == pytest.approx(1, abs=2e-3)
    return xyz[0] / xyz.sum(), xyz[1] / xyz.sum()


@pytest.mark.parametrize(
    ("parameter", "x", "y"),
    [
        ('"blackbody L" 2856', 0.44757, 0.40745),
        ('"blackbody L" 6504', 0.31352, 0.32363),
        ('"blackbody L" 10000', 0.28063, 0.28828),
        ('"spectrum L" "stdillum-A"', 0.44757, 0.40745),
        ('"spectrum L" "stdillum-D65"', 0.3127, 0.3290),
        ('"spectrum L" [200 3 900 3]', 1 / 3, 1 / 3),
        ('"rgb L" [1 1 1]', 0.3127, 0.3290),
    ],
)
def test_emission_has_the_spectrums_chromaticity(folder: Path, parameter: str, x: float, y: float) -> None:
    """Of black bodies as CIE 15 and Planck's law give it, and luminance 1 whatever the values, as in pbrt-v4."""
    assert chromaticity(folder, parameter) == pytest.approx((x, y), abs=1e-3)


def test_emission_of_v3_has_the_values_that_are_written(folder: Path) -> None:
    end = "\nWorldEnd"
    white = scene(folder, f'LightSource "infinite" "spectrum L" [400 3 700 3]{end}').environment.color
    assert 0.212639 * white[0] + 0.715169 * white[1] + 0.072192 * white[2] == pytest.approx(3, rel=1e-3)
    scaled = scene(folder, f'LightSource "infinite" "blackbody L" [6500 4] "rgb scale" [.5 1 2]{end}').environment.color
    plain = scene(folder, f'LightSource "infinite" "blackbody L" [6500 1]{end}').environment.color
    np.testing.assert_allclose(scaled, np.multiply(plain, (2, 4, 8)), rtol=1e-9)


@settings(max_examples=300, deadline=None)
@given(st.floats(0, 1), st.floats(0, 1))
def test_the_equal_area_map_is_its_inverses_inverse(u: float, v: float) -> None:
    square = np.array([[u, v]])
    direction = direction_of(square)
    assert np.linalg.norm(direction) == pytest.approx(1)
    np.testing.assert_allclose(direction_of(square_of(direction)), direction, atol=1e-7)


def test_the_equal_area_map_is_a_concentric_map_of_lamberts_disk() -> None:
    """Each hemisphere is Lambert's azimuthal equal-area disk, of radius √(1 − |z|), by Shirley and Chiu's concentric
    map on a square turned by 45°; that of −z is folded outward over its edges."""
    rng = np.random.default_rng(2)
    directions = rng.normal(size=(500, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for (x, y, z), (u, v) in zip(directions, 2 * square_of(directions) - 1):
        radius, angle = np.sqrt(1 - abs(z)), np.arctan2(y, x)
        turned = (angle - np.pi / 4 + np.pi) % (2 * np.pi) - np.pi  # the edge |u| + |v| = 1 of this quadrant is upright
        quarter = np.round(turned / (np.pi / 2))
        along = 4 / np.pi * (turned - quarter * np.pi / 2) * radius  # Shirley and Chiu: a = r, b = 4rφ/π
        middle = quarter * np.pi / 2 + np.pi / 4
        out = radius if z >= 0 else 2 - radius
        across = np.array([-np.sin(middle), np.cos(middle)])
        expected = (out * np.array([np.cos(middle), np.sin(middle)]) + along * across) / np.sqrt(2)
        np.testing.assert_allclose((u, v), expected, atol=1e-9)


def test_a_square_map_is_interpolated_over_its_edges() -> None:
    """A smooth function of the direction to a few pixels' error, everywhere."""
    size = 128
    rows, columns = np.divmod(np.arange(size * size), size)
    at = direction_of(np.column_stack([(columns + 0.5) / size, (rows + 0.5) / size]))
    image = np.repeat((at @ (0.3, -0.5, 0.8))[:, None], 3, axis=1).reshape(size, size, 3).astype(np.float32)
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(3000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    np.testing.assert_allclose(looked_up(image, directions)[:, 0], directions @ (0.3, -0.5, 0.8), atol=0.02)


@pytest.mark.parametrize("square", [True, False])
@pytest.mark.parametrize("mirrored", [True, False])
def test_an_environment_map_lies_where_its_transformation_says(folder: Path, square: bool, mirrored: bool) -> None:
    """A bright spot, in light space at a known direction, is in clrt's map where the camera's image shows it."""
    towards = np.array([0.6, 0.48, 0.64])
    if square:
        shape, (u, v) = (64, 64), square_of(towards[None])[0]
    else:
        shape, u, v = (64, 128), np.arctan2(0.48, 0.6) / (2 * np.pi), np.arccos(0.64) / np.pi
    image = np.full((*shape, 3), 0.1, np.float32)
    image[int(v * shape[0]), int(u * shape[1])] = 1000
    write_image(folder / "sky.exr", image)
    before = UPRIGHT if mirrored else 'Camera "perspective"\n'
    world = 'Rotate 40 1 2 3\nLightSource "infinite" "string filename" "sky.exr"'
    sky = scene(folder, world, before).environment
    assert sky.image is not None and sky.rotation_degrees == 0
    height, width = sky.image.shape[:2]
    bright = sky.image[..., 0] > 100
    rows, columns = np.nonzero(bright)
    theta, phi = np.pi * (rows.mean() + 0.5) / height, 2 * np.pi * (columns.mean() + 0.5) / width
    found = np.array([np.sin(theta) * np.sin(phi), np.cos(theta), -np.sin(theta) * np.cos(phi)])
    axis = np.array([1, 2, 3]) / np.sqrt(14)
    expected = Rotation.from_rotvec(np.radians(40) * axis).apply(towards) * (1 if mirrored else -1, 1, 1)
    assert found @ expected > np.cos(np.radians(2))


def test_v3s_map_about_y_is_used_as_it_is(folder: Path) -> None:
    """Its zenith is +z in light space; turned upright it needs no resampling."""
    image = np.random.default_rng(0).random((8, 16, 3), np.float32)
    write_image(folder / "sky.exr", image)
    world = 'Rotate -90 1 0 0\nLightSource "infinite" "string mapname" "sky.exr" "rgb L" [2 2 2]'
    sky = scene(folder, world, 'Camera "perspective"').environment
    assert sky.image is not None and sky.strength == 2
    # Its first column is towards +x, here −x since the world is mirrored: −z turned by 90° about y.
    assert sky.rotation_degrees == pytest.approx(90)
    np.testing.assert_allclose(sky.image, image)


def test_infinite_lights_add_up(folder: Path) -> None:
    two = 'LightSource "infinite" "rgb L" [1 2 3]\nLightSource "infinite" "rgb L" [1 1 1]'
    assert scene(folder, two).environment.color == (2, 3, 4)


AREAS = [
    ('"sphere" "float radius" 2 "float zmin" -1 "float zmax" 1', 2 * np.pi * 2 * 2),
    ('"sphere" "float radius" 2 "float phimax" 90', np.pi * 4),
    ('"disk" "float radius" 2 "float innerradius" 1 "float height" 3', np.pi * 3),
    ('"cylinder" "float radius" 2 "float zmin" -2 "float zmax" 1 "float phimax" 180', 2 * np.pi * 3),
    ('"bilinearmesh" "point3 P" [0 0 0 2 0 0 0 3 0 2 3 0]', 6),
    ('"trianglemesh" "point3 P" [0 0 0 2 0 0 0 3 0] "integer indices" [0 1 2]', 3),
]


@pytest.mark.parametrize(("shape", "area"), AREAS, ids=lambda value: str(value)[:30])
def test_shapes(folder: Path, shape: str, area: float) -> None:
    """Area, and faces that are wound as their normals say."""
    mesh = scene(folder, f"Shape {shape}").meshes[0]
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.linalg.norm(cross, axis=1).sum() / 2 == pytest.approx(area, rel=3e-4)
    if mesh.normals is not None:
        solid = np.linalg.norm(cross, axis=1) > 1e-9
        assert np.all(np.einsum("ij,ij->i", cross, mesh.normals[mesh.faces].sum(1))[solid] > 0)


def front(folder: Path, world: str) -> Any:
    """The direction in which the first face of a scene's mesh emits."""
    mesh = scene(folder, world).meshes[0]
    a, b, c = mesh.vertices[mesh.faces[len(mesh.faces) // 2]].astype(np.float64)
    normal = np.cross(b - a, c - a)
    return normal / np.linalg.norm(normal)


def test_sides_that_emit(folder: Path) -> None:
    """cross(p1 − p0, p2 − p0), turned by ReverseOrientation and by normals, and for quadrics by mirroring."""
    np.testing.assert_allclose(front(folder, TRIANGLE), [0, 0, 1])
    np.testing.assert_allclose(front(folder, f"ReverseOrientation {TRIANGLE}"), [0, 0, -1])
    np.testing.assert_allclose(front(folder, f"Scale 1 -1 1 {TRIANGLE}"), [0, 0, 1])
    normals = f'{TRIANGLE} "normal N" [0 0 -1 0 0 -1 0 0 -1]'
    np.testing.assert_allclose(front(folder, normals), [0, 0, -1])
    np.testing.assert_allclose(front(folder, f"ReverseOrientation {normals}"), [0, 0, 1])
    np.testing.assert_allclose(front(folder, 'Shape "disk"'), [0, 0, 1], atol=1e-7)
    np.testing.assert_allclose(front(folder, 'Scale -1 1 1 Shape "disk"'), [0, 0, -1], atol=1e-7)
    np.testing.assert_allclose(front(folder, 'Scale -1 1 1 ReverseOrientation Shape "disk"'), [0, 0, 1], atol=1e-7)
    lit = scene(folder, 'AreaLightSource "diffuse" "bool twosided" true Shape "disk"').meshes[0].material
    assert lit.double_sided and lit.emission == (1, 1, 1)


def test_subdivision_converges_to_one_surface() -> None:
    """Vertices of each level are on the limit surface, so finer levels do not move them; planes stay planes."""
    rng = np.random.default_rng(3)
    ball = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], np.float64)
    faces = np.array([(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)])
    closed = ball + 0.2 * rng.normal(size=ball.shape)
    opened = faces[:5]
    for mesh in (faces, opened):
        coarse, _ = subdivided(closed, mesh, 1)
        fine, triangles = subdivided(closed, mesh, 3)
        np.testing.assert_allclose(fine[: len(coarse)], coarse, atol=1e-12)
        assert len(triangles) == len(mesh) * 64
    flat, _ = subdivided(closed * (1, 1, 0) + (0, 0, 2), opened, 2)
    np.testing.assert_allclose(flat[:, 2], 2)


def test_a_boundary_is_a_cubic_spline() -> None:
    """Of whose vertices the limit is (a + 4b + c)/6."""
    points = np.array([(0, 0, 0), (1, 0.5, 0), (2, -1, 0), (3, 0, 0), (1.5, 3, 0)], np.float64)
    faces = np.array([(0, 1, 4), (1, 2, 4), (2, 3, 4)])
    many, _ = subdivided(points, faces, 5)
    np.testing.assert_allclose(many[1], (points[0] + 4 * points[1] + points[2]) / 6, atol=1e-12)


def test_objects_and_instances(folder: Path) -> None:
    """A sphere and a mesh, of which only the instances are rendered, without emission."""
    read = scene(
        folder,
        f"""ObjectBegin "group" AreaLightSource "diffuse" {TRIANGLE} Translate 1 0 0 Shape "sphere" "float radius" .5
        ObjectEnd
        AttributeBegin Scale 2 2 2 Rotate 90 0 0 1 ObjectInstance "group" AttributeEnd ObjectInstance "group"
        AttributeBegin Scale 1 2 1 ObjectInstance "group" AttributeEnd""",
    )
    assert len(read.instances) == 3 and read.instances[0].mesh is read.instances[1].mesh
    assert not any(read.instances[0].mesh.material.radiance)
    np.testing.assert_allclose(read.spheres[0].center, [0, 2, 0], atol=1e-12)
    assert read.spheres[0].radius == pytest.approx(1) and read.spheres[1].radius == pytest.approx(0.5)
    (stretched,) = read.meshes
    np.testing.assert_allclose(np.ptp(stretched.vertices, axis=0), [1, 2, 1], rtol=1e-3)


def test_attributes_are_saved_and_restored(folder: Path) -> None:
    read = scene(
        folder,
        f"""Attribute "shape" "float radius" 3
        MakeNamedMaterial "red" "string type" "diffuse" "rgb reflectance" [1 0 0]
        AttributeBegin Translate 1 2 3 NamedMaterial "red" Shape "sphere" AttributeEnd
        TransformBegin Translate 7 7 7 NamedMaterial "red" TransformEnd Shape "sphere"
        CoordinateSystem "here" Translate 5 5 5 CoordSysTransform "here" Material "mirror" Shape "sphere" {TRIANGLE}""",
    )
    first, second, third = read.spheres
    assert first.radius == 3 and first.center == pytest.approx((1, 2, 3)) and first.material == Diffuse(color=(1, 0, 0))
    assert second.center == pytest.approx((0, 0, 0)) and second.material is first.material
    assert third.center == pytest.approx((0, 0, 0)) and isinstance(third.material, Mirror)


def test_materials(folder: Path) -> None:
    assert material(folder, "") == Diffuse(color=(0.5, 0.5, 0.5))
    glass = material(folder, 'Material "dielectric" "float eta" 1.33 "float roughness" 0.0625')
    assert isinstance(glass, Dielectric) and glass.ior == 1.33 and not glass.multiple_scattering
    assert glass.roughness == pytest.approx(0.5)  # alpha = √roughness = roughness² of clrt
    raw = material(folder, 'Material "dielectric" "float roughness" 0.25 "bool remaproughness" false')
    assert raw.roughness == pytest.approx(0.5)
    flint = material(folder, 'Material "dielectric" "spectrum eta" "glass-F11"')
    assert flint.ior == pytest.approx(1.78472, abs=1e-4) and flint.dispersion == pytest.approx(20 / 25.76, rel=5e-3)
    assert material(folder, 'Material "thindielectric"').thin
    metal = material(folder, 'Material "conductor" "spectrum eta" "metal-Cu-eta" "spectrum k" "metal-Cu-k"')
    eta, k = np.array(metal.eta), np.array(metal.k)
    copper = ((eta - 1) ** 2 + k**2) / ((eta + 1) ** 2 + k**2)
    np.testing.assert_allclose(copper, F0_PRESETS["copper"][0], atol=0.02)
    given_ = material(folder, 'Material "conductor" "rgb reflectance" [.9 .5 .1]')
    k = np.array(given_.k)
    np.testing.assert_allclose(k**2 / (4 + k**2), (0.9, 0.5, 0.1), rtol=1e-6)
    old = material(folder, 'Material "metal" "float roughness" 0.05')
    x = np.log(0.05)
    alpha = 1.62142 + 0.819955 * x + 0.1734 * x**2 + 0.0171201 * x**3 + 0.000640711 * x**4
    assert isinstance(old, Conductor) and old.roughness == pytest.approx(np.sqrt(alpha))


def test_a_white_coated_base_reflects_all_light(folder: Path) -> None:
    """A smooth coat loses nothing between its layers."""
    found = material(folder, 'Material "coateddiffuse" "rgb reflectance" [1 1 1]')
    assert isinstance(found, MetallicRoughness) and not isinstance(found.color, Texture)
    assert found.color[0] == pytest.approx(1, abs=0.01)


COAT = """Material "dielectric" "float roughness" {roughness}
Shape "bilinearmesh" "point3 P" [-9 .001 -9  -9 .001 9  9 .001 -9  9 .001 9]
Material "diffuse" "rgb reflectance" [{base} {base} {base}]
Shape "bilinearmesh" "point3 P" [-9 0 -9  -9 0 9  9 0 -9  9 0 9]"""
COATED = """Material "coateddiffuse" "float roughness" {roughness} "rgb reflectance" [{base} {base} {base}]
Shape "bilinearmesh" "point3 P" [-9 0 -9  -9 0 9  9 0 -9  9 0 9]"""


@pytest.mark.parametrize("roughness", [0.0, 0.01, 0.09])
def test_a_coated_base_looks_like_glass_above_a_diffuse_surface(folder: Path, roughness: float) -> None:
    """The light that the base adds, from 45 degrees under a white sky, with both surfaces as geometry."""
    before = """Film "rgb" "integer xresolution" 16 "integer yresolution" 16 Integrator "path" "integer maxdepth" 60
    LookAt 0 2 2  0 0 0  0 1 0  Camera "orthographic" "float screenwindow" [-1 1 -1 1]"""

    def mean(world: str, base: float) -> float:
        text = f'LightSource "infinite"\n{world.format(roughness=roughness, base=base)}'
        return float(clrt.render(scene(folder, text, before), spp=1024).pixels.mean())

    layers, one = ([mean(world, base) for base in (0.0, 0.7)] for world in (COAT, COATED))
    assert one[1] - one[0] == pytest.approx(layers[1] - layers[0], rel=0.03)
    assert one[1] == pytest.approx(layers[1], abs=0.015)  # Schlick's Fresnel term is off by .01


def test_mixtures_and_alpha(folder: Path) -> None:
    named = """MakeNamedMaterial "a" "string type" "diffuse" "rgb reflectance" [.2 .2 .2]
    MakeNamedMaterial "b" "string type" "diffuse" "rgb reflectance" [.6 .6 .6]
    MakeNamedMaterial "none" "string type" "interface"\n"""
    mix = 'Material "mix" "string materials" ["{}" "{}"] "float amount" {}'
    assert material(folder, named + mix.format("a", "b", 0.25)).color == pytest.approx((0.3, 0.3, 0.3))
    assert material(folder, named + mix.format("a", "b", 1)) == Diffuse(color=(0.6, 0.6, 0.6))
    assert material(folder, named + mix.format("a", "none", 0.25)) == Diffuse(color=(0.2, 0.2, 0.2), opacity=0.75)
    assert not scene(folder, f'Material "interface"\n{TRIANGLE}').meshes
    assert scene(folder, f'{TRIANGLE} "float alpha" .3').meshes[0].material.opacity == pytest.approx(0.3)


def test_translucent_surfaces(folder: Path) -> None:
    """Reflectance and transmittance, of which clrt's fraction and colors are the products."""
    found = material(
        folder,
        'Material "diffusetransmission" "rgb reflectance" [.3 .2 .1] "rgb transmittance" [.1 .4 .5] "float scale" .8',
    )
    share = found.diffuse_transmission
    np.testing.assert_allclose((1 - share) * np.array(found.color), np.array((0.3, 0.2, 0.1)) * 0.8)
    np.testing.assert_allclose(share * np.array(found.diffuse_transmission_color), np.array((0.1, 0.4, 0.5)) * 0.8)
    assert found.specular == 0


def test_images_are_upright_and_checks_begin_with_the_first_color(folder: Path) -> None:
    """(0, 0) is the lower left corner; the check at s, t has the first color if ⌊s⌋ + ⌊t⌋ is even."""
    write_image(folder / "wood.png", np.random.default_rng(0).random((4, 4, 3), np.float32))
    mapping = '"float uscale" 2 "float vscale" 3 "float udelta" .1 "float vdelta" .2'
    image = f'Texture "t" "spectrum" "imagemap" "string filename" "wood.png" {mapping}\n'
    picture = material(folder, f'{image}Material "diffuse" "texture reflectance" "t"').color
    u, v = 0.3, 0.15
    np.testing.assert_allclose(picture.to_picture @ (u, v, 1), (2 * u + 0.1, 1 - (3 * v + 0.2)))
    checks = f'Texture "t" "spectrum" "checkerboard" "rgb tex1" [.8 .8 .8] "rgb tex2" [.1 .1 .1] {mapping}\n'
    board = material(folder, f'{checks}Material "diffuse" "texture reflectance" "t"').color
    for u, v in np.random.default_rng(4).random((50, 2)) * 3:
        x, y = board.to_picture @ (u, v, 1) % 1
        texel = board.picture.texels[int(y * 2), int(x * 2), 0]
        is_first = (np.floor(2 * u + 0.1) + np.floor(3 * v + 0.2)) % 2 == 0
        assert texel == (board.picture.texels[..., 0].max() if is_first else board.picture.texels[..., 0].min())


def test_textures_of_textures(folder: Path) -> None:
    write_image(folder / "wood.png", np.full((2, 2, 3), 0.25, np.float32))
    textures = """Texture "wood" "spectrum" "imagemap" "string filename" "wood.png"
    Texture "half" "float" "constant" "float value" .5
    Texture "dark" "spectrum" "scale" "texture tex" "wood" "float scale" .5
    Texture "pale" "spectrum" "mix" "texture tex1" "wood" "rgb tex2" [1 1 1] "texture amount" "half"
    """
    dark = material(folder, f'{textures}Material "diffuse" "texture reflectance" "dark"').color
    assert np.broadcast_to(dark.factor, 3) == pytest.approx((0.5, 0.5, 0.5))
    pale = material(folder, f'{textures}Material "diffuse" "texture reflectance" "pale"').color
    level = pale.picture.texels[0, 0, 0] / 255
    assert ((level + 0.055) / 1.055) ** 2.4 == pytest.approx(0.5 * 0.25 + 0.5, abs=0.01)


def test_files_of_meshes_spectra_and_includes(folder: Path) -> None:
    (folder / "parts").mkdir()
    ply = b"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    ply += (
        b"element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n"
    )
    (folder / "parts" / "a.ply.gz").write_bytes(gzip.compress(ply))
    (folder / "parts" / "eta.spd").write_text("# nm\n300 1.5\n900 1.5\n")
    inner = 'Material "dielectric" "spectrum eta" "eta.spd"\nShape "plymesh" "string filename" "a.ply.gz"\n'
    (folder / "parts" / "inner.pbrt.gz").write_bytes(gzip.compress(inner.encode()))
    read = scene(folder, 'Include "parts/inner.pbrt.gz"')
    assert len(read.meshes[0].faces) == 2 and read.meshes[0].material.ior == pytest.approx(1.5)  # type: ignore[attr-defined]
    (folder / "whole.pbrt.gz").write_bytes(gzip.compress((folder / "scene.pbrt").read_bytes()))
    assert len(load(folder / "whole.pbrt.gz").meshes) == 1


def test_absorbing_glass(folder: Path) -> None:
    medium = """MakeNamedMedium "tea" "string type" "homogeneous" "rgb sigma_a" [1 2 4] "rgb sigma_s" [0 0 0]
    "float scale" .5 MediumInterface "tea" "" """
    glass = material(folder, medium + 'Material "dielectric"')
    np.testing.assert_allclose(-np.log(glass.attenuation_color) / glass.attenuation_distance, [0.5, 1, 2])


@pytest.mark.parametrize(
    ("world", "words"),
    [
        ('Shape "torus"', ['line 4: Shape "torus"', "use sphere", "--approximate"]),
        ('\nShape "sphere" "float radius" "wide"', ["line 5", "radius", "float"]),
        ('Shape "sphere" "float girth" 2', ["girth", "leave it out"]),
        ('Shape "sphere" "length radius" 2', ["length radius", "types are"]),
        ('Shape "sphere" "rgb radius" [1 1 1]', ["radius", "of type rgb", "float radius"]),
        ('Shape "trianglemesh" "point3 P" [0 0 0 1] "integer indices" [0 1 2]', ["P", "4 numbers", "multiple of 3"]),
        (TRIANGLE.replace("0 1 2]", "0 1 7]"), ["indices", "7", "0 to 2"]),
        ('Shape "trianglemesh" "integer indices" [0 1 2]', ["P", "missing"]),
        ('Material "velvet" Shape "sphere"', ['"velvet"', "diffuse", "--approximate"]),
        ('NamedMaterial "gone" Shape "sphere"', ['"gone"', "define it"]),
        ('Material "diffuse" "texture reflectance" "gone" Shape "sphere"', ['"gone"', "define it"]),
        ('ObjectInstance "gone"', ['"gone"', "define it"]),
        ('CoordSysTransform "gone"', ['"gone"', "define it"]),
        ('MediumInterface "gone" "" Shape "sphere"', ['"gone"', "define it"]),
        ('Shape "plymesh" "string filename" "gone.ply"', ["gone.ply", "no such model file"]),
        ('Include "gone.pbrt"', ["gone.pbrt", "no such scene file"]),
        ('Include "models/scene.pbrt"', ["models/scene.pbrt", "no such scene file"]),
        ('Include "scene.pbrt"', ["scene.pbrt", "included more than"]),
        ('LightSource "goniometric"', ['"goniometric"', "point", "--approximate"]),
        ('LightSource "infinite" "spectrum L" [500 1 400 2]', ["L", "increasing"]),
        ('LightSource "infinite" "spectrum L" "stdillum-X"', ["stdillum-X"]),
        ('LightSource "infinite" "blackbody L" 0', ["L", "kelvin"]),
        ("AttributeEnd", ["AttributeEnd", "did not begin"]),
        ("AttributeBegin", ["AttributeBegin", "no matching end"]),
        ("AttributeBegin " * 300, ["nested more than"]),
        ("Transform [1 2 3]", ["Transform", "3 numbers", "16"]),
        ("Translate 1 2", ["ends", "number 3 of 3 of Translate"]),
        ("Scale 1e300 1e300 1e300 Scale 1e300 1 1", ["Scale", "not finite"]),
        ("Sphere 1", ["Sphere", "not a directive", "Shape"]),
        ('Shape "sphere', ["string without an end"]),
        ("Translate 1 2 nan", ["nan", "not a number"]),
        ('Shape "loopsubdiv" "integer levels" 12 "point3 P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 2]', ["levels"]),
    ],
    ids=lambda value: str(value)[:40],
)
def test_mistakes_are_named(folder: Path, world: str, words: list[str]) -> None:
    """By file, line, object, value and remedy."""
    said = problem(folder, world)
    assert str(folder / "scene.pbrt") in said and all(word in said for word in words), said


def test_all_that_is_unsupported_is_listed(folder: Path) -> None:
    world = """Shape "curve" LightSource "projection" Material "hair" Shape "sphere" AreaLightSource "diffuse"
    "string filename" "a.exr" Material "diffuse" Shape "sphere" """
    (folder / "scene.pbrt").write_text(f'Integrator "ao"\nWorldBegin\n{world}')
    with pytest.raises(UnsupportedError) as error:
        read_pbrt(folder / "scene.pbrt")
    assert error.value.features == [
        "Integrator ao",
        "Shape curve",
        "Material hair",
        "emission by an image",
        "LightSource projection",
    ]
    read, differences = read_pbrt(folder / "scene.pbrt", approximate=True)
    assert len(read.spheres) == 2 and len(differences) == 5


def test_bombs_end_in_one_message(folder: Path) -> None:
    (folder / "zeros.pbrt.gz").write_bytes(gzip.compress(b" " * (1 << 27)))
    with pytest.raises(SceneError, match="unpack to more than"):
        load(folder / "zeros.pbrt.gz")
    (folder / "a.pbrt").write_text('Include "b.pbrt"\nInclude "b.pbrt"\n')
    (folder / "b.pbrt").write_text('Include "a.pbrt"\nInclude "a.pbrt"\n')
    with pytest.raises(SceneError, match="included more than"):
        load(folder / "a.pbrt")
    many = 'ObjectBegin "o"\n' + f"{TRIANGLE}\n" * 1200 + "ObjectEnd\n" + 'ObjectInstance "o"\n' * 1200
    assert "1048576 instances" in problem(folder, many)
    mix = 'MakeNamedMaterial "m" "string type" "mix" "string materials" ["m" "m"]\nNamedMaterial "m" Shape "sphere"'
    assert "mixes itself" in problem(folder, mix)
    loop = 'Texture "t" "float" "scale" "texture tex" "t"\nMaterial "diffuse" "texture reflectance" "t" Shape "sphere"'
    assert "contain each other" in problem(folder, loop)


def test_spot_lights_and_points_are_moved(folder: Path) -> None:
    world = """Translate 1 2 3 Scale 2 2 2 LightSource "point" "point3 from" [1 0 0]
    LightSource "spot" "point3 from" [0 0 0] "point3 to" [0 -1 0] "float coneangle" 40
    LightSource "distant" "point3 from" [0 1 0] "point3 to" [0 0 0]"""
    point, spot, sun = scene(folder, world).lights
    assert isinstance(point, PointLight) and point.position == pytest.approx((3, 2, 3))
    assert isinstance(spot, SpotLight) and (spot.inner_degrees, spot.outer_degrees) == (35, 40)
    assert spot.direction == pytest.approx((0, -2, 0))
    assert isinstance(sun, DirectionalLight) and sun.direction == pytest.approx((0, -2, 0))
