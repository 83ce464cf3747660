"""Models far from the origin, as geographic coordinates place them, have the shape that they have near it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.typing import NDArray

from clrt.cli.convert import command as convert
from clrt.formats.far_origin import FAR, far_center
from clrt.formats.load_scene import load
from clrt.scene.lights import PointLight
from clrt.scene.model import Scene, Vector

from ..scene.shapes import icosphere
from .glb import Gltf
from .test_gltf_skins import Skinned
from .usd_files import animated, mesh as square, usda

#: WGS 84's equatorial radius, and digits that float32 does not have there.
PLACE = (6378137.3, -312345.7, 4987654.6)
ORIGIN = (0.0, 0.0, 0.0)
VERTICES, FACES = icosphere(2)
Doubles = NDArray[np.float64]


def gltf(folder: Path, place: Vector) -> Path:
    """A rotated ball, a camera and a light, each at a node of its own."""
    file = Gltf()
    file.mesh(attributes={"POSITION": file.accessor(VERTICES)}, indices=file.accessor(FACES.ravel(), "<u2"))
    x, y, z = place
    file.document["nodes"][0] |= {"translation": [x, y, z], "rotation": [0.5, 0.1, -0.2, 0.8]}
    file.document["cameras"] = [{"type": "perspective", "perspective": {"yfov": 0.6, "znear": 0.1}}]
    file.node(camera=0, translation=[x + 0.3, y, z + 5])
    file.document["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": "point"}]}}
    file.node(extensions={"KHR_lights_punctual": {"light": 0}}, translation=[x, y + 3, z])
    return file.write(folder / "a.glb")


def turning(folder: Path, place: Vector) -> Path:
    """The ball and its light, with an animation that turns it."""
    file = Gltf()
    file.mesh(attributes={"POSITION": file.accessor(VERTICES)}, indices=file.accessor(FACES.ravel(), "<u2"))
    file.document["nodes"][0]["translation"] = list(place)
    quarter = np.sqrt(0.5).tolist()
    sampler = {
        "input": file.accessor(np.array([0.0, 1.0])),
        "output": file.accessor(np.array([[0, 0, 0, 1], [0, quarter, 0, quarter]])),
    }
    channel = {"sampler": 0, "target": {"node": 0, "path": "rotation"}}
    file.document["animations"] = [{"samplers": [sampler], "channels": [channel]}]
    return file.write(folder / "a.glb")


def skinned(folder: Path, place: Vector) -> Path:
    """A skin whose root joint is moved."""
    made = Skinned(inverse=False)
    nodes = made.gltf.document["nodes"]
    root = nodes[made.skin["joints"][0]]
    root["matrix"][12:15] = (np.array(root["matrix"][12:15]) + place).tolist()
    return made.gltf.write(folder / "a.glb")


def obj(folder: Path, place: Vector) -> Path:
    path = folder / "a.obj"
    points = VERTICES.astype(np.float64) + place
    path.write_text(
        "".join(f"v {x:.6f} {y:.6f} {z:.6f}\n" for x, y, z in points)
        + "".join(f"f {a} {b} {c}\n" for a, b, c in FACES + 1)
    )
    return path


def ply(folder: Path, place: Vector) -> Path:
    """Double coordinates, with a third axis that points up."""
    path = folder / "a.ply"
    points = VERTICES.astype(np.float64) + place
    head = f"ply\nformat ascii 1.0\ncomment crs EPSG:4978\nelement vertex {len(points)}\n"
    head += "".join(f"property double {axis}\n" for axis in "xyz") + f"element face {len(FACES)}\n"
    head += "property list uchar int vertex_indices\nend_header\n"
    rows = [f"{x:.6f} {y:.6f} {z:.6f}\n" for x, y, z in points] + [f"3 {a} {b} {c}\n" for a, b, c in FACES]
    path.write_text(head + "".join(rows))
    return path


def usd(folder: Path, place: Vector) -> Path:
    pytest.importorskip("pxr")
    moved = f'double3 xformOp:translate = {place}\nuniform token[] xformOpOrder = ["xformOp:translate"]\n'
    turned = "rotateXYZ = (20, 30, 40)\n"
    inner = f'float3 xformOp:{turned}uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]\n'
    content = f'def Xform "site"\n{{{moved}\n{square(inner)}}}\n'
    return usda(folder, content, up="Z")


def turning_usd(folder: Path, place: Vector) -> Path:
    """A square that turns by a quarter."""
    pytest.importorskip("pxr")
    moved = f'double3 xformOp:translate = {place}\nuniform token[] xformOpOrder = ["xformOp:translate"]\n'
    turned = "double xformOp:rotateY.timeSamples = { 12: 0, 36: 90 }\n"
    inner = f'{turned}uniform token[] xformOpOrder = ["xformOp:rotateY"]\n'
    path = folder / "a.usda"
    path.write_text(animated(f'def Xform "site" {{ {moved} {square(inner)} }}\n'))
    return path


WRITERS: list[Callable[[Path, Vector], Path]] = [gltf, turning, skinned, obj, ply, usd]


def points(scene: Scene) -> Doubles:
    """Return all vertices, then the positions of the camera and of point lights."""
    parts = [mesh.vertices.astype(np.float64) for mesh in scene.meshes]
    places = [scene.camera.position, scene.camera.look_at]
    places += [light.position for light in scene.lights if isinstance(light, PointLight)]
    return np.concatenate([*parts, np.array(places)])


def shape(scene: Scene) -> Doubles:
    """Return `points` relative to the center of the first mesh."""
    return np.asarray(points(scene) - scene.meshes[0].vertices.mean(axis=0, dtype=np.float64))


@pytest.mark.parametrize("write", WRITERS)
def test_shape(write: Callable[[Path, Vector], Path], tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """A bare model has the same shape, camera and lights near and far; only the far one is moved, with a warning."""
    near = shape(load(write(tmp_path, ORIGIN)))
    assert "far" not in caplog.text
    far = load(write(tmp_path, PLACE))
    assert "is far from the origin; it is moved there" in caplog.text
    # Text files have six decimals, the others float64 coordinates.
    np.testing.assert_allclose(shape(far), near, rtol=0, atol=3e-6 * np.abs(near).max())
    assert np.abs(points(far)).max() < 10 * np.abs(near).max()


@pytest.mark.parametrize("write", WRITERS)
def test_scene_file(write: Callable[[Path, Vector], Path], tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """`clrt convert` keeps the move, and the scene file shows the same; without it the coordinates are the file's."""
    model, scene = write(tmp_path, PLACE), tmp_path / "scene.toml"
    bare = load(model)
    done = CliRunner().invoke(convert, [str(model), str(scene)])
    assert done.exit_code == 0, done.output
    again = load(scene)
    np.testing.assert_array_equal(again.meshes[0].vertices, bare.meshes[0].vertices)
    assert again.camera == bare.camera
    assert bare.source is not None
    kept = bare.source.meshes[0].table
    axis = f'up = "{kept["up"]}"\n' if "up" in kept else ""
    scene.write_text(f'[[mesh]]\nfile = "{model.name}"\n{axis}')
    expected = bare.meshes[0].vertices.astype(np.float64) - kept["translate"]
    np.testing.assert_allclose(load(scene).meshes[0].vertices, expected, rtol=2**-23)


@pytest.mark.parametrize("write", [turning, turning_usd])
def test_animation(write: Callable[[Path, Vector], Path], tmp_path: Path) -> None:
    """Every pose of an animation is moved alike."""
    poses = []
    for place in (ORIGIN, PLACE):
        animation = load(write(tmp_path, place)).animation
        assert animation is not None and hasattr(animation, "pose")
        poses.append([animation.pose(seconds).meshes[0].vertices for seconds in (0.0, 0.3, 1.0)])
    near, far = (np.array(each, np.float64) for each in poses)
    np.testing.assert_allclose(far - far[0].mean(axis=0), near - near[0].mean(axis=0), rtol=0, atol=1e-6)


@pytest.mark.parametrize("seed", range(20))
def test_far_center(seed: int) -> None:
    """Near boxes stay; far ones end at 0, where float32 coordinates keep the digits that the box needs."""
    rng = np.random.default_rng(seed)
    size = 10 ** rng.uniform(-3, 3, 3)
    direction = rng.normal(size=3)
    direction /= np.abs(direction).max()
    for distance, is_far in ((0.99, False), (1.01, True), (1e5, True)):
        middle = direction * distance * FAR * size.max()
        center = np.array(far_center(middle - size / 2, middle + size / 2))
        assert bool(center.any()) == is_far
        np.testing.assert_array_equal(center, center.astype(np.float32))
        if is_far:
            inside = middle + (rng.random((100, 3)) - 0.5) * size
            back = (inside - center).astype(np.float32) + center
            assert np.abs(back - inside).max() < 2.0**-20 * size.max() + np.spacing(np.abs(middle).max())
