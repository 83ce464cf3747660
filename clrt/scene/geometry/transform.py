"""4x4 float64 matrices that act on column vectors: p' = M p. `A @ B` applies B first."""

from __future__ import annotations

from dataclasses import replace
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..lights import Light
from ..model import Camera, Mesh, Vector

Matrix = NDArray[np.float64]


def translation(offset: Vector) -> Matrix:
    """Return the translation by `offset`."""
    matrix = np.eye(4)
    matrix[:3, 3] = offset
    return matrix


def scaling(factors: Vector) -> Matrix:
    """Return the scaling of each axis by its factor; negative factors mirror."""
    return np.diag([*factors, 1.0])


def rotation(degrees: Vector) -> Matrix:
    """Return the rotation about the fixed x axis, then the fixed y axis, then the fixed z axis: Rz Ry Rx.

    Positive angles are counter-clockwise looking against the axis.
    """
    matrix = np.eye(4)
    for axis, angle in enumerate(np.radians(degrees)):
        turn = np.eye(4)
        first, second = (axis + 1) % 3, (axis + 2) % 3
        turn[[first, second], [first, second]] = np.cos(angle)
        turn[second, first] = np.sin(angle)
        turn[first, second] = -np.sin(angle)
        matrix = turn @ matrix
    return matrix


def axis_rotation(axis: Vector, degrees: float) -> Matrix:
    """Return the rotation about `axis`, of any length but zero, counter-clockwise looking against it (Rodrigues)."""
    x, y, z = unit(np.array(axis)).tolist()
    angle = np.radians(degrees)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    matrix = np.eye(4)
    matrix[:3, :3] += np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return matrix


def looking_at(origin: Vector, target: Vector, up: Vector) -> Matrix:
    """Return the matrix from axes +z to `target`, +y up and +x along up × z to the world. Raises ValueError if there is
    none."""
    place = np.array(origin)
    forward = unit(np.array(target) - place)
    side = unit(np.cross(up, forward))
    if not (forward.any() and side.any()):
        raise ValueError("up")
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([side, np.cross(forward, side), forward, place])
    return matrix


def quaternion(x: float, y: float, z: float, w: float) -> Matrix:
    """Return the rotation of a quaternion (x, y, z, w) of any length but zero."""
    x, y, z, w = np.array([x, y, z, w]) / np.linalg.norm([x, y, z, w])
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return matrix


def transform_mesh(mesh: Mesh, matrix: Matrix) -> Mesh:
    """Return the mesh transformed by an affine `matrix`; computed in float64, stored in float32.

    Normals are transformed by the inverse transpose (its cofactors, which singular matrices have, too). A mirroring
    matrix would turn the surface inside out, so the faces' winding is reversed. Raises SceneError for values beyond
    float32's range.
    """
    if np.array_equal(matrix, np.eye(4)):
        return mesh
    linear = matrix[:3, :3]
    mirrored = np.linalg.det(linear) < 0
    with np.errstate(over="ignore", invalid="ignore"):
        vertices = (mesh.vertices @ linear.T + matrix[:3, 3]).astype(np.float32)
    normals = mesh.normals
    if normals is not None:
        cofactors = np.cross(linear[[1, 2, 0]], linear[[2, 0, 1]]) * (-1 if mirrored else 1)
        turned = unit(normals @ cofactors.T).astype(np.float32)
        normals = np.where(turned.any(axis=1, keepdims=True), turned, normals)  # a flat rim has none
    tangents = mesh.tangents
    if tangents is not None:
        along = unit(tangents[:, :3] @ linear.T)
        tangents = np.column_stack([along, -tangents[:, 3] if mirrored else tangents[:, 3]]).astype(np.float32)
    faces = np.ascontiguousarray(mesh.faces[:, ::-1]) if mirrored else mesh.faces
    return replace(mesh, vertices=vertices, faces=faces, normals=normals, tangents=tangents)


def transform_camera(camera: Camera, matrix: Matrix) -> Camera:
    """Return the camera under an affine `matrix`; its angle is kept, and its lengths scale like `up`."""
    corners = np.array([[*camera.position, 1], [*camera.look_at, 1], [*camera.up, 0]]) @ matrix.T
    position, look_at, up = corners[:, :3].tolist()
    stretch = float(np.linalg.norm(up) / np.linalg.norm(camera.up))
    moved = replace(camera.scaled(stretch), position=position, look_at=look_at, up=up, end=None)
    return moved.moving_to(transform_camera(camera.at_end, matrix)) if camera.end else moved


def transform_light(light: Light, matrix: Matrix) -> Light:
    """Return the light under an affine `matrix`, moved, rotated and its image mirrored; its size, strength and range
    are kept, as in glTF."""
    changed: dict[str, Any] = {}
    mirrors = np.linalg.det(matrix[:3, :3]) < 0
    for name, value in vars(light).items():
        if name == "position":
            changed[name] = tuple((matrix[:3] @ [*value, 1.0]).tolist())
        elif name in ("direction", "up"):
            changed[name] = tuple(unit(matrix[:3, :3] @ value).tolist())
        elif name == "image" and value is not None and mirrors:
            changed[name] = value.mirrored()
    return replace(light, **changed)


def unit(vectors: NDArray[np.floating]) -> NDArray[np.float64]:
    """Normalize each row, safe from overflow; rows that are zero or not finite become zero."""
    with np.errstate(divide="ignore", invalid="ignore"):
        # numpy reduces many short rows slowly, but whole columns fast.
        largest = reduce(np.maximum, np.moveaxis(np.abs(vectors), -1, 0)).astype(np.float64)[..., None]
        scaled = vectors / largest
        rows = scaled / np.sqrt(np.einsum("...i,...i->...", scaled, scaled))[..., None]
    usable = (largest > 0) & np.isfinite(largest)
    return np.where(usable, rows, 0.0)
