"""How a camera moves: from one camera to the next, in the scene's units and radians.

Turns are about the camera's `up` and its own right; they stop before it looks straight up or down.
"""

from __future__ import annotations

from dataclasses import replace
from math import atan2, cos, sin, radians

import numpy as np
from numpy.typing import NDArray

from ..scene.model import Camera, Vector

Doubles = NDArray[np.float64]

#: How near to `up`, or its opposite, a camera may look.
STEEPEST = radians(1)


def walked(camera: Camera, right: float, up: float, forward: float) -> Camera:
    """The camera moved along its own right, the scene's up, and where it looks."""
    ahead, side, top = _axes(camera)
    step = right * side + up * top + forward * ahead
    return replace(camera, position=_vector(camera.position + step), look_at=_vector(camera.look_at + step))


def turned(camera: Camera, right: float, down: float) -> Camera:
    """The camera looking elsewhere from where it stands."""
    return replace(camera, look_at=_vector(camera.position + _swung(camera, right, down)))


def orbited(camera: Camera, right: float, down: float) -> Camera:
    """The camera moved around what it looks at, as if that was turned by hand to the right and down."""
    return replace(camera, position=_vector(camera.look_at - _swung(camera, right, down)))


def shifted(camera: Camera, right: float, up: float) -> Camera:
    """The camera moved in the plane of its picture, by parts of its distance from what it looks at."""
    ahead, side, _ = _axes(camera)
    step = distance(camera) * (right * side + up * np.cross(side, ahead))
    return replace(camera, position=_vector(camera.position + step), look_at=_vector(camera.look_at + step))


def approached(camera: Camera, factor: float) -> Camera:
    """The camera at `factor` times its distance; in an orthographic picture things grow instead."""
    if camera.projection == "orthographic" and camera.view_height is not None:
        return replace(camera, view_height=camera.view_height * factor)
    back = np.subtract(camera.position, camera.look_at)
    return replace(camera, position=_vector(camera.look_at + factor * back))


def around(point: Vector, camera: Camera, turn: float) -> Vector:
    """The point turned about the axis that stands upright in what the camera looks at."""
    up = np.asarray(camera.up) / np.linalg.norm(camera.up)
    away = np.subtract(point, camera.look_at)
    along = (away @ up) * up
    return _vector(camera.look_at + along + cos(turn) * (away - along) + sin(turn) * np.cross(up, away))


def distance(camera: Camera) -> float:
    """From the camera to what it looks at."""
    return float(np.linalg.norm(np.subtract(camera.look_at, camera.position)))


def has_axes(camera: Camera) -> bool:
    """Whether it looks anywhere, and not along its `up`; else it cannot be moved."""
    return bool(np.cross(np.subtract(camera.look_at, camera.position), camera.up).any())


def _axes(camera: Camera) -> tuple[Doubles, Doubles, Doubles]:
    """Unit vectors: where it looks, its right, the scene's up."""
    ahead = np.subtract(camera.look_at, camera.position, dtype=np.float64)
    side, up = np.cross(ahead, camera.up), np.asarray(camera.up, np.float64)
    return ahead / np.linalg.norm(ahead), side / np.linalg.norm(side), up / np.linalg.norm(up)


def _swung(camera: Camera, right: float, down: float) -> Doubles:
    """From the camera to what it looks at, after a turn."""
    ahead, side, up = _axes(camera)
    from_up = atan2(float(np.linalg.norm(np.cross(ahead, up))), float(ahead @ up))
    from_up = min(max(from_up + down, STEEPEST), np.pi - STEEPEST)
    level = np.cross(up, side)
    around = cos(right) * level + sin(right) * side
    return distance(camera) * (cos(from_up) * up + sin(from_up) * around)


def _vector(values: Doubles) -> Vector:
    x, y, z = values.tolist()
    return x, y, z
