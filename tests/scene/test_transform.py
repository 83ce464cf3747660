from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from clrt.errors import SceneError
from clrt.scene.geometry.transform import (
    quaternion,
    rotation,
    scaling,
    transform_camera,
    transform_mesh,
    translation,
    unit,
)
from clrt.scene.model import Camera, Mesh

from .shapes import icosphere, volume

EPS = float(np.finfo(np.float32).eps)


@pytest.mark.parametrize("degrees", [(30, 0, 0), (0, 50, 0), (0, 0, -70), (30, 50, -70), (200, -120, 400)])
def test_rotation_is_about_fixed_x_then_y_then_z(degrees: tuple[float, float, float]) -> None:
    expected = Rotation.from_euler("xyz", degrees, degrees=True).as_matrix()
    np.testing.assert_allclose(rotation(degrees)[:3, :3], expected, atol=1e-15)


def test_rotation_turns_counter_clockwise() -> None:
    np.testing.assert_allclose(rotation((0, 90, 0)) @ [0, 0, 1, 1], [1, 0, 0, 1], atol=1e-15)


@pytest.mark.parametrize("q", [(0.1, -0.5, 0.3, 0.8), (2.0, 0.0, 0.0, 0.0), (0.0, 3e-9, 0.0, 4e-9)])
def test_quaternion(q: tuple[float, float, float, float]) -> None:
    np.testing.assert_allclose(quaternion(*q)[:3, :3], Rotation.from_quat(q).as_matrix(), atol=1e-15)


@pytest.mark.parametrize("factors", [(2.0, 0.5, 3.0), (-1.0, 1.0, 1.0), (-2.0, -0.5, -3.0), (1e-12, 2e-12, 1e-12)])
def test_transformed_sphere(factors: tuple[float, float, float]) -> None:
    """Points are transformed by M, normals by M⁻ᵀ (here inverted in float64), and the outside stays outside."""
    vertices, faces = icosphere(2)
    matrix = translation((1, -2, 3)) @ rotation((10, 20, 30)) @ scaling(factors)
    linear = matrix[:3, :3]
    mesh = transform_mesh(Mesh(vertices, faces, normals=vertices), matrix)
    np.testing.assert_allclose(mesh.vertices, vertices @ linear.T + [1, -2, 3], rtol=2 * EPS, atol=2 * EPS)
    expected = vertices @ np.linalg.inv(linear)
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.normals, expected, atol=4 * EPS)
    # Mirrored or not, the faces enclose a positive volume of size |det M|.
    enclosed = volume(vertices @ linear.T, mesh.faces)
    assert enclosed == pytest.approx(abs(np.linalg.det(linear)) * volume(vertices, faces), rel=1e-12)


def test_flattening_keeps_the_normals_across_the_sheet() -> None:
    vertices, faces = icosphere(1)
    mesh = transform_mesh(Mesh(vertices, faces, normals=vertices), scaling((1, 1, 0)))
    assert mesh.normals is not None
    across = abs(vertices[:, 2]) > 0.1
    np.testing.assert_allclose(mesh.normals[across], np.sign(vertices[across, 2:]) * [[0, 0, 1]], atol=EPS)


def test_what_leaves_float32_is_refused() -> None:
    with pytest.raises(SceneError, match=r'mesh "ball": vertices\[0\] = \[.*inf, .* is not finite'):
        transform_mesh(Mesh(*icosphere(0), name="ball"), scaling((1e39, 1, 1)))


def test_a_cameras_lengths_are_scaled() -> None:
    lens = Camera(position=(0, 0, 1), aperture_radius=0.1, focus_distance=2.0)
    turned = transform_camera(lens, rotation((0, 90, 0)) @ scaling((3, 3, 3)))
    assert (turned.aperture_radius, turned.focus_distance, turned.view_height) == pytest.approx((0.3, 6.0, None))
    assert turned.position == pytest.approx((3, 0, 0))
    plan = transform_camera(Camera(projection="orthographic", view_height=4.0), scaling((0.5, 0.5, 0.5)))
    assert (plan.view_height, plan.focus_distance) == (2.0, None)


def test_unit() -> None:
    rows = np.array([[3, 0, 4], [3e-200, 0, 4e-200], [3e200, 0, 4e200], [0, 0, 0], [np.nan, 1, 0], [np.inf, 1, 0]])
    expected = [[0.6, 0, 0.8]] * 3 + [[0, 0, 0]] * 3
    np.testing.assert_allclose(unit(rows), expected, rtol=1e-15)
