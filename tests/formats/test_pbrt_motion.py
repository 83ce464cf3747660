"""Motion in pbrt's scenes: transformations at two times, of the camera, of shapes and of instances."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clrt.scene.exposure import motion_of
from clrt.scene.geometry.transform import rotation, translation

from .pbrt_files import TRIANGLE, UPRIGHT, problem, scene

MOVES = "ActiveTransform EndTime Translate 2 0 0 Rotate 60 0 0 1 ActiveTransform All"
END = translation((2, 0, 0)) @ rotation((0, 0, 60))
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]])


def test_shapes_move_about_their_own_origin(tmp_path: Path) -> None:
    """The transformations after ActiveTransform are those of one time; both before it, and after All. The origin of the
    shape's own coordinates moves in a straight line."""
    read = scene(tmp_path, f"Translate 0 5 0 {MOVES} Scale 2 2 2 {TRIANGLE}")
    (moving,) = read.instances
    assert not read.meshes and read.camera.shutter == (0.0, 1.0) and not read.camera.moves
    motion = motion_of([moving])
    for s in (0.0, 0.25, 1.0):
        matrix = motion.at(s)[0]
        points = moving.mesh.vertices @ matrix[:, :3].T + matrix[:, 3]
        turned = 2 * CORNERS @ rotation((0, 0, 60 * s))[:3, :3].T
        np.testing.assert_allclose(points, turned + [2 * s, 5, 0], atol=1e-6)


def test_attributes_restore_both_times(tmp_path: Path) -> None:
    """AttributeEnd and TransformEnd end the motion, and so does Identity."""
    text = f"AttributeBegin {MOVES} AttributeEnd {TRIANGLE} TransformBegin {MOVES} TransformEnd {TRIANGLE} "
    read = scene(tmp_path, f"{text} {MOVES} Identity {TRIANGLE}")
    assert len(read.meshes) == 3 and not read.instances and read.camera.shutter == (0.0, 0.0)
    start = scene(tmp_path, f"ActiveTransform StartTime Translate 0 0 -1 ActiveTransform All {TRIANGLE}").instances[0]
    np.testing.assert_allclose(start.mesh.vertices, CORNERS - [0, 0, 1])
    assert start.to_world_end is not None
    np.testing.assert_allclose(start.to_world_end[:3, 3], (0, 0, 1))


def test_the_camera_moves(tmp_path: Path) -> None:
    """Its transformation goes from the world to the camera."""
    before = 'Scale -1 1 1 ActiveTransform EndTime Translate -3 0 0 ActiveTransform All Camera "perspective"'
    camera = scene(tmp_path, TRIANGLE, before).camera
    assert camera.moves and camera.shutter == (0.0, 1.0)
    np.testing.assert_allclose(camera.position, (0, 0, 0), atol=1e-12)
    np.testing.assert_allclose(camera.at_end.position, (3, 0, 0), atol=1e-12)


@pytest.mark.parametrize(
    "times, shutter, expected",
    [("0 1", (0, 1), (0, 1)), ("0 2", (0.5, 1), (0.25, 0.5)), ("1 3", (0, 2), (0, 0.5)), ("0 1", (0.5, 4), (0.5, 1))],
)
def test_poses_are_those_of_the_shutter(
    tmp_path: Path, times: str, shutter: tuple[float, float], expected: tuple[float, float]
) -> None:
    """Transformations have times of their own; before and after these they rest."""
    opens, closes = shutter
    own = f' "float shutteropen" {opens} "float shutterclose" {closes}'
    read = scene(tmp_path, f"{MOVES} {TRIANGLE}", f"TransformTimes {times} {UPRIGHT.strip()}{own}")
    (moving,) = read.instances
    end = moving.to_world_end
    assert read.camera.shutter == shutter and end is not None
    first = moving.mesh.vertices
    last = first @ end[:3, :3].T + end[:3, 3]
    for s, points in zip(expected, (first.astype(np.float64), last)):
        np.testing.assert_allclose(points, CORNERS @ rotation((0, 0, 60 * s))[:3, :3].T + [2 * s, 0, 0], atol=1e-6)


def test_instances_and_spheres_move(tmp_path: Path) -> None:
    """A sphere that moves becomes a mesh, of a moving instance, too."""
    ball = 'Shape "sphere" "float radius" 0.5'
    pair = f'ObjectBegin "pair" {TRIANGLE} {ball} ObjectEnd'
    read = scene(tmp_path, f'{pair} {MOVES} ObjectInstance "pair" {ball}')
    assert not read.spheres and len(read.instances) == 3
    for each in read.instances:
        assert each.to_world_end is not None
        np.testing.assert_allclose(each.to_world_end, END[:3], atol=1e-12)


def test_what_does_not_move(tmp_path: Path) -> None:
    """Lights, and shapes inside objects, are refused with a remedy, or stay."""
    light = f'{MOVES} LightSource "point" {TRIANGLE}'
    inside = f'ObjectBegin "a" {MOVES} {TRIANGLE} ObjectEnd ObjectInstance "a"'
    assert "motion of lights is not supported" in problem(tmp_path, light)
    assert "motion inside an object is not supported" in problem(tmp_path, inside)
    assert scene(tmp_path, light, approximate=True).lights
    assert all(each.to_world_end is None for each in scene(tmp_path, inside, approximate=True).instances)
