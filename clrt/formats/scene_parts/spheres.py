"""Transformed spheres, and meshes turned inside out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...scene.materials.material import Material
from ...scene.model import Mesh, Sphere

#: Tolerance for a transform to be a rotation, translation and uniform scale.
UNEVEN = 1e-5


def sphere_at(to_world: NDArray[np.float64], material: Material, name: str) -> Sphere | None:
    """Return the transformed sphere of radius 1; None if it becomes an ellipsoid, or has texture coordinates."""
    linear = to_world[:3, :3]
    squares = linear.T @ linear
    radius = float(np.cbrt(abs(np.linalg.det(linear))))
    mapped = material.textures() or material.bent_by
    if mapped or np.abs(squares - radius**2 * np.eye(3)).max() > UNEVEN * radius**2:
        return None
    x, y, z = to_world[:3, 3].tolist()
    return Sphere(center=(x, y, z), radius=radius, material=material, name=name)


def inside_out(mesh: Mesh) -> Mesh:
    """Return the mesh turned inside out."""
    return replace(
        mesh, faces=np.ascontiguousarray(mesh.faces[:, ::-1]), normals=None if mesh.normals is None else -mesh.normals
    )
