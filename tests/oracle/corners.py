"""What a mesh has at the corners of its triangles, where it stands in the world."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from clrt.scene.model import Mesh

from .vectors import Doubles, unit


@dataclass
class Corners:
    """By triangle and corner, counter-clockwise seen from the front.

    p, normals: (t, 3, 3), normals unit, or 0 for flat shading; uv, uv1: (t, 3, 2); colors: (t, 3, 4).
    """

    p: Doubles
    normals: Doubles
    uv: Doubles
    uv1: Doubles
    colors: Doubles

    @staticmethod
    def placed(mesh: Mesh, to_world: Doubles) -> Corners:
        """Of a mesh that a matrix (3, 4) moves: one that mirrors would reverse the order of corners. Normals transform
        by the inverse transpose."""
        linear = to_world[:, :3]
        normals = None if mesh.normals is None else unit(mesh.normals.astype(float) @ np.linalg.inv(linear))
        rows = [mesh.vertices.astype(float) @ linear.T + to_world[:, 3], _rows(mesh, normals, 3, 0.0),
                _rows(mesh, mesh.uv, 2, 0.0), _rows(mesh, mesh.uv1, 2, 0.0), _rows(mesh, mesh.colors, 4, 1.0)]
        faces = mesh.faces[:, ::-1] if np.linalg.det(linear) < 0 else mesh.faces
        return Corners(*(each[faces] for each in rows))

    @staticmethod
    def joined(parts: list[Corners]) -> Corners:
        """All of several, at least one."""
        return Corners(*(np.concatenate([getattr(part, each.name) for part in parts]) for each in fields(Corners)))


def _rows(mesh: Mesh, values: ArrayLike | None, size: int, missing: float) -> Doubles:
    """(vertices, size), with `missing` where the mesh has none."""
    rows = np.full((len(mesh.vertices), size), missing)
    if values is not None:
        given = np.asarray(values, float)
        rows[:, :given.shape[1]] = given
    return rows
