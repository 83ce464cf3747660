"""Packing of triangles, their normals, and spheres (kernels/surface/surface.cl)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....scene.model import Mesh
from ..records import NORMALS, SPHERE, TRIANGLE


class TriangleCorners:
    """Corners of all meshes' triangles, (m, 3, 3) float32, computed on each conversion to a numpy array: they take
    twice the memory of the meshes, and only as long as the array is referenced."""

    def __init__(self, meshes: Sequence[Mesh]) -> None:
        self._meshes = meshes

    def __len__(self) -> int:
        return sum(len(mesh.faces) for mesh in self._meshes)

    def __array__(self, dtype: None = None, copy: bool | None = None) -> NDArray[np.float32]:
        # take: like vertices[faces], in a quarter of the time.
        each = [np.take(mesh.vertices, mesh.faces, axis=0) for mesh in self._meshes]
        return each[0] if len(each) == 1 else np.concatenate([np.zeros((0, 3, 3), np.float32), *each])


def triangle_records(meshes: Sequence[Mesh], materials: NDArray[np.int32], lights: NDArray[np.int32]) -> NDArray[Any]:
    """Return TRIANGLE records of the meshes' triangles. materials: (meshes,) codes; lights: (m,) numbers."""
    records = np.zeros(len(lights), TRIANGLE)
    records["light"], records["normals"] = lights, -1
    first = smooth = 0
    for mesh, material in zip(meshes, materials):
        count = len(mesh.faces)
        own = records[first : first + count]
        put_corners(own, "p", mesh.vertices, mesh.faces)
        own["material"] = material
        if mesh.normals is not None:
            own["normals"] = np.arange(smooth, smooth + count)
            smooth += count
        first += count
    return records


def normal_records(meshes: Sequence[Mesh]) -> NDArray[Any]:
    """Return NORMALS records of the smooth meshes' triangles, in order."""
    records = np.zeros(sum(len(mesh.faces) for mesh in meshes if mesh.normals is not None), NORMALS)
    first = 0
    for mesh in meshes:
        if mesh.normals is not None:
            put_corners(records[first : first + len(mesh.faces)], "n", mesh.normals, mesh.faces)
            first += len(mesh.faces)
    return records


def put_corners(records: NDArray[Any], name: str, values: NDArray[np.float32], faces: NDArray[np.int32]) -> None:
    """Store the values (n, 3) at each corner in the fields name0 … name2."""
    for corner in range(3):
        records[f"{name}{corner}"] = np.take(values, faces[:, corner], axis=0)


def sphere_records(
    spheres: NDArray[np.float32], materials: NDArray[np.int32], lights: NDArray[np.int32]
) -> NDArray[Any]:
    """Return SPHERE records of spheres (s, 4). materials, lights: (s,) codes and numbers."""
    records = np.zeros(len(spheres), SPHERE)
    records["center"], records["radius"] = spheres[:, :3], spheres[:, 3]
    records["material"], records["light"] = materials, lights
    return records
