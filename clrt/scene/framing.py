"""A camera that shows a whole model."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .model import Camera, Mesh

#: From the model to the camera: in front (+Z), 28° to the right and 17° above.
THREE_QUARTER = (0.53, 0.34, 1.0)
FOV_DEGREES = 30.0
#: The part of a square picture's width or height, whichever is the tighter, that the model fills.
FILL = 0.92
#: Rounds of the search for the centre of the looser side; it ends by itself after 3 to 6.
ROUNDS = 20

Doubles = NDArray[np.float64]


def frame(meshes: list[Mesh]) -> Camera:
    """The nearest three-quarter view that keeps every vertex inside a square picture, the model in its middle.

    Only vertices that a face uses count. The model fills FILL of the picture's width or height, and its left and right
    margins are equal, as are those above and below.
    """
    back = np.array(THREE_QUARTER) / np.linalg.norm(THREE_QUARTER)
    right = np.cross([0.0, 1.0, 0.0], back) / np.linalg.norm(np.cross([0.0, 1.0, 0.0], back))
    axes = np.array([right, np.cross(back, right), back])
    vertices = _used_vertices(meshes)
    middle = vertices.min(axis=0) / 2 + vertices.max(axis=0) / 2
    x, y, z = axes @ (vertices - middle).T
    # From (cx, cy, d) a vertex is seen at |x - cx| <= slope (d - z): cx + slope d and slope d - cx have lower bounds,
    # whose sum bounds d alone.
    slope = FILL * math.tan(math.radians(FOV_DEGREES) / 2)
    distance = max(float(np.max(slope * z + s) + np.max(slope * z - s)) for s in (x, y)) / (2 * slope)
    distance = distance if distance > 0 else 1.0
    center = middle + np.array([_center(x, z, distance), _center(y, z, distance), 0.0]) @ axes
    return Camera(position=_vector(center + distance * back), look_at=_vector(center), fov_degrees=FOV_DEGREES)


def bounds(meshes: list[Mesh]) -> tuple[Doubles, Doubles]:
    """Lowest and highest coordinates, (3,) each, of the vertices that the faces use."""
    vertices = _used_vertices(meshes)
    return vertices.min(axis=0), vertices.max(axis=0)


def _used_vertices(meshes: list[Mesh]) -> Doubles:
    """The vertices that faces use, (n, 3)."""
    rows = []
    for mesh in meshes:
        used = np.zeros(len(mesh.vertices), bool)
        used[mesh.faces] = True
        rows.append(mesh.vertices[used])
    return np.concatenate(rows).astype(np.float64)


def _center(x: Doubles, z: Doubles, distance: float) -> float:
    """Where the camera must be along x so that the model's two edges are equally far from the picture's middle.

    Its half width in the picture is the greatest (x_i - x_j) / (2 distance - z_i - z_j) of all pairs. Each round takes
    the best pair for the last ratio (Dinkelbach 1967): the ratio grows until the pair stays the same.
    """
    slope, pair = 0.0, (0, 0)
    for _ in range(ROUNDS):
        last, pair = pair, (int(np.argmax(x + slope * z)), int(np.argmin(x - slope * z)))
        if pair == last:
            break
        high, low = pair
        slope = float((x[high] - x[low]) / (2 * distance - z[high] - z[low]))
    high, low = pair
    return float(x[high] + slope * z[high] + x[low] - slope * z[low]) / 2


def _vector(values: Doubles) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z
