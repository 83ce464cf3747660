"""Animations of glTF files, sampled at a time, against scipy's curves; the choice of scenes and animations."""

from __future__ import annotations

import logging
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation, Slerp

import clrt
from clrt.errors import SceneError, UsageError
from clrt.formats.gltf.animations import Track, slerp
from clrt.formats.load_scene import load
from clrt.scene.animation import ModelAnimation
from clrt.scene.materials.material_types import Diffuse

from .glb import TRIANGLE, Gltf, ball

TIMES = np.array([0.5, 1, 2.5, 2.75], np.float32)
RNG = np.random.default_rng(12)
#: Moments before, at, between and after the keyframes.
MOMENTS = [-1.0, 0.5, 0.625, 1.0, 1.75, 2.6, 2.75, 9.0]


def track(values: NDArray[Any], interpolation: str, name: str = "translation") -> Track:
    return Track(0, name, interpolation, TIMES, values.reshape(len(TIMES), -1, values.shape[-1]))


@pytest.mark.parametrize("time", MOMENTS)
def test_curves_of_vectors(time: float) -> None:
    """Linear pieces, steps, and cubic pieces whose tangents are per second; constant outside of the keyframes."""
    values, inside = RNG.normal(size=(4, 3, 2)), float(np.clip(time, 0.5, 2.75))
    linear = [np.interp(inside, TIMES, column) for column in values[:, 1].T]
    np.testing.assert_allclose(track(values[:, 1], "LINEAR").at(time), linear, atol=1e-12)
    before = max(int(np.searchsorted(TIMES, inside, side="right")) - 1, 0)
    np.testing.assert_array_equal(track(values[:, 1], "STEP").at(time), values[before, 1])
    spline = track(values, "CUBICSPLINE").at(time)
    piece = min(before, 2)
    ends = slice(piece, piece + 2)
    slopes = np.stack([values[piece, 2], values[piece + 1, 0]])
    np.testing.assert_allclose(spline, CubicHermiteSpline(TIMES[ends], values[ends, 1], slopes)(inside), atol=1e-9)


@pytest.mark.parametrize("time", MOMENTS)
def test_rotations_take_the_shorter_way(time: float) -> None:
    turns = Rotation.random(4, random_state=3)
    quaternions = turns.as_quat() * [[1], [-1], [2], [-0.5]]
    found = Rotation.from_quat(track(quaternions, "LINEAR", "rotation").at(time))
    expected = Slerp(TIMES, turns)(np.clip(time, 0.5, 2.75))
    assert (found.inv() * expected).magnitude() < 1e-7


@pytest.mark.parametrize("angle", [1e-9, 1e-6, 1e-3, 0.1, 1.0, 3.14])
@given(st.integers(0, 2**32 - 1), st.floats(0.1, 0.4))
def test_slerp_of_near_and_far_rotations(angle: float, seed: int, s: float) -> None:
    """The angle to the first one is the fraction `s` of the angle between them, from 1e-9 to half a turn."""
    rng = np.random.default_rng(seed)
    one = Rotation.random(random_state=rng.integers(1 << 30))
    axis = rng.normal(size=3)
    other = one * Rotation.from_rotvec(angle * axis / np.linalg.norm(axis))
    found = Rotation.from_quat(slerp(one.as_quat(), other.as_quat(), s))
    assert (one.inv() * found).magnitude() == pytest.approx(s * angle, abs=1e-7)


def animated() -> Gltf:
    """Return a triangle with one morph target, and a camera, below a node that moves along x and turns about y in
    "walk", and whose target and scale change in the second animation, which has no name."""
    gltf = Gltf()
    moves = np.ones((3, 3), np.float32)
    gltf.mesh(attributes={"POSITION": gltf.accessor(TRIANGLE)}, targets=[{"POSITION": gltf.accessor(moves)}])
    gltf.document["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1}}]
    eye = gltf.node(False, camera=0, translation=[0, 0, 5], name="eye")
    gltf.document["nodes"][0] |= {"children": [eye], "translation": [0, 7, 0], "name": "body"}
    seconds = gltf.accessor(np.array([0.0, 2.0]))
    turns = np.array([[0, 0, 0, 127], [0, 90, 0, 90]])
    samplers = [
        {"input": seconds, "output": gltf.accessor(np.array([[1.0, 0, 0], [3, 0, 0]]))},
        {"input": seconds, "output": gltf.accessor(turns, "<i1", normalized=True), "interpolation": "STEP"},
        {"input": seconds, "output": gltf.accessor(np.array([0, 255]), "<u1", normalized=True)},
        {"input": seconds, "output": gltf.accessor(np.array([[1.0, 1, 1], [2, 3, 4]])), "interpolation": "LINEAR"},
    ]
    paths = ["translation", "rotation", "weights", "scale"]
    channels = [{"sampler": k % 2, "target": {"node": 0, "path": path}} for k, path in enumerate(paths)]
    gltf.document["animations"] = [
        {"name": "walk", "samplers": samplers[:2], "channels": channels[:2]},
        {"samplers": samplers[2:], "channels": channels[2:]},
    ]
    return gltf


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return animated().write(tmp_path / "a.glb")


def test_nodes_move_at_a_time(path: Path) -> None:
    """Without a choice they are where the file puts them; with one, a property that is not animated stays."""
    assert load(path).meshes[0].vertices == pytest.approx(TRIANGLE + [0, 7, 0])
    walking = clrt.load(path, animation="walk", time=0.5)
    assert walking.animation is None and walking.meshes[0].vertices == pytest.approx(TRIANGLE + [1.5, 0, 0])
    assert walking.camera.position == pytest.approx((1.5, 0, 5))
    ended = clrt.load(path, time=9)
    assert ended.meshes[0].vertices == pytest.approx(TRIANGLE[:, [2, 1, 0]] * [1, 1, -1] + [3, 0, 0], abs=1e-6)
    assert ended.camera.position == pytest.approx((8, 0, 0))
    grown = clrt.load(path, animation="animation 1", time=1.0).meshes[0].vertices
    assert grown == pytest.approx((TRIANGLE + 0.5) * [1.5, 2, 2.5] + [0, 7, 0])
    np.testing.assert_array_equal(clrt.load(path, animation=1, time=1.0).meshes[0].vertices, grown)


def test_frames_of_a_model(path: Path) -> None:
    """Frame n is at n / fps seconds, the last one at the end. The camera follows its node."""
    scene = clrt.load(path)
    assert isinstance(scene.animation, ModelAnimation)
    assert (scene.animation.name, scene.animation.seconds, scene.animation.frames) == ("walk", 2.0, 49)
    assert scene.meshes[0].vertices == pytest.approx(TRIANGLE + [0, 7, 0]), "as without animation"
    for number, still in clrt.frames(scene, [0, 12, 48]):
        expected = clrt.load(path, animation="walk", time=number / 24)
        np.testing.assert_array_equal(still.meshes[0].vertices, expected.meshes[0].vertices)
        assert still.camera == expected.camera and still.animation is None
    assert next(clrt.frames(clrt.load(path, animation=1)))[1].meshes[0].vertices == pytest.approx(TRIANGLE + [0, 7, 0])
    with pytest.raises(UsageError, match="a has no frame 49; its frames are 0 to 48"):
        clrt.frames(scene, [49])


def test_what_was_added_to_the_scene_stays(path: Path) -> None:
    """So do materials, a camera and lights that replace the model's."""
    scene = clrt.load(path)
    floor, red = clrt.Mesh(TRIANGLE, np.array([[0, 1, 2]])), Diffuse(color=(1, 0, 0))
    scene.meshes[0].material = red
    scene.meshes.append(floor)
    scene.camera = clrt.Camera(position=(9, 9, 9))
    ((_, still),) = clrt.frames(scene, [24])
    assert still.meshes[1] is floor and still.meshes[0].material is red and still.lights == scene.lights
    assert still.meshes[0].vertices == pytest.approx(TRIANGLE + [2, 0, 0]) and still.camera is scene.camera


def test_copies_of_scenes_move_too(path: Path) -> None:
    scene = pickle.loads(pickle.dumps(clrt.load(path)))
    ((_, still),) = clrt.frames(scene, [24])
    assert still.meshes[0].vertices == pytest.approx(TRIANGLE + [2, 0, 0])


def test_a_model_without_camera_is_framed_in_its_whole_motion(tmp_path: Path) -> None:
    gltf = animated()
    del gltf.document["nodes"][1]["camera"]
    path = gltf.write(tmp_path / "a.glb")
    camera = clrt.load(path, animation="walk").camera
    forward = np.subtract(camera.look_at, camera.position)
    seen = []
    for _, still in clrt.frames(clrt.load(path), range(0, 49, 6)):
        arms = still.meshes[0].vertices - np.array(camera.position)
        along = arms @ forward / np.linalg.norm(forward)
        seen.append(np.linalg.norm(arms - np.outer(along, forward / np.linalg.norm(forward)), axis=1) / along)
    assert 0.5 < np.max(seen) / np.tan(np.radians(camera.fov_degrees / 2)) < 2**0.5, "within the corners"
    assert clrt.load(path).camera != camera


def test_scenes_by_name(tmp_path: Path) -> None:
    """`scene` of the file is the default; others are chosen by name, else by number."""
    gltf = ball()
    gltf.node(False, mesh=0, translation=[0, 0, 9])
    gltf.document["scenes"] += [{"nodes": [1], "name": "far"}, {"nodes": [1], "name": "0"}]
    path = gltf.write(tmp_path / "a.glb")
    heights = [load(path).meshes[0].vertices[:, 2].max()]
    heights += [clrt.load(path, scene=each).meshes[0].vertices[:, 2].max() for each in ("far", 2, "1", 0)]
    assert heights == pytest.approx(np.array([0, 9, 9, 9, 0]) + heights[0])
    assert clrt.load(path, scene="0").meshes[0].vertices[:, 2].max() > 9, "a name comes first"
    source = load(path).source
    assert source is not None and source.contents == {
        "scenes": ["scene 0", "far", "0"],
        "animations": [],
        "variants": [],
        "extensions": [],
        "left_out": [],
        "look": ["studio"],
    }
    with pytest.raises(SceneError, match=r'a.glb: scene: "fr" is unknown; use one of "scene 0", "far", "0"'):
        clrt.load(path, scene="fr")


def test_poses_in_scene_files(path: Path) -> None:
    """[[mesh]] has the same keys; without a time the animation is at its start."""
    toml = path.with_suffix(".toml")
    for keys, expected in [
        ('animation = "walk"\ntime = 0.5', TRIANGLE + [1.5, 0, 0]),
        ('animation = "walk"', TRIANGLE + [1, 0, 0]),
        ("time = 0.5", TRIANGLE + [1.5, 0, 0]),
        ('scene = "0"', TRIANGLE + [0, 7, 0]),
    ]:
        toml.write_text(f'[[mesh]]\nfile = "a.glb"\n{keys}\n')
        assert load(toml).meshes[0].vertices == pytest.approx(expected)
    for keys, words in [
        ('file = "a.glb"\nvariant = "x"', 'variant: "x" is unknown; the file has none; leave variant out'),
        ("time = 1\nvertices = []\nfaces = []", "mesh[0]: has time, but no file; leave it out, or write a file"),
        ('file = "a.glb"\ntime = inf', "time"),
    ]:
        toml.write_text(f"[[mesh]]\n{keys}\n")
        with pytest.raises(SceneError) as caught:
            load(toml)
        assert words in str(caught.value)


def test_choices_that_a_file_does_not_have(path: Path, folder: Path) -> None:
    with pytest.raises(SceneError, match='a.glb: animation: "run" is unknown; use one of "walk", "animation 1"'):
        clrt.load(path, animation="run")
    with pytest.raises(SceneError, match="triangle.obj: animation: is for glTF files; leave animation out"):
        clrt.load(folder / "models" / "triangle.obj", animation=0)
    (folder / "a.toml").write_text("sphere = [{}]\n")
    with pytest.raises(UsageError, match=r"a.toml: time: is for bare models; leave time out"):
        clrt.load(folder / "a.toml", time=1)
    with pytest.raises(SceneError, match=r"animation: 0 is unknown; the file has none; leave animation out"):
        clrt.load(ball().write(folder / "still.glb"), time=1.0)
    with pytest.raises(UsageError, match="time: nan is not a finite number"):
        clrt.load(path, time=float("nan"))


def test_what_is_not_supported_is_named(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    gltf = animated()
    channels = gltf.document["animations"][0]["channels"]
    channels += [{"sampler": 0, "target": {"path": "pointer"}}, {"sampler": 0, "target": {"path": "translation"}}]
    gltf.document["nodes"][1]["matrix"] = np.eye(4).ravel().tolist()
    channels += [{"sampler": 0, "target": {"path": "translation", "node": 1}}]
    with caplog.at_level(logging.WARNING):
        clrt.load(gltf.write(tmp_path / "a.glb"), time=0)
    (message,) = caplog.messages
    assert message.endswith(
        'left out: "pointer" of animation "walk", translation of node 1, which has a matrix, in animation "walk"'
    )


def broken(where: str, value: Any) -> Gltf:
    gltf = animated()
    sampler = gltf.document["animations"][0]["samplers"][1]
    channel = gltf.document["animations"][0]["channels"][1]
    if where == "node":
        channel["target"]["node"] = value
    elif where == "sampler":
        channel["sampler"] = value
    else:
        sampler[where] = value if isinstance(value, str | int) else gltf.accessor(value)
    return gltf


@pytest.mark.parametrize(
    ("where", "value", "words"),
    [
        ("interpolation", "CUBIC", 'its interpolation is "CUBIC"; write one of LINEAR, STEP, CUBICSPLINE'),
        ("interpolation", 0, 'its interpolation is "0"; write one of LINEAR, STEP, CUBICSPLINE'),
        ("interpolation", "CUBICSPLINE", 'animation "walk", rotation of node 0: has 2 values for 2 times'),
        ("input", -1, "animations[0].samplers[1].input: Input should be greater than or equal to 0"),
        ("sampler", None, "animations[0].channels[1].sampler: Input should be a valid integer"),
        ("input", np.array([2.0, 1.0]), "its times do not ascend"),
        ("input", np.array([0.0, np.nan]), "its times do not ascend"),
        ("input", np.array([0.0, 1, 2]), "has 2 values for 3 times"),
        ("output", np.array([[0, 0, 0, 1], [0, 0, 0, 0.0]]), "has a rotation [0, 0, 0, 0]"),
        ("output", np.array([[0, 0, 0, 1], [0, 0, 0, np.inf]]), "has a value that is not finite"),
        ("output", np.zeros((2, 3)), "is VEC3, not VEC4"),
        ("sampler", 2, 'animation "walk" uses sampler 2, but the file has 2'),
        ("node", 9, 'animation "walk" uses node 9, but the file has 2'),
    ],
)
def test_faults_matter_only_to_animations(
    where: str, value: Any, words: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """A still is read regardless, with a warning."""
    path = broken(where, value).write(tmp_path / "a.glb")
    with pytest.raises(SceneError) as caught:
        clrt.load(path, animation=0)
    assert words in str(caught.value)
    with caplog.at_level(logging.WARNING):
        assert load(path).animation is None
    assert words in caplog.text
