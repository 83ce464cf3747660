"""Motion between two poses: positions move linearly, rotations at a constant rate, stretches linearly; and boxes
contain what moves at all times."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.scene.exposure import camera_at, middle_of_rows
from clrt.scene.geometry.motion import Motion, Turns, quaternions
from clrt.scene.geometry.transform import axis_rotation, quaternion
from clrt.scene.model import Camera, Instance, Mesh, Scene
from clrt.scene.pose_motion import affine_between, moving_between

from .shapes import icosphere

Doubles = NDArray[np.float64]
COUNT = 40
TIMES = np.linspace(0, 1, 23)


def rotations(rng: np.random.Generator) -> Doubles:
    return np.array([quaternion(*rng.normal(size=4))[:3, :3] for _ in range(COUNT)])


def poses(rng: np.random.Generator, mirrors: bool = False) -> Doubles:
    """Return random affine matrices (COUNT, 3, 4), which all mirror or all do not."""
    linear = rng.normal(size=(COUNT, 3, 3))
    wrong = (np.linalg.det(linear) < 0) != mirrors
    linear[wrong, 0] *= -1
    return np.concatenate([linear, rng.normal(size=(COUNT, 3, 1))], axis=-1)


@pytest.mark.parametrize("mirrors", [False, True])
def test_motions_join_their_poses(mirrors: bool) -> None:
    """With any pivot the ends are the poses; the pivot moves in a straight line; |stretch| is linear."""
    rng = np.random.default_rng(2)
    start, end, pivot = poses(rng, mirrors), poses(rng, mirrors), poses(rng)
    motion = Motion.between(start, end, pivot)
    np.testing.assert_allclose(motion.at(0), start, atol=1e-9)
    np.testing.assert_allclose(motion.at(1), end, atol=1e-9)
    origin = np.linalg.solve(pivot[..., :3], -pivot[..., 3:])
    stretches = []
    for s in TIMES:
        matrix = motion.at(float(s))
        path = (matrix[..., :3] @ origin)[..., 0] + matrix[..., 3]
        linear = matrix[..., :3] @ np.linalg.inv(pivot[..., :3])
        values, axes = np.linalg.eigh(np.swapaxes(linear, 1, 2) @ linear)
        stretches.append((axes * np.sqrt(values)[:, None]) @ np.swapaxes(axes, 1, 2))
        ends = [(each[..., :3] @ origin)[..., 0] + each[..., 3] for each in (start, end)]
        np.testing.assert_allclose(path, (1 - s) * ends[0] + s * ends[1], atol=1e-7)
    for s, stretch in zip(TIMES, stretches):
        np.testing.assert_allclose(stretch, (1 - s) * stretches[0] + s * stretches[-1], atol=1e-8)


def test_rigid_motions_stay_rigid_and_turn_evenly() -> None:
    """Nothing shrinks on the way, and equal steps of time are equal rotations, about one axis, by at most half a turn
    in all."""
    rng = np.random.default_rng(3)
    start, end = rotations(rng), rotations(rng)
    turns = Turns.between(start, end)
    path = np.array([turns.at(float(s)) for s in TIMES])
    np.testing.assert_allclose(path @ np.swapaxes(path, -1, -2), np.broadcast_to(np.eye(3), path.shape), atol=1e-12)
    steps = path[1:] @ np.swapaxes(path[:-1], -1, -2)
    np.testing.assert_allclose(steps, np.broadcast_to(steps[:1], steps.shape), atol=1e-12)
    angle = np.arccos((np.trace(steps[0], axis1=1, axis2=2) - 1) / 2) * len(steps)
    np.testing.assert_allclose(angle, 2 * turns.angle, atol=1e-6)
    assert (angle <= np.pi + 1e-6).all()
    exact = axis_rotation((1.0, 2.0, -1.0), 30.0)[:3, :3]
    third = axis_rotation((1.0, 2.0, -1.0), 10.0)[:3, :3]
    np.testing.assert_allclose(Turns.between(np.eye(3)[None], exact[None]).at(1 / 3)[0], third, atol=1e-14)


def test_quaternions_are_those_of_their_rotations() -> None:
    """Also of half turns, and of none."""
    rng = np.random.default_rng(4)
    turns = np.array([*rotations(rng), np.eye(3), *(np.diag(d) for d in ((1, -1, -1), (-1, 1, -1), (-1, -1, 1)))])
    back = np.array([quaternion(*each)[:3, :3] for each in quaternions(turns)])
    np.testing.assert_allclose(back, turns, atol=1e-12)


@pytest.mark.parametrize("stretched", [False, True])
def test_boxes_contain_all_poses(stretched: bool) -> None:
    """Corners at many times, of boxes far from their pivots too, are inside; those of rigid motions not by much."""
    rng = np.random.default_rng(5)
    start, end = (
        poses(rng) if stretched else np.concatenate([rotations(rng), rng.normal(size=(COUNT, 3, 1))], axis=-1)
        for _ in range(2)
    )
    motion = Motion.between(start, end, poses(rng))
    low = rng.normal(size=(COUNT, 3)) * 10 ** rng.uniform(-2, 2, (COUNT, 1))
    boxes = np.stack([low, low + 10 ** rng.uniform(-2, 1, (COUNT, 3))], axis=1)
    corners = np.array(
        [[box[i, 0], box[j, 1], box[k, 2]] for box in boxes for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    )
    corners = corners.reshape(COUNT, 8, 3)
    found_low, found_high = motion.boxes(boxes)
    path = np.array(
        [
            np.einsum("kij,kcj->kci", m[..., :3], corners) + m[:, None, :, 3]
            for m in map(motion.at, np.linspace(0, 1, 999))
        ]
    )
    least, most = path.min(axis=(0, 2)), path.max(axis=(0, 2))
    assert (found_low <= least).all() and (found_high >= most).all()
    longest = (most - least).max(axis=1)
    assert stretched or ((found_high - found_low - (most - least)).max(axis=1) < 0.1 * longest).all()


@pytest.mark.parametrize("flat", [0, 1, 2])
def test_affine_maps_are_found_from_points(flat: int) -> None:
    """Of a mesh in a plane or on a line a rigid map is found up to what it does beside that."""
    rng = np.random.default_rng(6)
    for _ in range(20):
        points = rng.normal(size=(50, 3)) * ([1.0] * (3 - flat) + [0.0] * flat) @ rotations(rng)[0].T
        turn = rotations(rng)[0]
        matrix = np.column_stack([turn, rng.normal(size=3)])
        after = points @ matrix[:, :3].T + matrix[:, 3]
        found = affine_between(points, after)
        np.testing.assert_allclose(points @ found[:, :3].T + found[:, 3], after, atol=1e-12)
        np.testing.assert_allclose(found[:, :3] @ found[:, :3].T, np.eye(3), atol=1e-9)
        assert np.linalg.det(found[:, :3]) > 0
        if flat < 2:
            np.testing.assert_allclose(found, matrix, atol=1e-9)


def test_scenes_between_two_poses(caplog: pytest.LogCaptureFixture) -> None:
    """Meshes that rest stay meshes, those that move become instances, with a common pivot if they move alike; one that
    deforms rests, with a warning."""
    vertices, faces = icosphere(1)
    rest, bent = Mesh(vertices, faces, name="rest"), Mesh(vertices + np.float32(5), faces, name="bent")
    pair = [Mesh(vertices + np.array([x, 0, 0], np.float32), faces, name=f"part {x}") for x in (2, 6)]
    turn = axis_rotation((0.0, 0.0, 1.0), 20.0)[:3, :3]
    after = [Mesh((each.vertices @ turn.T + [0, 1, 0]).astype(np.float32), faces, name=each.name) for each in pair]
    bends = Mesh((bent.vertices + 0.1 * np.sin(bent.vertices[:, ::-1])).astype(np.float32), faces, name="bent")
    copy, moved = Instance(rest, np.eye(3, 4)), Instance(rest, np.eye(3, 4) * 2)
    one = Scene(meshes=[rest, *pair, bent], instances=[copy], name="one of two poses")
    other = Scene(meshes=[rest, *after, bends], instances=[moved], camera=Camera(position=(1, 0, 5), look_at=(1, 0, 0)))
    found = moving_between(one, other)
    assert found.meshes == [rest, bent] and "1 meshes deform" in caplog.text
    assert found.camera.at_end == other.camera and found.camera.position == one.camera.position
    still, *parts = found.instances
    assert still.to_world_end is moved.to_world and [part.mesh for part in parts] == pair
    for part, then in zip(parts, after):
        end, pivot = part.to_world_end, part.pivot
        assert end is not None and pivot is not None
        np.testing.assert_allclose(part.mesh.vertices @ end[:, :3].T + end[:, 3], then.vertices, atol=1e-5)
        np.testing.assert_allclose(pivot, np.column_stack([np.eye(3), [-4, 0, 0]]), atol=1e-6)


def test_cameras_at_a_time() -> None:
    """The ends are the camera and its end; halfway the position is in the middle, and the view turned by half."""
    camera = Camera(position=(0, 0, 4), look_at=(0, 0, 0), shutter=(0, 1))
    end = Camera(position=(2, 0, 4), look_at=(6, 0, 4), fov_degrees=20)
    moving = camera.moving_to(end)
    assert moving.moves and not camera.moves and not Camera(end=moving.end).moves
    for s, wanted in ((0.0, camera), (1.0, end)):
        at = camera_at(moving, s)
        np.testing.assert_allclose(at.world_to_camera, wanted.world_to_camera, atol=1e-12)
        assert at.fov_degrees == pytest.approx(wanted.fov_degrees) and at.end is None
    middle = camera_at(moving, 0.5)
    ahead = np.subtract(middle.look_at, middle.position)
    np.testing.assert_allclose(middle.position, (1, 0, 4))
    np.testing.assert_allclose(ahead / np.linalg.norm(ahead), np.array([1, 0, -1]) / np.sqrt(2), atol=1e-12)


def test_rows_are_exposed_one_after_the_other() -> None:
    """Without a rolling shutter all at the middle; with one alone from 0 on."""
    np.testing.assert_allclose(middle_of_rows(Camera(shutter=(1, 3)), 4), 0.5)
    np.testing.assert_allclose(middle_of_rows(Camera(rolling_shutter=2), 4), [0, 0.25, 0.5, 0.75])
    np.testing.assert_allclose(middle_of_rows(Camera(shutter=(0, 1), rolling_shutter=1), 4), [0.25, 0.375, 0.5, 0.625])
