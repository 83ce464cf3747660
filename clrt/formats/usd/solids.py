"""Shapes of USD without points: cube, sphere, cylinder, cone, capsule and plane, as triangles."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...scene.geometry.creases import creased
from ...scene.geometry.normals import smooth_normals
from ...scene.model import Mesh

Floats = NDArray[np.float32]
#: Times that an icosahedron is subdivided for a sphere, and segments of a circle.
SUBDIVISIONS, SEGMENTS = 4, 64
#: Edges at a greater angle stay sharp.
CREASE_DEGREES = 30.0
#: Where the axes of a shape along z come from, for those along another axis.
AXES = {"X": [2, 0, 1], "Y": [1, 2, 0], "Z": [0, 1, 2]}


def solid(kind: str, size: dict[str, Any]) -> tuple[Floats, NDArray[np.int32], Floats | None] | None:
    """Return vertices (n, 3), faces (m, 3) and normals (n, 3), None for flat shading; None for a shape without a size.

    size: the shape's attributes. Raises SceneError for those that are not finite.
    """
    from trimesh import creation  # most files have none of these shapes

    length = {name: abs(float(value)) for name, value in size.items() if name != "axis"}
    for name, value in length.items():
        if not value < float(np.finfo(np.float32).max):
            raise SceneError(f"the {name} of a {kind} is {value:g}; write a smaller number")
    if 0 in length.values():
        return None
    if kind == "Cube":
        made = creation.box([length["size"]] * 3)
    elif kind == "Plane":
        half = np.array([length["width"], length["length"], 0]) / 2
        corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * half
        return _along(corners.astype(np.float32), size), np.array([[0, 1, 2], [0, 2, 3]], np.int32), None
    elif kind == "Sphere":
        made = creation.icosphere(SUBDIVISIONS, length["radius"])
    elif kind == "Cylinder":
        made = creation.cylinder(length["radius"], length["height"], SEGMENTS)
    elif kind == "Cone":
        made = creation.cone(length["radius"], length["height"], SEGMENTS)
    else:
        made = creation.capsule(length["height"], length["radius"], (SEGMENTS, SEGMENTS // 2))
    vertices = np.asarray(made.vertices)
    vertices = vertices - (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    mesh = Mesh(_along(vertices.astype(np.float32), size), np.asarray(made.faces, np.int32))
    if kind in ("Sphere", "Capsule"):
        return mesh.vertices, mesh.faces, smooth_normals(mesh.vertices, mesh.faces)
    mesh = creased(mesh, CREASE_DEGREES)
    return mesh.vertices, mesh.faces, mesh.normals


def _along(vertices: Floats, size: dict[str, Any]) -> Floats:
    """Return vertices of a shape along z turned to its axis."""
    return np.ascontiguousarray(vertices[:, AXES[str(size.get("axis", "Z"))]])
