"""Detection of emissive meshes with reversed winding: nothing in the scene lies on the side that emits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..geometry.instancing import baked
from ..model import Mesh, Scene

Doubles = NDArray[np.float64]

#: The scene may extend this far in front of an emitter that faces nothing, relative to its extent behind it and to the
#: emitter's own size: an emitter touching the ceiling does not light it if wound backwards.
SHALLOW = 0.01


def backward_emitters(scene: Scene) -> list[str]:
    """Return the names of meshes that emit from one side and whose triangles all face away from the scene.

    Either the bounding box of the scene and its camera lies behind each triangle, or the mesh is closed, its front
    faces are inside, and nothing else is in there. Needs no device; free for scenes without emissive meshes.
    """
    meshes = [
        *scene.meshes,
        *(baked(each) for each in scene.instances if any((each.material or each.mesh.material).radiance)),
    ]
    emitters = [mesh for mesh in meshes if any(mesh.material.radiance) and not mesh.material.double_sided]
    if not emitters:
        return []
    low, high = _bounds(scene)
    return [mesh.name for mesh in emitters if _faces_nothing(mesh, low, high) or _is_inside_out(mesh, scene)]


def _bounds(scene: Scene) -> tuple[Doubles, Doubles]:
    """Return the lowest and highest corner, (3,) each, of the bounding box of all surfaces and the camera."""
    boxes = [_box(mesh.vertices) for mesh in scene.meshes if len(mesh.vertices)]
    boxes += [_box(_placed_corners(each.mesh, each.to_world)) for each in scene.instances]
    boxes += [(np.subtract(each.center, each.radius), np.add(each.center, each.radius)) for each in scene.spheres]
    boxes.append((np.array(scene.camera.position, np.float64),) * 2)
    return np.min([box[0] for box in boxes], axis=0), np.max([box[1] for box in boxes], axis=0)


def _box(points: NDArray[np.floating]) -> tuple[Doubles, Doubles]:
    """Return the lowest and highest corner. Column by column, much faster than numpy's min(axis=0) of three columns."""
    return np.array([x.min() for x in points.T], np.float64), np.array([x.max() for x in points.T], np.float64)


def _placed_corners(mesh: Mesh, to_world: Doubles) -> Doubles:
    """Return the eight corners of the mesh's bounding box, in the world frame."""
    ends = np.array(_box(mesh.vertices))
    corners = np.array([ends[[x, y, z], [0, 1, 2]] for x, y, z in np.ndindex(2, 2, 2)])
    return np.asarray(corners @ to_world[:, :3].T + to_world[:, 3])


def _triangles(mesh: Mesh) -> Doubles:
    """Return the corners, (m, 3, 3)."""
    return np.asarray(mesh.vertices[mesh.faces], np.float64)


def _faces_nothing(mesh: Mesh, low: Doubles, high: Doubles) -> bool:
    """Whether the box low … high lies behind every triangle, except for a SHALLOW part."""
    corners = _triangles(mesh)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    size = np.ptp(corners.reshape(-1, 3), axis=0).max() if len(corners) else 0.0
    middle = np.einsum("ij,ij->i", normal, (low + high) / 2 - corners[:, 0])
    reach = np.abs(normal) @ (high - low) / 2
    front, back = middle + reach, reach - middle
    shallow = front <= SHALLOW * np.minimum(back, length * size)
    return bool(np.all((length == 0) | shallow) and np.any(back > 0))


def _is_inside_out(mesh: Mesh, scene: Scene) -> bool:
    """Whether it is closed with its front faces inside, and nothing else is in there."""
    corners = _triangles(mesh)
    a, b, c = (corners - corners.mean(axis=(0, 1))).transpose(1, 0, 2)
    if np.einsum("ij,ij->i", a, np.cross(b, c)).sum() >= 0 or not _is_closed(mesh):
        return False
    low, high = _box(mesh.vertices[np.unique(mesh.faces)])
    others: list[NDArray[np.floating]] = [each.vertices for each in scene.meshes if each.vertices is not mesh.vertices]
    others += [_placed_corners(each.mesh, each.to_world) for each in scene.instances]
    others += [np.array([sphere.center for sphere in scene.spheres]).reshape(-1, 3), np.array([scene.camera.position])]
    return not any(np.any(np.all((low < points) & (points < high), axis=1)) for points in others)


def _is_closed(mesh: Mesh) -> bool:
    """Whether every edge occurs once in each direction; vertices at the same position are one."""
    place = np.unique(mesh.vertices, axis=0, return_inverse=True)[1].reshape(-1)
    faces = place[mesh.faces]
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    there, back = (np.sort(edges[:, i] * (place.max() + 1) + edges[:, 1 - i]) for i in (0, 1))
    return bool(np.array_equal(there, back) and np.all(there[1:] != there[:-1]))
