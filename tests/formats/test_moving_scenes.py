"""Scene files whose meshes are animated models: each frame is the still with the times written out."""

from __future__ import annotations

import pickle
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import clrt
from clrt.errors import SceneError
from clrt.output.scenes import save_scene
from clrt.rendering.checkpoint.identity import scene_hash
from clrt.scene.animation import Animation, SceneAnimation

from .test_gltf_animations import animated

#: Two models, the first twice, of which one is hidden; copies of copies; a light, a material and creases.
SCENE = """
render = { size = [16, 16], spp = 2, max_depth = 2 }
environment = { color = [1, 1, 1] }
materials = { red = { type = "diffuse", color = [1, 0, 0] } }
sphere = [{ center = [0, -9, 0] }]
light = [{ type = "point", position = [0, 5, 0], intensity = [1, 1, 1] }]
[[mesh]]
vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
faces = [[0, 1, 2]]
[[mesh]]
name = "walker"
file = "lit.glb"
animation = "walk"
lights = true
translate = [0, 0, -3]
rotate_degrees = [0, 30, 0]
[[mesh]]
name = "grower"
file = "a.glb"
animation = "1"
material = "red"
visible = false
normals = "smooth"
crease_degrees = 40
[[mesh]]
file = "a.glb"
time = 1.5
[[instance]]
mesh = "walker"
translate = [5, 0, 0]
repeat = [{ count = 3, translate = [0, 2, 0], rotate_degrees = [0, 0, 20] }]
[[instance]]
mesh = "grower"
material = "red"
name = "copy"
scale = 2
"""
KEYFRAMES = """
[camera]
position = [0, 0, 20]
[animation]
fps = 4
[[keyframe]]
time = 0.5
position = [0, 0, 20]
[[keyframe]]
time = 2
position = [0, 9, 20]
"""


def written(folder: Path, text: str) -> Path:
    """Write the models, and the scene file that places them."""
    animated().write(folder / "a.glb")
    gltf = animated()
    gltf.document["extensionsUsed"] = ["KHR_lights_punctual"]
    gltf.document["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": "point"}]}}
    gltf.document["nodes"][1]["extensions"] = {"KHR_lights_punctual": {"light": 0}}
    gltf.write(folder / "lit.glb")
    path = folder / "scene.toml"
    path.write_text(text)
    return path


def still(folder: Path, text: str, seconds: float) -> clrt.Scene:
    """Return the scene in which each animation has this time."""
    timed = re.sub('^(animation = ".*")$', rf"\1\ntime = {seconds!r}", text, flags=re.MULTILINE)
    (folder / "still.toml").write_text(timed)
    return clrt.load(folder / "still.toml")


@pytest.mark.parametrize("copied", [False, True])
def test_frames_are_the_stills_at_their_times(tmp_path: Path, copied: bool) -> None:
    """All that is visible is the same, in the same order; so is what a copy of the scene shows."""
    scene = clrt.load(written(tmp_path, SCENE))
    scene = pickle.loads(pickle.dumps(scene)) if copied else scene
    assert isinstance(scene.animation, SceneAnimation)
    assert (scene.animation.fps, scene.animation.frames, scene.animation.camera) == (24, 49, None)
    found = dict(clrt.frames(scene, [0, 7, 30, 48]))
    hashes = {number: scene_hash(frame) for number, frame in found.items()}
    assert len(set(hashes.values())) == 4
    for number, frame in found.items():
        expected = still(tmp_path, SCENE, number / 24)
        assert hashes[number] == scene_hash(expected) and frame.animation is None
        assert [part.name for part in frame.instances] == [part.name for part in expected.instances]
    assert hashes[0] == scene_hash(scene), "a still shows the start"


@pytest.mark.programs
def test_frames_are_rendered_as_their_stills(tmp_path: Path) -> None:
    """Bit for bit, where the BVH is refitted, with the options of a scene file's camera animation."""
    path = written(tmp_path, SCENE + KEYFRAMES)
    for number, image in clrt.animate(path, frames=[0, 3, 6]):
        expected = still(tmp_path, SCENE + KEYFRAMES, 0.5 + number / 4)
        ((_, frame),) = clrt.frames(clrt.load(path), [number])
        expected.camera = frame.camera
        np.testing.assert_array_equal(image.pixels, clrt.render(expected).pixels)


def test_cameras_animation_defines_the_frames(tmp_path: Path) -> None:
    """Its keyframes' times are those of the models; a turntable goes around them."""
    scene = clrt.load(written(tmp_path, SCENE + KEYFRAMES))
    assert scene.animation is not None and (scene.animation.frames, scene.animation.fps) == (7, 4)
    frames = dict(clrt.frames(scene))
    cameras = dict(clrt.frames(clrt.load(written(tmp_path, KEYFRAMES + "[[sphere]]"))))
    assert [frame.camera for frame in frames.values()] == [frame.camera for frame in cameras.values()]
    around = clrt.turntable(scene, 8, fps=4)
    for number, frame in clrt.frames(around, [0, 2, 7]):
        assert frame.meshes[1].vertices == pytest.approx(still(tmp_path, SCENE, number / 4).meshes[1].vertices)
        assert np.linalg.norm(frame.camera.position) == pytest.approx(20)


def test_camera_of_a_moving_model_moves(tmp_path: Path) -> None:
    """The first model of a name has the camera; an animation of fps alone has the models' frames."""
    text = '[camera]\nname = "eye"\n[animation]\nfps = 2\n' + "".join(
        f'[[mesh]]\nfile = "a.glb"\nanimation = "walk"\ntranslate = [0, {height}, 0]\n' for height in (0, 100)
    )
    found = [frame.camera for _, frame in clrt.frames(clrt.load(written(tmp_path, text)))]
    expected = [clrt.load(tmp_path / "a.glb", time=number / 2).camera for number in range(5)]
    np.testing.assert_allclose([each.position for each in found], [each.position for each in expected], atol=1e-6)


def test_saved_scene_files_move_too(tmp_path: Path) -> None:
    scene = clrt.load(written(tmp_path, SCENE + KEYFRAMES))
    save_scene(scene, tmp_path / "saved.toml")
    again = clrt.load(tmp_path / "saved.toml")
    assert len(again.lights) == 2
    for (_, one), (_, other) in zip(clrt.frames(scene), clrt.frames(again), strict=True):
        assert one.camera == other.camera and one.lights == other.lights
        np.testing.assert_array_equal(one.meshes[1].vertices, other.meshes[1].vertices)


def test_models_that_are_saved_as_stills(tmp_path: Path) -> None:
    """A moved mesh of a program's is written as it is; without another model the scene then has no animation."""
    scene = clrt.load(written(tmp_path, "[[mesh]]\nfile = 'a.glb'\nanimation = 'walk'"))
    scene.meshes[0] = replace(scene.meshes[0], vertices=scene.meshes[0].vertices + np.float32(1))
    save_scene(scene, tmp_path / "saved.toml")
    saved = clrt.load(tmp_path / "saved.toml")
    assert saved.animation is None and saved.meshes[0].vertices == pytest.approx(scene.meshes[0].vertices)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[animation]\nfps = 2\n[[mesh]]\nfile = 'a.glb'\ntime = 1", "has no keyframes and no turntable_seconds"),
        ("[animation]\nfps = 0\n[[mesh]]\nfile = 'a.glb'\nanimation = 'walk'", "animation.fps: 0 is not above 0"),
        ("[[keyframe]]\ntime = 1\n[[mesh]]\nfile = 'a.glb'\nanimation = 'walk'", "has 1 keyframe and no turntable"),
        ("[animation]\nfps = 1e9\n[[mesh]]\nfile = 'a.glb'\nanimation = 'walk'", "more than 1000000"),
    ],
)
def test_mistakes(text: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=re.escape(words)):
        clrt.frames(clrt.load(written(tmp_path, text)))


def test_scenes_without_moving_models_have_the_cameras_animation(tmp_path: Path) -> None:
    text = KEYFRAMES + "[[mesh]]\nfile = 'a.glb'\nanimation = 'walk'\ntime = 1"
    assert isinstance(clrt.load(written(tmp_path, text)).animation, Animation)
