"""A camera that shows a whole model."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .model import Camera, Mesh

#: From the model's middle to the camera: in front (+Z), to the right and above.
THREE_QUARTER = (0.55, 0.36, 1.0)
FOV_DEGREES = 35.0
#: The part of the picture's half height and half width that the box may fill.
FILL = 0.92


def frame(meshes: list[Mesh]) -> Camera:
    """The nearest three-quarter view that keeps the meshes' bounding box inside a square picture.

    Only vertices that a face uses count. A corner q, seen from the box's middle, is inside if |q·right| and |q·up|
    are at most FILL tan(fov/2) (d − q·back), which bounds the distance d from below.
    """
    low, high = bounds(meshes)
    middle, half = low / 2 + high / 2, high / 2 - low / 2
    back = np.array(THREE_QUARTER) / np.linalg.norm(THREE_QUARTER)
    right = np.cross([0.0, 1.0, 0.0], back) / np.linalg.norm(np.cross([0.0, 1.0, 0.0], back))
    up = np.cross(back, right)
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T
    corners = signs * half
    aside = np.maximum(abs(corners @ right), abs(corners @ up))
    distance = np.max(corners @ back + aside / (FILL * math.tan(math.radians(FOV_DEGREES) / 2)))
    position = middle + back * (distance if distance > 0 else 1.0)
    x, y, z = position.tolist()
    at_x, at_y, at_z = middle.tolist()
    return Camera(position=(x, y, z), look_at=(at_x, at_y, at_z), fov_degrees=FOV_DEGREES)


def bounds(meshes: list[Mesh]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lowest and highest coordinates, (3,) each, of the vertices that the faces use."""
    boxes = []
    for mesh in meshes:
        used = np.zeros(len(mesh.vertices), bool)
        used[mesh.faces] = True
        vertices = mesh.vertices[used].astype(np.float64)
        boxes.append((vertices.min(axis=0), vertices.max(axis=0)))
    return np.min([low for low, _ in boxes], axis=0), np.max([high for _, high in boxes], axis=0)
