from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from clrt.errors import SceneError
from clrt.formats.load_scene import load
from clrt.output.scenes import save_scene
from clrt.scene.default_sky import SUN, default_sky
from clrt.scene.frame_model import FILL, bounds, frame
from clrt.scene.geometry.transform import Matrix, rotation, unit
from clrt.scene.lights import DirectionalLight
from clrt.scene.model import Mesh

BOXES = {
    "cube": ((-1, -1, -1), (1, 1, 1)),
    "tower": ((0, 0, 0), (1, 30, 1)),
    "plate": ((-5, 0, -5), (5, 0, 5)),
    "wall": ((-5, 0, 0), (5, 3, 0)),
    "line": ((2, 2, 2), (9, 2, 2)),
    "tiny": ((0, 0, 0), (1e-20, 2e-20, 1e-20)),
    "huge": ((-1e30, -1e30, -1e30), (1e30, 1e30, 1e30)),
    "far": ((1e6, 1e6, 1e6), (1e6 + 2, 1e6 + 1, 1e6 + 4)),
}


def box_mesh(low: tuple[float, ...], high: tuple[float, ...]) -> Mesh:
    corners = np.array(list(itertools.product(*zip(low, high))), np.float32)
    return Mesh(corners, np.arange(9, dtype=np.int32).reshape(3, 3) % 8)


@pytest.mark.parametrize("name", BOXES)
def test_box_fills_the_picture_and_stays_inside(name: str) -> None:
    """With a pinhole projection, the outermost corner lies at FILL of half the image."""
    mesh = box_mesh(*BOXES[name])
    camera = frame([mesh])
    position, up = np.array(camera.position), np.array(camera.up)
    forward = np.array(camera.look_at) - position
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    toward = mesh.vertices.astype(np.float64) - position
    depth = toward @ forward
    assert (depth > 0).all()
    half = math.tan(math.radians(camera.fov_degrees) / 2)
    extent = np.abs([toward @ right / depth, toward @ np.cross(right, forward) / depth]).max() / half
    assert extent == pytest.approx(FILL, rel=1e-6)
    assert forward[1] < 0 and forward[2] < 0 and forward[0] < 0  # from above, in front and the right


def test_a_single_point_still_has_a_view() -> None:
    camera = frame([box_mesh((1, 1, 1), (1, 1, 1))])
    assert camera.position != camera.look_at == (1, 1, 1)


def test_vertices_without_a_face_do_not_count() -> None:
    mesh = box_mesh((-1, -1, -1), (1, 1, 1))
    mesh.vertices = np.vstack([mesh.vertices, np.array([[1e9, 0, 0]], np.float32)])
    low, high = bounds([mesh, box_mesh((0, 0, 0), (1, 5, 1))])
    assert low.tolist() == [-1, -1, -1] and high.tolist() == [1, 5, 1]


def test_sky() -> None:
    """It is blue above, brightest at the horizon, brown below, and uniform in azimuth; the sun is in front and
    above."""
    image = default_sky(32).image
    assert image is not None and image.shape == (32, 64, 3) and image.dtype == np.float32
    assert (image == image[:, :1]).all() and (image > 0).all()
    luminance = image[:, 0] @ np.array([0.2126, 0.7152, 0.0722])
    assert luminance.argmax() in (15, 16)
    assert image[0, 0].argmax() == 2 and image[-1, 0].argmax() == 0
    assert SUN.direction[1] < 0 and SUN.direction[2] < 0


def wedge(path: Path, turn: Matrix) -> Path:
    """Write a shape without symmetries, transformed by `turn`, as OBJ or STL."""
    corners = [(0.0, 0.0, 0.0), (3.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 1.0)]
    points = np.array(corners) @ turn[:3, :3].T
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    if path.suffix == ".obj":
        lines = [
            *(f"v {x} {y} {z}" for x, y, z in points.tolist()),
            *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces),
        ]
    else:
        vertex = ["vertex {} {} {}".format(*point) for point in points.tolist()]
        lines = [
            "solid wedge",
            *(
                f"facet normal 0 0 0\nouter loop\n{vertex[a]}\n{vertex[b]}\n{vertex[c]}\nendloop\nendfacet"
                for a, b, c in faces
            ),
            "endsolid",
        ]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize("view, degrees", [("front", 0), ("right", 90), ("back", 180), ("left", 270)])
def test_a_named_view_shows_the_model_as_if_it_were_turned(view: str, degrees: float, tmp_path: Path) -> None:
    """Camera and sun are turned together, so the view equals the default one of a model turned the other way."""
    turn = rotation((0.0, degrees, 0.0))
    seen = load(wedge(tmp_path / "a.obj", np.eye(4)), view, look="sky")
    turned = load(wedge(tmp_path / "b.obj", turn.T), look="sky")
    for own, other in [(seen.camera.position, turned.camera.position), (seen.camera.look_at, turned.camera.look_at)]:
        np.testing.assert_allclose(own, turn[:3, :3] @ other, atol=1e-6)
    (sun,) = seen.lights
    assert isinstance(sun, DirectionalLight) and sun.irradiance == SUN.irradiance
    np.testing.assert_allclose(unit(np.array(sun.direction)), turn[:3, :3] @ unit(np.array(SUN.direction)), atol=1e-12)


def test_an_unknown_view_is_answered_by_the_names(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match='a.obj: --camera: "top" is unknown; write one of back, front, left, right'):
        load(wedge(tmp_path / "a.obj", np.eye(4)), "top")


def test_stl_stands_upright(tmp_path: Path) -> None:
    """CAD's +Z is up and −Y in front; in a scene file meshes keep their coordinates, and a converted one turns them."""
    stl = wedge(tmp_path / "a.stl", np.eye(4))
    corners = load(stl).meshes[0].vertices.tolist()
    assert np.unique(np.round(corners, 6) + 0.0, axis=0).tolist() == [[0, 0, -2], [0, 0, 0], [0, 1, 0], [3, 0, 0]]
    scene = tmp_path / "a.toml"
    scene.write_text('[[mesh]]\nfile = "a.stl"\n')
    assert load(scene).meshes[0].vertices[:, 2].max() == 1
    save_scene(load(stl), scene)
    assert load(scene).meshes[0].vertices.tolist() == corners and load(scene).camera == load(stl).camera
