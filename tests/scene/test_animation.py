"""Camera animation: curves against known motions, frames, and rejected input."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from clrt.errors import ClrtError, SceneError, UsageError
from clrt.formats.load_scene import load
from clrt.scene.animation import Animation, Keyframe
from clrt.scene.camera_path import frames, turntable
from clrt.scene.model import Camera, Scene
from clrt.scene.splines import smooth

UNEVEN = np.array([0.0, 0.5, 2.0, 2.25, 5.0])
SCENE = """
[camera]
position = [9, 9, 9]
up = [0, 2, 0]
[animation]
fps = 4
[[keyframe]]
time = 1
position = [0, 1, 5]
look_at = [0, 0, 0]
fov_degrees = 60
[[keyframe]]
time = 2.1
look_at = [3, 1, 0]
[[keyframe]]
time = 3
position = [4, 5, 5]
look_at = [1, 0, 0]
fov_degrees = 30
[[sphere]]
"""


def test_motion_along_a_parabola_is_met_exactly() -> None:
    moments = np.linspace(0, 5, 41)
    weights = np.array([[1.0, -2.0, 0.5], [3.0, 0.2, -1.0], [0.0, 4.0, 2.0]])
    path = [np.vander(times, 3) @ weights for times in (UNEVEN, moments)]
    np.testing.assert_allclose(smooth(UNEVEN, path[0], moments), path[1], atol=1e-12)


def test_even_times_give_catmull_and_roms_spline() -> None:
    """The slope at a value is half the difference of its neighbours, as in scipy's cubic Hermite spline."""
    values = np.random.default_rng(3).normal(size=(7, 3))
    slopes = (values[2:] - values[:-2]) / 2
    moments = np.linspace(1, 5, 33)
    expected = CubicHermiteSpline(np.arange(1, 6), values[1:-1], slopes)(moments)
    np.testing.assert_allclose(smooth(np.arange(7), values, moments), expected, atol=1e-12)


def test_curves_go_through_their_values_with_one_speed() -> None:
    """Slopes agree on both sides of each value; the curve is constant before the first and after the last."""
    rng = np.random.default_rng(5)
    for columns in (1, 3):
        values = rng.normal(size=(5, columns))
        np.testing.assert_array_equal(smooth(UNEVEN, values, UNEVEN), values)
        np.testing.assert_array_equal(smooth(UNEVEN, values, [-1, 9]), values[[0, -1]])
        tiny = 1e-6
        before, after = (smooth(UNEVEN, values, UNEVEN[1:-1] + side) for side in (-tiny, tiny))
        np.testing.assert_allclose((values[1:-1] - before) / tiny, (after - values[1:-1]) / tiny, atol=1e-3)


def test_numbers_stay_between_their_neighbours_and_what_rests_rests() -> None:
    rng, moments = np.random.default_rng(7), np.linspace(0, 5, 501)
    piece = np.clip(np.searchsorted(UNEVEN, moments, side="right") - 1, 0, 3)
    for _ in range(50):
        values = rng.normal(size=5) ** 3
        curve = smooth(UNEVEN, values[:, None], moments)[:, 0]
        ends = np.stack([values[piece], values[piece + 1]])
        assert np.all(curve >= ends.min(0) - 1e-12) and np.all(curve <= ends.max(0) + 1e-12)
    still = np.array([[0, 0, 0], [1, 2, 3], [1, 2, 3], [5, 5, 5], [0, 0, 1.0]])
    np.testing.assert_array_equal(smooth(UNEVEN, still, np.linspace(0.5, 2, 9)), np.tile([1, 2, 3], (9, 1)))


def test_keyframes_move_what_they_name(tmp_path: Path) -> None:
    """4 frames per second from second 1 to 3; each field is interpolated between the keyframes that have it."""
    (tmp_path / "a.toml").write_text(SCENE)
    scene = load(tmp_path / "a.toml")
    stills = dict(frames(scene))
    assert list(stills) == list(range(9)) and scene.camera == Camera(position=(9, 9, 9), up=(0, 2, 0))
    assert all(still.spheres is scene.spheres and still.animation is None for still in stills.values())
    first, middle, last = (stills[n].camera for n in (0, 4, 8))
    assert first == Camera(position=(0, 1, 5), look_at=(0, 0, 0), up=(0, 2, 0), fov_degrees=60)
    assert last == Camera(position=(4, 5, 5), look_at=(1, 0, 0), up=(0, 2, 0), fov_degrees=30)
    assert middle.position == pytest.approx((2, 3, 5)) and middle.fov_degrees == pytest.approx(45), "a straight line"
    assert middle.look_at == pytest.approx(tuple(smooth([1, 2.1, 3], [[0, 0, 0], [3, 1, 0], [1, 0, 0]], [2])[0]))
    assert [number for number, _ in frames(scene, [7, 2])] == [7, 2]


@pytest.mark.parametrize("seconds", [2.0, -2.0])
def test_a_turntable_goes_once_around(seconds: float) -> None:
    """It rotates about the axis through the target: a quarter turn in a quarter of the frames, counter-clockwise
    above."""
    camera = Camera(position=(3, 2, 4), look_at=(1, 1, 1), up=(0, 5, 0), fov_degrees=20)
    scene = Scene(camera=camera, animation=Animation(fps=8, turntable_seconds=seconds))
    cameras = [still.camera for _, still in frames(scene)]
    assert len(cameras) == 16 and cameras[0].position == pytest.approx(camera.position)
    sign = np.sign(seconds)
    assert cameras[4].position == pytest.approx((1 + sign * 3, 2, 1 - sign * 2))
    assert cameras[8].position == pytest.approx((-1, 2, -2))
    steps = np.diff([each.position for each in [*cameras, cameras[0]]], axis=0)
    np.testing.assert_allclose(np.linalg.norm(steps, axis=1), np.linalg.norm(steps[0]))
    assert {(each.look_at, each.up, each.fov_degrees) for each in cameras} == {((1, 1, 1), (0, 5, 0), 20)}
    assert len(list(frames(turntable(scene, 30, 24)))) == 30


KEY = Keyframe(time=0, position=(0, 0, 5))


@pytest.mark.parametrize(
    ("animation", "words"),
    [
        (lambda: Animation(), "has no keyframes and no turntable_seconds"),
        (lambda: Animation(keyframes=(KEY,)), "has 1 keyframe and"),
        (lambda: Animation(turntable_seconds=0), "turntable_seconds: is 0; write"),
        (lambda: Animation(turntable_seconds=1, keyframes=(KEY, KEY)), "keep one"),
        (lambda: Animation(keyframes=(KEY, KEY)), "keyframe[1].time: 0 is not after the previous one, 0"),
        (lambda: Animation(keyframes=(KEY, Keyframe(time=1e9))), "more than 1000000"),
        (
            lambda: Animation(fps=4, keyframes=(KEY, Keyframe(time=2, position=(0, 0, -5)))),
            "in frame 4, 1 s after the first",
        ),
        (
            lambda: Animation(keyframes=(KEY, Keyframe(time=2, position=(0, 5, 0)))),
            "frame 48, 2 s after the first, the camera has no orientation: it looks along its up",
        ),
        (lambda: Animation(fps=1e30, turntable_seconds=1e30), "would have 1e+60 frames, more than 1000000"),
        (lambda: Animation(fps=0), "Animation.fps: 0 is not above 0"),
        (
            lambda: Animation(keyframes=(KEY, Keyframe(time=1, fov_degrees=200))),
            "Keyframe.fov_degrees: 200 is not below 180",
        ),
        (lambda: Animation(keyframes=(KEY, 3)), "Animation.keyframes[1]: 3 is not of type Keyframe"),  # type: ignore[arg-type]
    ],
)
def test_what_cannot_be_shown_is_refused(animation: Callable[[], Animation], words: str) -> None:
    with pytest.raises(SceneError, match=re.escape(words)) as refused:
        Scene(animation=animation())
    assert len(refused.value.problems) == 1
    scene = Scene()
    with pytest.raises(SceneError, match=re.escape(words)):
        scene.animation = animation()
        frames(scene)


def test_mistakes_in_the_file_are_told_together(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(
        "keyframe = [3, { tim = 1 }, { time = 2, look_at = [0, 1] }]\nanimation = { fsp = 3, keyframes = [] }\n"
    )
    with pytest.raises(SceneError) as refused:
        load(tmp_path / "a.toml")
    assert [problem.partition(": ")[2] for problem in refused.value.problems] == [
        "animation.keyframes: keyframes are tables of their own; write [[keyframe]]",
        'animation: key "fsp" is unknown; did you mean "fps"?',
        "keyframe[0]: 3 is not a table; write [[keyframe]]",
        "keyframe[1]: time is missing; add it",
        'keyframe[1]: key "tim" is unknown; did you mean "time"?',
        "keyframe[2].look_at: [0, 1] has 2 entries; write 3",
    ]


@pytest.mark.parametrize("count", [0, -24])
def test_a_turntable_without_frames(count: int) -> None:
    with pytest.raises(UsageError, match=f"frames is {count}; it must be at least 1"):
        turntable(Scene(), count)


@pytest.mark.parametrize(
    ("scene", "chosen", "kind", "words"),
    [
        (Scene(name="still"), None, SceneError, "still: has no animation"),
        (turntable(Scene(), 8), [3, 8], UsageError, "scene has no frame 8; its frames are 0 to 7"),
    ],
)
def test_frames_that_are_not_there(scene: Scene, chosen: Any, kind: type[ClrtError], words: str) -> None:
    with pytest.raises(kind, match=words):
        frames(scene, chosen)
