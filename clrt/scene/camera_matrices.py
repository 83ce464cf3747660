"""Cameras as matrices: intrinsics in pixels and poses, as calibration, COLMAP, NeRF and OpenCV have them."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import UsageError, check_choice
from .fields.number_arrays import real_array

Doubles = NDArray[np.float64]
#: Axes of a camera: OpenCV's are right, down, ahead; OpenGL's right, up, back.
Convention = Literal["opencv", "opengl"]
AXES: dict[Convention, tuple[float, float, float]] = {"opencv": (1.0, 1.0, 1.0), "opengl": (1.0, -1.0, -1.0)}
#: Maximum deviation of a rotation's product with its transpose from the identity.
RIGID = 1e-4


def intrinsics_of(K: ArrayLike, size: tuple[int, int], first_pixel: float, fisheye: bool) -> dict[str, Any]:
    """Return the fields of Camera for an intrinsic matrix (3, 3), see `Camera.from_matrix`. Raises UsageError."""
    matrix = _finite("K", K)
    width, height = size
    if matrix.shape != (3, 3) or (matrix[[1, 2, 2], [0, 0, 1]] != 0).any() or matrix[2, 2] != 1:
        raise UsageError(f"K is {matrix.tolist()}; it must be [[fx, skew, cx], [0, fy, cy], [0, 0, 1]]")
    (fx, skew, cx), (_, fy, cy) = matrix[:2]
    if not (fx > 0 and fy > 0):
        raise UsageError(f"K has the focal lengths {fx:g} and {fy:g}; they must be above 0, with y downwards")
    cx, cy = cx + 0.5 - first_pixel, cy + 0.5 - first_pixel
    half = height / 2 / fy if fisheye else np.arctan(height / 2 / fy)
    return {
        "fisheye_degrees" if fisheye else "fov_degrees": float(np.degrees(2 * half)),
        "lens_shift": (float(0.5 - cx / width), float(cy / height - 0.5)),
        "pixel_aspect": float(fy / fx),
        "skew": float(skew / fx),
    }


def coefficients_of(distortion: ArrayLike, counts: tuple[int, ...]) -> tuple[float, ...]:
    """Return OpenCV's distortion coefficients, a vector, a row or a column; counts: how many it may have. Raises
    UsageError."""
    found = _finite("distortion", distortion).ravel()
    if found.size and found.size not in counts:
        raise UsageError(f"distortion has {found.size} coefficients; it must have {' or '.join(map(str, counts))}")
    return tuple(found.tolist())


def pose_of(
    camera_to_world: ArrayLike | None, world_to_camera: ArrayLike | None, convention: Convention
) -> dict[str, tuple[float, ...]]:
    """Return the fields of Camera for a pose; `look_at` is at a distance of 1. Raises UsageError."""
    check_choice("convention", convention, AXES)
    if camera_to_world is not None and world_to_camera is None:
        matrix = _rigid("camera_to_world", camera_to_world)
        axes, position = matrix[:, :3], matrix[:, 3]
    elif world_to_camera is not None and camera_to_world is None:
        matrix = _rigid("world_to_camera", world_to_camera)
        axes = matrix[:, :3].T
        position = -axes @ matrix[:, 3]
    else:
        raise UsageError("give one pose, camera_to_world or world_to_camera")
    _, down, ahead = (axes * AXES[convention]).T
    place, target, up = (tuple(map(float, each)) for each in (position, position + ahead, -down))
    return {"position": place, "look_at": target, "up": up}


def world_to_camera_of(position: ArrayLike, look_at: ArrayLike, up: ArrayLike) -> Doubles:
    """Return the matrix (4, 4) of a camera in OpenCV's convention."""
    ahead = np.subtract(look_at, position, dtype=np.float64)
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, np.asarray(up, np.float64))
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = right, np.cross(ahead, right), ahead
    matrix[:3, 3] = -matrix[:3, :3] @ np.asarray(position, np.float64)
    return matrix


def _finite(name: str, matrix: ArrayLike) -> Doubles:
    found = np.asarray(real_array(name, matrix), np.float64)
    if not np.isfinite(found).all():
        raise UsageError(f"{name} is {found.tolist()}; its numbers must be finite")
    return found


def _rigid(name: str, pose: ArrayLike) -> Doubles:
    """Return a rigid motion as (3, 4)."""
    matrix = _finite(name, pose)
    if matrix.shape == (4, 4):
        if not np.array_equal(matrix[3], (0, 0, 0, 1)):
            raise UsageError(f"{name} has the last row {matrix[3].tolist()}; it must be 0, 0, 0, 1")
        matrix = matrix[:3]
    if matrix.shape != (3, 4):
        raise UsageError(
            f"{name} has the shape {matrix.shape}; it must be (3, 4), or (4, 4) with the last row 0, 0, 0, 1"
        )
    turn = matrix[:, :3]
    if np.abs(turn @ turn.T - np.eye(3)).max() > RIGID or np.linalg.det(turn) < 0:
        raise UsageError(f"{name} is {matrix.tolist()}; its first three columns must be a rotation, without scaling")
    return matrix
