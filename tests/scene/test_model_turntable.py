"""Turntables of bare models: every vertex stays in the image, which what the model sweeps fills."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from clrt.formats.load_scene import load
from clrt.formats.trimesh_models import scene_of
from clrt.output.scenes import save_scene
from clrt.scene.animation import Turns
from clrt.scene.camera_path import frames, turntable
from clrt.scene.frame_model import FILL, frame
from clrt.scene.geometry.transform import unit
from clrt.scene.lights import DirectionalLight
from clrt.scene.model import Scene

from ..covering import covering

Doubles = NDArray[np.float64]
SIZES = [(64, 64), (120, 90), (90, 120), (400, 60), (60, 400)]
LONG = np.array(list(itertools.product((-0.2, 0.2), (-0.2, 0.2), (-1.5, 1.5))))


def random_points(seed: int) -> Doubles:
    """Return corners of triangles, (3n, 3): of a box or scattered, of any proportions, away from the origin."""
    rng = np.random.default_rng(seed)
    box = np.array(list(itertools.product((-1, 1), repeat=3)))[[*range(8), 0]]
    points = box if seed % 2 else rng.normal(size=(3 * rng.integers(2, 30), 3))
    size = 10 ** rng.uniform(-1, 1, 3)
    return np.asarray(10 ** rng.uniform(-3, 3) * size * (points + rng.uniform(-20, 20, 3)))


def model(folder: Path, points: Doubles) -> Path:
    """Write an OBJ of triangles."""
    path = folder / "model.obj"
    faces = np.arange(len(points) // 3 * 3).reshape(-1, 3) + 1
    rows = [*(("v", *row) for row in points.tolist()), *(("f", *row) for row in faces.tolist())]
    path.write_text("".join(" ".join(map(str, row)) + "\n" for row in rows))
    return path


def seen(scene: Scene, still: Scene) -> Doubles:
    """Return where a frame's camera sees the vertices, (n, 2), from -1 to 1 in the image; they lie in front of it."""
    vertices = np.concatenate([mesh.vertices[np.unique(mesh.faces)] for mesh in scene.meshes]).astype(np.float64)
    pose, size = still.camera.world_to_camera, scene.render.size
    assert (vertices @ pose[2, :3] + pose[2, 3] > 0).all()
    return 2 * still.camera.project(vertices, size) / size - 1


@pytest.mark.parametrize("turns", ["camera", "object"])
@pytest.mark.parametrize("seed", range(20))
def test_a_model_stays_in_the_image_and_fills_it(seed: int, turns: Turns, tmp_path: Path) -> None:
    scene = load(model(tmp_path, random_points(seed)), size=SIZES[seed % 5])
    count = int(np.random.default_rng(seed).integers(6, 20))
    extents = np.array([seen(scene, still) for _, still in frames(turntable(scene, count, turns=turns))])
    assert np.abs(extents).max() < 1
    assert (np.ptp(extents, axis=1) / 2).max() > 0.6


@covering("seed, view", range(10), [None, "back", "left"])
def test_the_camera_is_the_nearest(seed: int, view: str | None, tmp_path: Path) -> None:
    """In a whole turn the outermost vertex reaches FILL of half the image, and the margins are equal."""
    scene = load(model(tmp_path, random_points(seed)), view, size=SIZES[seed % 5])
    extents = np.concatenate([seen(scene, still) for _, still in frames(turntable(scene, 180))])
    assert np.abs(extents).max() == pytest.approx(FILL, rel=1e-3)
    np.testing.assert_allclose(extents.min(axis=0), -extents.max(axis=0), atol=1e-3)


def test_the_axis_is_vertical_through_the_center_of_the_bounding_box(tmp_path: Path) -> None:
    """Seen from the direction of the still, whose camera stays as it was, and with its lights."""
    points = LONG + (7, 8, 9)
    scene = load(model(tmp_path, points), size=(120, 90))
    assert scene.camera == frame(scene.meshes, aspect=120 / 90)
    around = turntable(scene, 8)
    assert around.lights == scene.lights and around.environment == scene.environment
    start = around.camera
    back, first = (np.subtract(each.position, each.look_at) for each in (start, scene.camera))
    np.testing.assert_allclose(unit(back), unit(first), rtol=1e-6)
    positions = np.array([still.camera.position for _, still in frames(around)])
    np.testing.assert_allclose(positions.mean(axis=0)[[0, 2]], (7, 9), rtol=1e-9)
    np.testing.assert_allclose(np.array(start.look_at)[[0, 2]], (7, 9), rtol=1e-6)
    np.testing.assert_allclose(positions[:, 1], start.position[1], rtol=1e-12)


def test_a_mesh_of_trimesh_is_a_bare_model(tmp_path: Path) -> None:
    points = LONG[[*range(8), 0]] + (7, 8, 9)
    mesh = trimesh.Trimesh(points, np.arange(9).reshape(3, 3), process=False)
    found, expected = scene_of(mesh, load), load(model(tmp_path, points))
    found, expected = turntable(found, 3), turntable(expected, 3)
    np.testing.assert_allclose(found.camera.position, expected.camera.position, rtol=1e-6)
    np.testing.assert_allclose(found.camera.look_at, expected.camera.look_at, rtol=1e-6)


def test_frames_of_fewer_are_those_of_many(tmp_path: Path) -> None:
    """A turntable of 4 frames shows every twelfth of 48."""
    scene = load(model(tmp_path, LONG))
    few, many = (dict(frames(turntable(scene, count))) for count in (4, 48))
    for number, still in few.items():
        np.testing.assert_allclose(still.camera.position, many[12 * number].camera.position, atol=1e-12)


def test_lights_of_a_turning_object_keep_their_place_to_the_camera(tmp_path: Path) -> None:
    scene = load(model(tmp_path, LONG + (7, 8, 9)), look="sky")
    for _, still in frames(turntable(scene, 5, turns="object")):
        (sun,), (first,) = still.lights, scene.lights
        assert isinstance(sun, DirectionalLight) and isinstance(first, DirectionalLight)
        turned = still.camera.world_to_camera[:3, :3] @ unit(np.array(sun.direction))
        start = scene.camera.world_to_camera[:3, :3] @ unit(np.array(first.direction))
        np.testing.assert_allclose(turned, start, atol=1e-6)


@pytest.mark.parametrize("change", [{"position": (1.0, 2.0, 9.0)}, {"look_at": (0.0, 0.5, 0.0)}, {"fov_degrees": 20.0}])
def test_a_camera_of_ones_own_goes_around_its_look_at(change: dict[str, Any], tmp_path: Path) -> None:
    scene = load(model(tmp_path, LONG))
    scene.camera = replace(scene.camera, **change)
    assert turntable(scene, 4).camera == scene.camera


def test_a_saved_turntable_is_the_same(tmp_path: Path) -> None:
    """The scene file holds the camera of the turntable, which a scene file's goes around look_at."""
    around = turntable(load(model(tmp_path, LONG)), 5)
    save_scene(around, tmp_path / "saved.toml")
    saved = load(tmp_path / "saved.toml")
    assert saved.source is not None and saved.source.framing is None
    for (_, still), (_, again) in zip(frames(around), frames(saved), strict=True):
        assert still.camera == again.camera
    assert turntable(saved, 5).camera == saved.camera
