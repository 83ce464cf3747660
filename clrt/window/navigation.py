"""Camera motion: functions from one camera to the next, in the scene's units and radians.

Rotations are about the camera's `up` and its own right; they stop short of looking straight up or down.
"""

from __future__ import annotations

from dataclasses import replace
from math import atan2, cos, radians, sin

import numpy as np
from numpy.typing import NDArray

from ..scene.model import Camera, Vector

Doubles = NDArray[np.float64]

#: Smallest angle between the view direction and `up` or its opposite.
STEEPEST = radians(1)


def walked(camera: Camera, right: float, up: float, forward: float) -> Camera:
    """Translate the camera along its own right, the scene's up, and its view direction."""
    ahead, side, top = _axes(camera)
    step = right * side + up * top + forward * ahead
    return replace(camera, position=_vector(camera.position + step), look_at=_vector(camera.look_at + step))


def turned(camera: Camera, right: float, down: float) -> Camera:
    """Rotate the view direction about the camera's position."""
    return replace(camera, look_at=_vector(camera.position + _swung(camera, right, down)))


def orbited(camera: Camera, right: float, down: float) -> Camera:
    """Rotate the camera about its look_at point, as if the object were turned by hand to the right and down."""
    return replace(camera, position=_vector(camera.look_at - _swung(camera, right, down)))


def shifted(camera: Camera, right: float, up: float) -> Camera:
    """Translate the camera in the image plane, by fractions of its distance from the look_at point."""
    ahead, side, _ = _axes(camera)
    step = distance(camera) * (right * side + up * np.cross(side, ahead))
    return replace(camera, position=_vector(camera.position + step), look_at=_vector(camera.look_at + step))


def approached(camera: Camera, factor: float) -> Camera:
    """Scale the camera's distance from look_at by `factor`; for an orthographic camera, scale view_height instead."""
    if camera.projection == "orthographic" and camera.view_height is not None:
        return replace(camera, view_height=camera.view_height * factor)
    back = np.subtract(camera.position, camera.look_at)
    return replace(camera, position=_vector(camera.look_at + factor * back))


def around(point: Vector, camera: Camera, turn: float) -> Vector:
    """Rotate a point about the vertical axis through the camera's look_at point."""
    up = np.asarray(camera.up) / np.linalg.norm(camera.up)
    away = np.subtract(point, camera.look_at)
    along = (away @ up) * up
    return _vector(camera.look_at + along + cos(turn) * (away - along) + sin(turn) * np.cross(up, away))


def distance(camera: Camera) -> float:
    """Return the distance from the camera to its look_at point."""
    return float(np.linalg.norm(np.subtract(camera.look_at, camera.position)))


def has_axes(camera: Camera) -> bool:
    """Return whether the camera has a view direction that is not parallel to `up`; otherwise it cannot be moved."""
    return bool(np.cross(np.subtract(camera.look_at, camera.position), camera.up).any())


def _axes(camera: Camera) -> tuple[Doubles, Doubles, Doubles]:
    """Return unit vectors: the view direction, its right, the scene's up."""
    ahead = np.subtract(camera.look_at, camera.position, dtype=np.float64)
    side, up = np.cross(ahead, camera.up), np.asarray(camera.up, np.float64)
    return ahead / np.linalg.norm(ahead), side / np.linalg.norm(side), up / np.linalg.norm(up)


def _swung(camera: Camera, right: float, down: float) -> Doubles:
    """Return the vector from the camera to its look_at point after a rotation."""
    ahead, side, up = _axes(camera)
    from_up = atan2(float(np.linalg.norm(np.cross(ahead, up))), float(ahead @ up))
    from_up = min(max(from_up + down, STEEPEST), np.pi - STEEPEST)
    level = np.cross(up, side)
    around = cos(right) * level + sin(right) * side
    return distance(camera) * (cos(from_up) * up + sin(from_up) * around)


def _vector(values: Doubles) -> Vector:
    x, y, z = values.tolist()
    return x, y, z
