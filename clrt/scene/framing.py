"""A camera that shows a whole model."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .instancing import meshes_by_id
from .model import Camera, Instance, Mesh

#: From the model to the camera: in front (+Z), 28° to the right and 17° above.
THREE_QUARTER = (0.53, 0.34, 1.0)
FOV_DEGREES = 30.0
#: The part of a square picture's width or height, whichever is the tighter, that the model fills.
FILL = 0.92
#: Rounds of the search for the centre of the looser side; it ends by itself after 3 to 6.
ROUNDS = 20

Doubles = NDArray[np.float64]


def frame(meshes: list[Mesh], instances: Sequence[Instance] = ()) -> Camera:
    """The nearest three-quarter view that keeps every vertex inside a square picture, the model in its middle.

    Only vertices that a face uses count; of instances the corners of a box around their mesh. The model fills FILL of
    the picture's width or height, and its left and right margins are equal, as are those above and below.
    """
    back = np.array(THREE_QUARTER) / np.linalg.norm(THREE_QUARTER)
    right = np.cross([0.0, 1.0, 0.0], back) / np.linalg.norm(np.cross([0.0, 1.0, 0.0], back))
    axes = np.array([right, np.cross(back, right), back])
    vertices = _extremes(meshes, instances)
    middle = vertices.min(axis=0) / 2 + vertices.max(axis=0) / 2
    x, y, z = axes @ (vertices - middle).T
    # From (cx, cy, d) a vertex is seen at |x - cx| <= slope (d - z): cx + slope d and slope d - cx have lower bounds,
    # whose sum bounds d alone.
    slope = FILL * math.tan(math.radians(FOV_DEGREES) / 2)
    distance = max(float(np.max(slope * z + s) + np.max(slope * z - s)) for s in (x, y)) / (2 * slope)
    distance = distance if distance > 0 else 1.0
    center = middle + np.array([_center(x, z, distance), _center(y, z, distance), 0.0]) @ axes
    return Camera(position=_vector(center + distance * back), look_at=_vector(center), fov_degrees=FOV_DEGREES)


def bounds(meshes: list[Mesh], instances: Sequence[Instance] = ()) -> tuple[Doubles, Doubles]:
    """Lowest and highest coordinates, (3,) each, of the vertices that the faces use, or of the boxes of instances."""
    vertices = _extremes(meshes, instances)
    return vertices.min(axis=0), vertices.max(axis=0)


def _extremes(meshes: list[Mesh], instances: Sequence[Instance]) -> Doubles:
    """The vertices that faces use, and the corners of boxes where instances put them, (n, 3)."""
    boxes = {}
    for key, mesh in meshes_by_id(instances).items():
        used = _used_vertices([mesh])
        ends = np.stack([used.min(axis=0), used.max(axis=0)])
        boxes[key] = np.array([ends[[x, y, z], [0, 1, 2]] for x, y, z in np.ndindex(2, 2, 2)])
    corners = [boxes[id(each.mesh)] @ each.to_world[:, :3].T + each.to_world[:, 3] for each in instances]
    return np.concatenate([*([_used_vertices(meshes)] if meshes else []), *corners])


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
