"""Cameras that frame a whole model: one for a still, and one that a turntable starts with."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .geometry.instancing import meshes_by_id
from .geometry.transform import Matrix
from .model import Camera, Instance, Mesh

#: Views of a model by name: angle about +Y in degrees from the front. glTF defines +Z as the front, and viewers assume
#: it for OBJ and PLY, but some models face the other way.
VIEWS = {"front": 0.0, "right": 90.0, "back": 180.0, "left": 270.0}
#: Direction from the model to the camera: in front (+Z), 28° to the right and 17° above.
THREE_QUARTER = (0.53, 0.34, 1.0)
FOV_DEGREES = 30.0
#: Fraction of an image's width or height, whichever is tighter, that the model fills.
FILL = 0.92
#: Tangent of half the vertical field of view that the model may fill.
SLOPE = FILL * math.tan(math.radians(FOV_DEGREES) / 2)
#: Maximum number of iterations that center the model along the looser axis; it converges after 3 to 6.
ROUNDS = 20

Doubles = NDArray[np.float64]
IDENTITY: Matrix = np.eye(4)


def frame(
    meshes: list[Mesh], instances: Sequence[Instance] = (), turn: Matrix = IDENTITY, aspect: float = 1.0
) -> Camera:
    """Return the nearest three-quarter view that has every vertex inside the image, with the model centered.

    Only vertices that faces use count; instances count by the corners of their mesh's bounding box. The model fills
    FILL of the image's width or height, and its left and right margins are equal, as are the top and bottom ones.
    turn: rotation of the camera about +Y; aspect: the image's width over its height.
    """
    axes = _axes(turn[:3, :3] @ THREE_QUARTER)
    vertices = _extremes(meshes, instances)
    middle = _middle(vertices)
    x, y, z = axes @ (vertices - middle).T
    x /= aspect  # in a square image the same camera would see it so
    distance = max(_nearest(x, z), _nearest(y, z))
    distance = distance if distance > 0 else 1.0
    center = middle + np.array([aspect * _center(x, z, distance), _center(y, z, distance), 0.0]) @ axes
    return Camera(position=_vector(center + distance * axes[2]), look_at=_vector(center), fov_degrees=FOV_DEGREES)


def frame_turning(meshes: list[Mesh], instances: Sequence[Instance], still: Camera, aspect: float) -> Camera:
    """Return the nearest camera in the direction of `still` that has every vertex inside the image in a whole turn.

    The model, or the camera around it, turns about the vertical axis through the center of its bounding box, on which
    look_at lies. What fills FILL of the image is what the model sweeps, so its size is the same with any number of
    frames. The other arguments are as in `frame`, which made `still`.
    """
    axes = _axes(np.subtract(still.position, still.look_at))
    vertices = _extremes(meshes, instances)
    middle = _middle(vertices)
    vertices -= middle
    height, radius = vertices[:, 1], np.hypot(vertices[:, 0], vertices[:, 2])
    (_, cos, _), (_, sin, _) = axes[1:]
    # A point of a circle at an angle t from the camera is at x = radius sin(t), and z = height sin + radius cos cos(t).
    # x <= SLOPE aspect (d - z) bounds d by a sine wave of t. Highest and lowest in the image are its nearest and its
    # furthest point.
    distance = float(np.max(height * sin + radius * math.hypot(cos, 1 / (SLOPE * aspect))))
    near = np.concatenate([radius, -radius])
    height = np.concatenate([height, height])
    y, z = height * cos - near * sin, height * sin + near * cos
    distance = max(distance, _nearest(y, z))
    distance = distance if distance > 0 else 1.0
    lift = _center(y, z, distance)
    position = middle + lift * axes[1] + distance * axes[2]
    look_at = middle + np.array([0.0, lift / cos, 0.0])  # on the axis and on the camera's central ray
    return Camera(position=_vector(position), look_at=_vector(look_at), fov_degrees=FOV_DEGREES)


def bounds(meshes: list[Mesh], instances: Sequence[Instance] = ()) -> tuple[Doubles, Doubles]:
    """Return the bounding box, lowest and highest (3,), of the vertices that faces use and of instances' boxes."""
    vertices = _extremes(meshes, instances)
    return vertices.min(axis=0), vertices.max(axis=0)


def _extremes(meshes: list[Mesh], instances: Sequence[Instance]) -> Doubles:
    """Return the vertices that faces use, and the corners of the instances' transformed bounding boxes, (n, 3)."""
    boxes = {}
    for key, mesh in meshes_by_id(instances).items():
        used = _used_vertices([mesh])
        ends = np.stack([used.min(axis=0), used.max(axis=0)])
        boxes[key] = np.array([ends[[x, y, z], [0, 1, 2]] for x, y, z in np.ndindex(2, 2, 2)])
    corners = [boxes[id(each.mesh)] @ each.to_world[:, :3].T + each.to_world[:, 3] for each in instances]
    return np.concatenate([*([_used_vertices(meshes)] if meshes else []), *corners])


def _used_vertices(meshes: list[Mesh]) -> Doubles:
    """Return the vertices that faces use, (n, 3)."""
    rows = []
    for mesh in meshes:
        used = np.zeros(len(mesh.vertices), bool)
        used[mesh.faces] = True
        rows.append(mesh.vertices[used])
    return np.concatenate(rows).astype(np.float64)


def _axes(back: Doubles) -> Doubles:
    """Return the unit vectors right, up and back of an upright camera, (3, 3); back: of any length."""
    back = back / np.linalg.norm(back)
    right = np.cross([0.0, 1.0, 0.0], back) / np.linalg.norm(np.cross([0.0, 1.0, 0.0], back))
    return np.array([right, np.cross(back, right), back])


def _middle(vertices: Doubles) -> Doubles:
    """Return the center of the bounding box, (3,)."""
    return np.asarray(vertices.min(axis=0) / 2 + vertices.max(axis=0) / 2)


def _nearest(x: Doubles, z: Doubles) -> float:
    """Return the least distance of a camera along z that has all points inside the image along x.

    From (c, d) a point is inside if |x - c| <= SLOPE (d - z): c + SLOPE d and SLOPE d - c have lower bounds, whose sum
    bounds d alone.
    """
    return float(np.max(SLOPE * z + x) + np.max(SLOPE * z - x)) / (2 * SLOPE)


def _center(x: Doubles, z: Doubles, distance: float) -> float:
    """Return the camera's x for which the model's two edges are equally far from the image center.

    The model's half width in the image is the maximum of (x_i - x_j) / (2 distance - z_i - z_j) over all pairs. Each
    iteration takes the best pair for the last ratio (Dinkelbach 1967); the ratio grows until the pair stays the same.
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
