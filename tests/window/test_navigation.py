"""Camera movements, checked by geometry, independently of their implementation."""

from __future__ import annotations

from math import pi, radians

import numpy as np
import pytest

from clrt.scene.model import Camera
from clrt.window.navigation import approached, around, distance, orbited, shifted, turned, walked

#: None of its axes is parallel to a world axis.
CAMERA = Camera(position=(3, 2, 5), look_at=(1, 0.5, -1), up=(0.1, 1, -0.2), fov_degrees=30)


def close(camera: Camera, other: Camera) -> None:
    assert camera.position == pytest.approx(other.position, abs=1e-9)
    assert camera.look_at == pytest.approx(other.look_at, abs=1e-9)


def test_walks_are_along_the_axes() -> None:
    ahead = np.subtract(CAMERA.look_at, CAMERA.position)
    close(
        walked(CAMERA, 0, 0, 0.5 * distance(CAMERA)),
        Camera(position=(2, 1.25, 2), look_at=tuple(np.add(CAMERA.look_at, ahead / 2).tolist())),
    )
    right = np.subtract(walked(CAMERA, 2, 0, 0).position, CAMERA.position)
    assert np.linalg.norm(right) == pytest.approx(2) and abs(right @ ahead) < 1e-9 and abs(right @ CAMERA.up) < 1e-9
    assert np.cross(ahead, CAMERA.up) @ right > 0
    up = np.subtract(walked(CAMERA, 0, 3, 0).position, CAMERA.position)
    assert up == pytest.approx(3 * np.array(CAMERA.up) / np.linalg.norm(CAMERA.up))


@pytest.mark.parametrize("swing, fixed", [(turned, "position"), (orbited, "look_at")])
def test_turns(swing: object, fixed: str) -> None:
    """A rotation keeps one end and the distance; back and forth or full circle, it ends where it began."""
    assert callable(swing)
    moved = swing(CAMERA, 0.4, 0.2)
    assert getattr(moved, fixed) == getattr(CAMERA, fixed) and distance(moved) == pytest.approx(distance(CAMERA))
    assert moved != CAMERA
    close(swing(swing(CAMERA, 0, 0.2), 0, -0.2), CAMERA)
    close(swing(CAMERA, 2 * pi, 0), CAMERA)
    for down in (-9, 9):
        steep = swing(CAMERA, 0, down)
        ahead = np.subtract(steep.look_at, steep.position) / distance(steep)
        cosine = ahead @ CAMERA.up / np.linalg.norm(CAMERA.up)
        assert abs(cosine) == pytest.approx(np.cos(radians(1))), "it stops before it looks straight up or down"
        swing(steep, 0.3, 0)


def test_which_way() -> None:
    """From (0, 0, 5) toward the origin: right is +x, down is −y; orbiting follows the hand."""
    camera = Camera()
    assert turned(camera, 0.1, 0.1).look_at[0] > 0 > turned(camera, 0.1, 0.1).look_at[1]
    assert orbited(camera, 0.1, 0.1).position[0] < 0 < orbited(camera, 0.1, 0.1).position[1]
    assert shifted(camera, 0.1, -0.2).look_at == pytest.approx((0.5, -1, 0))
    assert approached(camera, 0.5).position == (0, 0, 2.5)
    drawn = Camera(projection="orthographic", view_height=3)
    assert approached(drawn, 0.5).view_height == 1.5 and approached(drawn, 0.5).position == drawn.position


def test_circles() -> None:
    """A point moves around the vertical axis through the camera's target, counter-clockwise seen from above."""
    camera = Camera(look_at=(1, 0, 0))
    assert around((3, 2, 0), camera, pi / 2) == pytest.approx((1, 2, -2))
    assert around((3, 2, 0), camera, pi) == pytest.approx((-1, 2, 0))
