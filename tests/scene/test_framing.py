from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from clrt.formats.frame_model import FILL, bounds, frame
from clrt.scene.default_sky import SUN, default_sky
from clrt.scene.model import Mesh

BOXES = {"cube": ((-1, -1, -1), (1, 1, 1)), "tower": ((0, 0, 0), (1, 30, 1)), "plate": ((-5, 0, -5), (5, 0, 5)),
         "wall": ((-5, 0, 0), (5, 3, 0)), "line": ((2, 2, 2), (9, 2, 2)), "tiny": ((0, 0, 0), (1e-20, 2e-20, 1e-20)),
         "huge": ((-1e30, -1e30, -1e30), (1e30, 1e30, 1e30)), "far": ((1e6, 1e6, 1e6), (1e6 + 2, 1e6 + 1, 1e6 + 4))}


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
    """It is blue above, brightest at the horizon, brown below, and uniform in azimuth; the sun is in front and above.
    """
    image = default_sky(32).image
    assert image is not None and image.shape == (32, 64, 3) and image.dtype == np.float32
    assert (image == image[:, :1]).all() and (image > 0).all()
    luminance = image[:, 0] @ np.array([0.2126, 0.7152, 0.0722])
    assert luminance.argmax() in (15, 16)
    assert image[0, 0].argmax() == 2 and image[-1, 0].argmax() == 0
    assert SUN.direction[1] < 0 and SUN.direction[2] < 0
