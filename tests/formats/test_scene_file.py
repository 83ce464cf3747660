from __future__ import annotations

import math
import os
import subprocess
import sys
from datetime import datetime, timedelta, timezone
from pathlib import Path

import imageio.v3 as imageio
import numpy as np
import pytest

from clrt.errors import SceneError
from clrt.formats.load_scene import load
from clrt.rendering.checkpoint.identity import scene_hash
from clrt.scene.lights import DirectionalLight, PointLight
from clrt.scene.materials.material_types import Diffuse, MetallicRoughness, Mirror
from clrt.scene.model import Camera, RenderSettings, Sphere
from clrt.scene.sky.sky import Sky, SkyEnvironment

from ..scene.shapes import icosphere
from .glb import Gltf

GOOD = """
[camera]
position = [0, 1, 5]
look_at = [0, 1, 0]
fov_degrees = 30
[render]
size = [64, 32]
spp = 16
max_depth = 3
integrator = "direct"
filter = "box"
[environment]
color = [0.05, 0.06, 0.08]
strength = 2
rotation_degrees = 90
[materials.white]
type = "diffuse"
color = [0.73, 0.73, 0.73]
[materials."my ring"]
type = "metallic_roughness"
preset = "gold"
roughness = 0.2
smith = "schlick"
[materials.lamp]
type = "diffuse"
emission = [17, 12, 4]
[materials.glass]
type = "mirror"
[[mesh]]
file = "models/triangle.obj"
[[mesh]]
name = "floor"
vertices = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
faces = [[0, 1, 2]]
material = "lamp"
normals = "smooth"
scale = [1, 2, 3]
rotate_degrees = [90, 0, 90]
translate = [10, 20, 30]
[[mesh]]
vertices = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
faces = [[0, 1, 2]]
matrix = [[0, 2, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]
[[sphere]]
center = [0, 1, 0]
radius = 2
material = "my ring"
[[light]]
type = "point"
position = [1.5, 4, 3]
intensity = [60, 58, 50]
[[light]]
type = "directional"
direction = [0, -1, 0]
irradiance = [1, 2, 3]
"""


def write(folder: Path, text: str) -> Path:
    (folder / "box.toml").write_text(text)
    return folder / "box.toml"


def test_a_whole_scene(folder: Path) -> None:
    scene = load(write(folder, GOOD))
    assert scene.name == "box"
    assert scene.camera == Camera(position=(0, 1, 5), look_at=(0, 1, 0), fov_degrees=30)
    assert scene.render == RenderSettings(size=(64, 32), spp=16, max_depth=3, integrator="direct")
    environment = scene.environment
    assert (environment.color, environment.strength, environment.rotation_degrees) == ((0.05, 0.06, 0.08), 2, 90)
    ring = MetallicRoughness(preset="gold", roughness=0.2, smith="schlick")
    assert scene.spheres == [Sphere(center=(0, 1, 0), radius=2, material=ring)]
    assert scene.lights == [
        PointLight(position=(1.5, 4, 3), intensity=(60, 58, 50)),
        DirectionalLight(direction=(0, -1, 0), irradiance=(1, 2, 3)),
    ]
    green, floor, mirrored = scene.meshes
    assert (green.material, floor.material, mirrored.material) == (
        Diffuse(color=(0, 0.5, 0)),
        Diffuse(emission=(17, 12, 4)),
        Diffuse(),
    )
    assert (floor.name, green.normals, mirrored.normals) == ("floor", None, None)


def test_transforms(folder: Path) -> None:
    """Computed by hand: scaled by (1, 2, 3), y → z under 90° about x, then x → y under 90° about z, then translated.
    The matrix mirrors, so faces are reversed."""
    _, floor, mirrored = load(write(folder, GOOD)).meshes
    np.testing.assert_allclose(floor.vertices, [[10, 21, 30], [10, 20, 32], [13, 20, 30]], atol=1e-5)
    assert floor.normals is not None
    normal = np.cross(floor.vertices[1] - floor.vertices[0], floor.vertices[2] - floor.vertices[0])
    np.testing.assert_allclose(floor.normals, [normal / np.linalg.norm(normal)] * 3, atol=1e-6)
    np.testing.assert_array_equal(mirrored.vertices, [[1, 3, 3], [3, 2, 3], [1, 2, 4]])
    np.testing.assert_array_equal(mirrored.faces, [[2, 1, 0]])


def test_one_number_scales_every_axis(folder: Path) -> None:
    (mesh,) = load(write(folder, '[[mesh]]\nfile = "models/triangle.obj"\nscale = 3\n')).meshes
    np.testing.assert_array_equal(mesh.vertices, [[0, 0, 0], [3, 0, 0], [0, 3, 0]])


def test_instances_start_from_where_their_mesh_stands(folder: Path) -> None:
    """Each shows every mesh of its table, which itself may be hidden; an inline table works, too."""
    (folder / "models" / "two.obj").write_text(
        "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nusemtl green\nf 1 3 2\n"
    )
    scene = load(
        write(
            folder,
            """
instance = [{ mesh = "pair", translate = [0, 5, 0], scale = -2 }, { mesh = "one", material = "red", name = "other" }]
[materials.red]
type = "diffuse"
color = [1, 0, 0]
[[mesh]]
name = "pair"
file = "models/two.obj"
translate = [3, 0, 0]
visible = false
[[mesh]]
name = "one"
file = "models/triangle.obj"
""",
        )
    )
    (one,) = scene.meshes
    *pair, other = scene.instances
    assert other.mesh is one and other.material == Diffuse(color=(1, 0, 0)) and other.name == "other"
    np.testing.assert_array_equal(other.to_world, np.eye(3, 4))
    assert len(pair) == 2 and all(each.material is None and each.mesh.vertices.min() == 0 for each in pair)
    assert {each.mesh.material for each in pair} == {Diffuse(), Diffuse(color=(0, 0.5, 0))}
    assert {each.mesh.vertices[:, 0].min() for each in pair} == {3}
    np.testing.assert_array_equal(pair[0].to_world, [[-2, 0, 0, 0], [0, -2, 0, 5], [0, 0, -2, 0]])


def test_environment_picture_keeps_its_orientation(folder: Path) -> None:
    """Row 0 of the file is row 0 of the image, and values are unchanged."""
    import OpenImageIO as oiio

    pixels = np.arange(2 * 4 * 3, dtype=np.float32).reshape(2, 4, 3) * 100
    picture = oiio.ImageBuf(oiio.ImageSpec(4, 2, 3, oiio.FLOAT))
    assert picture.set_pixels(oiio.ROI(), pixels) and picture.write(str(folder / "sky.exr"))
    scene = load(write(folder, '[environment]\nimage = "sky.exr"\nstrength = 0.5\n'))
    assert scene.environment.image is not None
    np.testing.assert_array_equal(scene.environment.image, pixels)
    assert scene.environment.strength == 0.5


@pytest.mark.parametrize("name, material", [("ball.glb", MetallicRoughness), ("ball.off", Diffuse)])
def test_bare_model(name: str, material: type, tmp_path: Path) -> None:
    """The whole ball is visible: its radius is below sin(fov/2) of the distance to its centre."""
    vertices, faces = icosphere(1)
    if name == "ball.off":
        rows = [f"{x} {y} {z}" for x, y, z in vertices.tolist()] + [f"3 {a} {b} {c}" for a, b, c in faces.tolist()]
        (tmp_path / name).write_text("\n".join(["OFF", f"{len(vertices)} {len(faces)} 0", *rows]))
    else:
        gltf = Gltf()
        gltf.mesh(attributes={"POSITION": gltf.accessor(vertices)}, indices=gltf.accessor(faces.ravel(), "<u2"))
        gltf.write(tmp_path / name)
    scene = load(str(tmp_path / name))
    assert scene.name == "ball" and isinstance(scene.meshes[0].material, material)
    distance = np.linalg.norm(np.subtract(scene.camera.position, scene.camera.look_at))
    assert math.sin(math.radians(scene.camera.fov_degrees / 2)) > 1 / distance
    assert scene.environment.image is not None and len(scene.lights) == 1


def test_a_model_shows_its_own_camera(tmp_path: Path) -> None:
    gltf = Gltf()
    vertices, faces = icosphere(0)
    gltf.mesh(attributes={"POSITION": gltf.accessor(vertices)}, indices=gltf.accessor(faces.ravel(), "<u2"))
    gltf.document["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1.0}}]
    gltf.node(camera=0, translation=[0, 0, 4])
    camera = load(gltf.write(tmp_path / "ball.glb")).camera
    assert camera.position == (0.0, 0.0, 4.0) and camera.fov_degrees == pytest.approx(math.degrees(1))


@pytest.mark.parametrize(
    "name, sentence",
    [
        ("a.toml", "no such scene file"),
        (".", "is a folder, not a scene"),
        ("a.obj", "no such model file"),
        ("loop.toml", "no such scene file"),
        ("pipe.toml", "is a device, a pipe or a socket, not a scene"),
        ("a.blend", "a scene must be one of .toml, .xml, .pbrt"),
    ],
)
def test_files_that_are_no_scene(name: str, sentence: str, tmp_path: Path) -> None:
    (tmp_path / "a.blend").touch()
    (tmp_path / "loop.toml").symlink_to("loop.toml")
    os.mkfifo(tmp_path / "pipe.toml")
    with pytest.raises(SceneError, match=sentence):
        load(tmp_path / name)


def test_scenes_load_without_opencl(folder: Path) -> None:
    """In a fresh interpreter where importing pyopencl fails."""
    code = (
        "import sys; sys.modules['pyopencl'] = None; from clrt.formats.load_scene import load; "
        "print(len(load(sys.argv[1]).meshes))"
    )
    path = write(folder, GOOD)
    done = subprocess.run([sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True)
    assert done.stdout == "3\n"


def test_materials_of_every_type_load(folder: Path) -> None:
    scene = load(write(folder, GOOD + '[[sphere]]\nmaterial = "glass"\n'))
    assert scene.spheres[1].material == Mirror()


def test_a_sky_is_an_environment_map_and_the_first_light(folder: Path) -> None:
    (folder / "a.toml").write_text(
        "[sky]\ntime = 2026-06-21T17:00:00+02:00\nlatitude = 52.5\nlongitude = 13.4\nalbedo = [0.1, 0.2, 0.3]\n"
        '[[light]]\ntype = "point"\nposition = [1.5, 4, 3]\nintensity = [60, 58, 50]\n'
    )
    scene = load(folder / "a.toml")
    zone = timezone(timedelta(hours=2))
    sky = Sky(time=datetime(2026, 6, 21, 17, tzinfo=zone), latitude=52.5, longitude=13.4, albedo=(0.1, 0.2, 0.3))
    assert scene.lights[:1] == sky.lights() and isinstance(scene.lights[1], PointLight) and len(scene.lights) == 2
    assert isinstance(scene.environment, SkyEnvironment) and scene.environment.sky == sky
    np.testing.assert_array_equal(scene.environment.image, sky.environment().image)


def test_whole_numbers_may_be_of_any_length(folder: Path) -> None:
    """Integers are accepted wherever floats are, with the same value."""
    imageio.imwrite(folder / "a.png", np.zeros((2, 2, 3), np.uint8))
    text = """
instance = [{{ mesh = "a", scale = 1e-20, repeat = [{{ count = 2, scale = {0} }}] }}]
[camera]
position = [{0}, 0, {0}]
focus_distance = {0}
[materials.a]
type = "diffuse"
color = {{ image = "a.png", scale = {0}, rotation_degrees = {0} }}
emission = [{0}, 1, 1]
[[mesh]]
name = "a"
vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
faces = [[0, 1, 2]]
uv = [[0, 0], [1, 0], [0, 1]]
material = "a"
scale = {0}
translate = [{0}, 0, -{0}]
rotate_degrees = [{0}, 0, 0]
[[light]]
type = "spot"
position = [0, 0, 0]
direction = [{0}, 0, 0]
intensity = [{0}, 0, 0]
"""
    whole, decimal = (load(write(folder, text.format(number))) for number in (str(10**22), "1e22"))
    assert scene_hash(whole) == scene_hash(decimal)


def test_instances_repeat_by_steps_of_the_world(folder: Path) -> None:
    """Copy i is the first one transformed by i steps: here a ring, and rings above it, each twice as large."""
    scene = load(
        write(
            folder,
            """
instance = [{ mesh = "one", translate = [1, 0, 0], repeat = [
    { count = 4, rotate_degrees = [0, 90, 0] }, { count = 3, scale = 2, translate = [0, 1, 0] }] }]
[[mesh]]
name = "one"
vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
faces = [[0, 1, 2]]
visible = false
""",
        )
    )
    places = [each.to_world[:, 3] for each in scene.instances]
    expected = [
        (size * x, height, size * z)
        for size, height in ((1, 0), (2, 1), (4, 3))
        for x, z in ((1, 0), (0, -1), (-1, 0), (0, 1))
    ]
    np.testing.assert_allclose(places, expected, atol=1e-12)
    np.testing.assert_allclose(scene.instances[-1].to_world[:, :3], [[0, 0, -4], [0, 4, 0], [4, 0, 0]], atol=1e-12)
