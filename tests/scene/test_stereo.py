"""Stereo pairs: disparities by closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import clrt
from clrt.errors import UsageError

SIZE = (640, 360)
LENSES: list[dict[str, Any]] = [
    {},
    {"lens_shift": (0.1, -0.2), "pixel_aspect": 1.3, "skew": 0.05},
    {"distortion": (-0.2, 0.05, 0.001, -0.002)},
    {"projection": "fisheye", "fisheye_degrees": 150.0},
]
MIDDLE: dict[str, Any] = {"position": (1.0, 2.0, 3.0), "look_at": (-1.0, 0.5, -2.0), "up": (0.1, 1.0, 0.2)}


def test_disparity_is_that_of_parallel_cameras() -> None:
    """A point at the depth z lies fx·baseline/z pixels further left in the right image, in the same row."""
    camera = clrt.Camera(**MIDDLE)
    left, right = clrt.stereo_pair(camera, 0.3)
    rng = np.random.default_rng(3)
    seen = np.column_stack([rng.uniform(-1, 1, (50, 2)), rng.uniform(2, 20, 50)])
    pose = camera.world_to_camera
    points = (seen - pose[:3, 3]) @ pose[:3, :3]
    apart = left.project(points, SIZE) - right.project(points, SIZE)
    np.testing.assert_allclose(apart[:, 0], camera.matrix(SIZE)[0, 0] * 0.3 / seen[:, 2], rtol=1e-9)
    np.testing.assert_allclose(apart[:, 1], 0, atol=1e-9)
    np.testing.assert_allclose(np.subtract(right.position, left.position), 0.3 * pose[0, :3])
    np.testing.assert_allclose(np.add(right.position, left.position) / 2, camera.position)


@pytest.mark.parametrize("lens", LENSES)
def test_cameras_converge_without_turning(lens: dict[str, Any]) -> None:
    camera = clrt.Camera(**MIDDLE, **lens)
    left, right = clrt.stereo_pair(camera, 0.3, converge_at=4.0, size=SIZE)
    target = np.add(camera.position, 4.0 * camera.world_to_camera[2, :3])
    for each in (left, right):
        np.testing.assert_allclose(each.project(target, SIZE), camera.project(target, SIZE), atol=1e-9)
        np.testing.assert_allclose(each.world_to_camera[:3, :3], camera.world_to_camera[:3, :3], atol=1e-12)


def test_wrong_pairs() -> None:
    with pytest.raises(UsageError, match="baseline is -1; it must be above 0"):
        clrt.stereo_pair(clrt.Camera(), -1)
    with pytest.raises(UsageError, match="converge_at is 0; it must be above 0"):
        clrt.stereo_pair(clrt.Camera(), 0.1, converge_at=0, size=SIZE)
    with pytest.raises(UsageError, match="has no matrix"):
        clrt.stereo_pair(clrt.Camera(projection="equirectangular"), 0.1, converge_at=2, size=SIZE)


def test_a_moving_camera_is_moved_at_both_ends() -> None:
    """The pair at the end of the exposure is that of the camera there."""
    camera = clrt.Camera(shutter=(0, 1), end=clrt.CameraEnd(position=(3, 1, 0), up=(0.1, 1, 0)))
    for moving, end in zip(clrt.stereo_pair(camera, 0.1), clrt.stereo_pair(camera.at_end, 0.1)):
        np.testing.assert_allclose(moving.at_end.world_to_camera, end.world_to_camera, atol=1e-12)
