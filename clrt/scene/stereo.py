"""Stereo pairs of cameras."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..errors import UsageError
from .cameras import Camera, Size
from .fields.keywords import with_known_keywords


@with_known_keywords
def stereo_pair(
    camera: Camera, baseline: float, *, converge_at: float | None = None, size: Size = (1, 1)
) -> tuple[Camera, Camera]:
    """Return the left and the right camera, half a `baseline` to either side of `camera`, with parallel views.

    With parallel views a point at the depth z lies fx·baseline/z pixels further left in the right image. converge_at:
    the distance of the point ahead of the middle that lies at the same place in both images, by shifts of the lenses;
    only then the shape of the images, `size` (width, height), counts. Raises UsageError for values that are not above
    0, or for a convergence of cameras other than perspective and fisheye.
    """
    for name, value in (("baseline", baseline), ("converge_at", 1.0 if converge_at is None else converge_at)):
        if not 0 < value < np.inf:
            raise UsageError(f"{name} is {value}; it must be above 0 and finite")
    left_one, right_one = (_moved(camera, side * baseline / 2) for side in (-1, 1))
    if converge_at is None:
        return left_one, right_one
    target = np.add(camera.position, converge_at * camera.world_to_camera[2, :3])
    middle = camera.project(target, size)
    return _shifted(left_one, target, middle, size), _shifted(right_one, target, middle, size)


def _moved(camera: Camera, distance: float) -> Camera:
    """Return the camera moved to its right, at the end of the exposure, too."""
    step = distance * camera.world_to_camera[0, :3]
    position, look_at = (tuple(np.add(point, step).tolist()) for point in (camera.position, camera.look_at))
    moved = replace(camera, position=position, look_at=look_at, end=None)
    return moved.moving_to(_moved(camera.at_end, distance)) if camera.end else moved


def _shifted(camera: Camera, target: np.ndarray, place: np.ndarray, size: tuple[int, int]) -> Camera:
    """Return the camera with its lens shifted so that it sees the target at a place in pixels."""
    x, y = (camera.project(target, size) - place) / size
    across, along = camera.lens_shift
    return replace(camera, lens_shift=(float(across + x), float(along - y)))
