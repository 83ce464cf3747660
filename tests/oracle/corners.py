"""Vertex attributes of a mesh's triangles in world space."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from clrt.scene.model import Mesh

from .vectors import Doubles, unit


@dataclass
class Corners:
    """Attributes per triangle and corner, counter-clockwise seen from the front.

    p, normals: (t, 3, 3), normals unit, or 0 for flat shading; uv, uv1: (t, 3, 2); colors: (t, 3, 4).
    """

    p: Doubles
    normals: Doubles
    uv: Doubles
    uv1: Doubles
    colors: Doubles

    @staticmethod
    def placed(mesh: Mesh, to_world: Doubles) -> Corners:
        """Return the corners of a mesh transformed by a matrix (3, 4); if it mirrors, the corner order is reversed.
        Normals transform by the inverse transpose."""
        linear = to_world[:, :3]
        normals = None if mesh.normals is None else unit(mesh.normals.astype(float) @ np.linalg.inv(linear))
        rows = [
            mesh.vertices.astype(float) @ linear.T + to_world[:, 3],
            _rows(mesh, normals, 3, 0.0),
            _rows(mesh, mesh.uv, 2, 0.0),
            _rows(mesh, mesh.uv1, 2, 0.0),
            _rows(mesh, mesh.colors, 4, 1.0),
        ]
        faces = mesh.faces[:, ::-1] if np.linalg.det(linear) < 0 else mesh.faces
        return Corners(*(each[faces] for each in rows))

    @staticmethod
    def joined(parts: list[Corners]) -> Corners:
        """Concatenate several, at least one."""
        return Corners(*(np.concatenate([getattr(part, each.name) for part in parts]) for each in fields(Corners)))


def _rows(mesh: Mesh, values: ArrayLike | None, size: int, missing: float) -> Doubles:
    """Return (vertices, size) values, with `missing` for attributes that the mesh lacks."""
    rows = np.full((len(mesh.vertices), size), missing)
    if values is not None:
        given = np.asarray(values, float)
        rows[:, : given.shape[1]] = given
    return rows
