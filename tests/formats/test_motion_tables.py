"""Motion in scene files: [camera.end], and `motion` of meshes and instances; in frames, and in saved scenes."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import clrt
from clrt.errors import SceneError
from clrt.output.scenes import save_scene
from clrt.rendering.checkpoint.identity import scene_hash
from clrt.scene.exposure import motion_of
from clrt.scene.geometry.transform import rotation, scaling, translation

from .test_gltf_animations import animated

SCENE = """
render = { size = [16, 16], spp = 2, max_depth = 2 }
environment = { color = [1, 1, 1] }
[camera]
position = [0, 0, 9]
shutter = [0, 1]
rolling_shutter = 0.25
[camera.end]
look_at = [1, 0, 0]
fov_degrees = 30
[[mesh]]
name = "turning"
vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
faces = [[0, 1, 2]]
scale = 2
translate = [1, 2, 3]
motion = { rotate_degrees = [0, 0, 90], pivot = [1, 0, 0] }
[[instance]]
mesh = "turning"
translate = [0, 0, -4]
[[mesh]]
name = "resting"
vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
faces = [[0, 1, 2]]
visible = false
[[instance]]
mesh = "resting"
repeat = [{ count = 2, translate = [3, 0, 0] }]
translate = [0, 5, 0]
motion = { matrix = [[2, 0, 0, 1], [0, 2, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]] }
"""


def loaded(folder: Path, text: str = SCENE) -> clrt.Scene:
    (folder / "scene.toml").write_text(text, encoding="utf-8")
    return clrt.load(folder / "scene.toml")


def test_motion_is_the_transform_at_the_end(tmp_path: Path) -> None:
    """Keys that it omits are the table's; copies move with what they copy, or by their own motion."""
    scene = loaded(tmp_path)
    camera = scene.camera
    assert camera.exposure == 1.25 and camera.end == clrt.CameraEnd(look_at=(1, 0, 0), fov_degrees=30)
    assert scene.meshes == [] and len(scene.instances) == 4
    turning, copy, one, two = scene.instances
    start = (translation((1, 2, 3)) @ scaling((2, 2, 2)))[:3]
    end = (translation((1, 2, 3)) @ rotation((0, 0, 90)) @ scaling((2, 2, 2)))[:3]
    np.testing.assert_allclose(turning.to_world, start)
    np.testing.assert_allclose(turning.to_world_end, end)  # type: ignore[arg-type]
    for s, matrix in ((s, motion_of([turning]).at(s)[0]) for s in (0.25, 0.5)):
        point = matrix @ [1, 0, 0, 1]
        np.testing.assert_allclose(point, (1 - s) * start @ [1, 0, 0, 1] + s * end @ [1, 0, 0, 1], atol=1e-12)
        np.testing.assert_allclose(matrix[:, :3], 2 * rotation((0, 0, 90 * s))[:3, :3], atol=1e-12)
    lower = motion_of([copy]).at(0.3)[0] - motion_of([turning]).at(0.3)[0]
    np.testing.assert_allclose(lower, [[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, -4]], atol=1e-12)
    for number, each in enumerate((one, two)):
        shift = 3.0 * number
        np.testing.assert_allclose(each.to_world, translation((shift, 5, 0))[:3])
        np.testing.assert_allclose(each.to_world_end, [[2, 0, 0, 1 + shift], [0, 2, 0, 0], [0, 0, 2, 0]])  # type: ignore[arg-type]


def test_saved_scenes_move_alike(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """From their tables, and from instances made in Python, with the pivot."""
    scene = loaded(tmp_path)
    matrix = (translation((1, 0, 2)) @ rotation((10, 20, 30)))[:3]
    pivot = np.column_stack([np.eye(3), [0.5, -1, 2]])
    scene.instances.append(clrt.Instance(scene.instances[2].mesh, np.eye(3, 4), None, "made", matrix, pivot))
    (tmp_path / "saved").mkdir()
    save_scene(scene, tmp_path / "saved" / "scene.toml")
    again = clrt.load(tmp_path / "saved" / "scene.toml")
    assert again.camera == scene.camera
    assert len(again.instances) == len(scene.instances)
    for each, other in zip(again.instances, scene.instances):
        np.testing.assert_allclose(motion_of([each]).at(0.4), motion_of([other]).at(0.4), atol=1e-12)
    assert not caplog.messages
    scene.instances[-1].pivot = np.diag([1.0, 6.0, 1.0, 1.0])
    save_scene(scene, tmp_path / "saved" / "other.toml")
    assert 'instance "made": turns about the axes of its mesh in the saved scene' in caplog.text
    faster = loaded(tmp_path, SCENE.replace("90]", "80]"))
    assert scene_hash(loaded(tmp_path)) != scene_hash(faster)


@pytest.mark.parametrize(
    "old, new, message",
    [
        (
            "motion = { rotate_degrees = [0, 0, 90], pivot = [1, 0, 0] }",
            "motion = 3",
            "mesh[0].motion: 3 is not a table",
        ),
        ("pivot = [1, 0, 0]", "pivots = [1, 0, 0]", 'mesh[0].motion: key "pivots" is unknown; did you mean "pivot"?'),
        ("rotate_degrees = [0, 0, 90]", "scale = 0", "mesh[0].motion: its transform flattens the mesh"),
        (
            "[0, 0, 90]",
            "[0, 0, 181]",
            "mesh[0].motion.rotate_degrees: [0, 0, 181] is more than 180 degrees from [0.0, 0.0",
        ),
        ("matrix = [[2, 0, 0, 1]", "matrix = [[0, 0, 0, 1]", "instance[1].motion: its transform"),
        ("rotate_degrees = [0, 0, 90]", "scale = [-1, 1, 1]", "one of to_world and to_world_end mirrors"),
        ("fov_degrees = 30", "fov_degrees = 0", "camera.end.fov_degrees: 0 is not above 0"),
        ("fov_degrees = 30", "aperture_radius = 1", 'camera.end: key "aperture_radius" is unknown'),
        ("[camera.end]\nlook_at = [1, 0, 0]\nfov_degrees = 30", "end = 3", "camera.end: 3 is not a table"),
        ("shutter = [0, 1]", "shutter = [2, 1]", "camera.shutter: [2, 1] closes before it opens"),
    ],
)
def test_mistakes(tmp_path: Path, old: str, new: str, message: str) -> None:
    """Each names the table and the remedy."""
    assert SCENE.count(old) == 1
    with pytest.raises(SceneError, match=re.escape(message)):
        clrt.render(loaded(tmp_path, SCENE.replace(old, new)))


def test_motion_without_a_shutter_is_reported(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """The image is that of the start."""
    text = SCENE.replace("shutter = [0, 1]\nrolling_shutter = 0.25\n", "")
    found = clrt.render(loaded(tmp_path, text)).pixels
    assert "what moves is not blurred" in caplog.text
    still = re.sub(r"motion = .*|\[camera.end\]\n.*\n.*", "", text)
    np.testing.assert_array_equal(found, clrt.render(loaded(tmp_path, still)).pixels)


@pytest.mark.parametrize("camera", ["", 'name = "eye"'])
def test_frames_of_models_are_exposed(tmp_path: Path, camera: str) -> None:
    """A frame's meshes and camera move from where the animation has them when the shutter opens to where they are when
    it closes; without a shutter they are those of the static frame."""
    animated().write(tmp_path / "a.glb")
    text = f"""
        animation = {{ fps = 4 }}
        camera = {{ {camera} {"," * bool(camera)} shutter = [0.05, 0.15], rolling_shutter = 0.1 }}
        mesh = [{{ file = "a.glb", animation = "walk" }}]
    """
    (number, frame), *_ = clrt.frames(loaded(tmp_path, text), [3])
    still = next(clrt.frames(loaded(tmp_path, re.sub(r",? *shutter.*,.* = 0.1", "", text)), [3]))[1]
    assert number == 3 and still.instances == [] and len(still.meshes) == 1
    (moving,), x = frame.instances, 1 + 0.75
    for s, seconds in ((0.0, 0.05), (0.5, 0.15), (1.0, 0.25)):
        matrix = motion_of([moving]).at(s)[0]
        points = moving.mesh.vertices @ matrix[:, :3].T + matrix[:, 3]
        np.testing.assert_allclose(points, still.meshes[0].vertices + [seconds, 0, 0], atol=1e-5)
    end = frame.camera.at_end
    if camera:
        np.testing.assert_allclose(frame.camera.position, (x + 0.05, 0, 5), atol=1e-6)
        np.testing.assert_allclose(end.position, (x + 0.25, 0, 5), atol=1e-6)
        assert frame.camera.moves and frame.camera.shutter == (0.05, 0.15)
    else:
        assert not frame.camera.moves


def test_frames_of_keyframes_and_turntables_are_exposed(tmp_path: Path) -> None:
    """Their cameras move by as much as the animation in the same time."""
    table = """
        camera = { position = [0, 0, 4], shutter = [-0.25, 0.25] }
        animation = { turntable_seconds = 8, fps = 1 }
        sphere = [{}]
    """
    (_, frame), *_ = clrt.frames(loaded(tmp_path, table), [2])
    for camera, turn in ((frame.camera, 1.75), (frame.camera.at_end, 2.25)):
        angle = turn * np.pi / 4
        np.testing.assert_allclose(camera.position, (4 * np.sin(angle), 0, 4 * np.cos(angle)), atol=1e-9)
    keys = (
        table.replace("turntable_seconds = 8, ", "")
        + """
        [[keyframe]]
        time = 0
        position = [0, 0, 4]
        [[keyframe]]
        time = 10
        position = [10, 0, 4]
    """
    )
    (_, frame), *_ = clrt.frames(loaded(tmp_path, keys), [5])
    np.testing.assert_allclose([frame.camera.position[0], frame.camera.at_end.position[0]], [4.75, 5.25])
