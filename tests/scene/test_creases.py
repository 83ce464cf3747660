from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clrt.errors import SceneError
from clrt.formats.load_scene import load
from clrt.scene.geometry.creases import MOST_AROUND, creased
from clrt.scene.geometry.normals import smooth_normals
from clrt.scene.model import Mesh

from .shapes import cube, icosphere

EPS = float(np.finfo(np.float32).eps)


@pytest.mark.parametrize(("degrees", "sharp"), [(0, True), (89.9, True), (90.1, False), (180, False)])
def test_the_edges_of_a_cube_are_sharp_up_to_a_right_angle(degrees: float, sharp: bool) -> None:
    """Normals are those of each face, or the mean of the three faces at each corner."""
    mesh = creased(Mesh(*cube()), degrees)
    corners = mesh.vertices[mesh.faces]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    expected = np.repeat(flat, 3, axis=0) if sharp else mesh.vertices / 3**0.5
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.normals, expected, atol=8 * EPS)


def test_a_ball_without_creases_is_smooth_and_keeps_what_is_at_its_vertices() -> None:
    vertices, faces = icosphere(2)
    uv = np.random.default_rng(1).random((len(vertices), 2), np.float32)
    mesh = creased(Mesh(vertices, faces, uv=uv), 180)
    assert mesh.normals is not None and mesh.uv is not None
    np.testing.assert_allclose(mesh.normals, smooth_normals(vertices, faces)[faces.ravel()], atol=8 * EPS)
    np.testing.assert_array_equal(mesh.uv[mesh.faces], uv[faces])
    np.testing.assert_array_equal(mesh.vertices[mesh.faces], vertices[faces])


def test_points_of_many_triangles_take_no_time_of_their_square() -> None:
    """A fan of 100 000 triangles, with 10¹⁰ pairs: its centre is smooth for any crease angle."""
    count = 100_000
    turn = np.linspace(0, 2 * np.pi, count, endpoint=False)
    rim = np.stack([np.cos(turn), np.full(count, -0.5), np.sin(turn)], axis=1)
    vertices = np.concatenate([[[0, 0, 0]], rim]).astype(np.float32)
    around = np.arange(count) + 1
    faces = np.stack([np.zeros(count), np.roll(around, -1), around], axis=1).astype(np.int32)
    assert count > MOST_AROUND
    mesh = creased(Mesh(vertices, faces), 1)
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.normals[::3], np.tile([0, 1, 0], (count, 1)), atol=1e-3)


def test_scene_files_say_creases(tmp_path: Path) -> None:
    text = (
        "[[mesh]]\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]\nfaces = [[0, 1, 2], [0, 2, 3]]\n"
        "crease_degrees = 30\n"
    )
    scene = tmp_path / "a.toml"
    scene.write_text(text + 'normals = "smooth"')
    normals = load(scene).meshes[0].normals
    assert normals is not None
    np.testing.assert_allclose(normals, [[0, 0, 1]] * 3 + [[1, 0, 0]] * 3, atol=EPS)
    scene.write_text(text)
    with pytest.raises(SceneError, match='crease_degrees, but normals = "file"; write normals = "smooth"'):
        load(scene)
