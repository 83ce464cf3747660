"""Packs triangles, their normals, and spheres: what surfaces are made of (kernels/surface.cl)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene.model import Mesh
from .records import NORMALS, SPHERE, TRIANGLE


def corners_of(meshes: Iterable[Mesh]) -> tuple[NDArray[np.float32], dict[int, NDArray[np.float32]]]:
    """(m, 3, 3) corners of all meshes' triangles, and for smooth meshes by first triangle their (k, 3, 3) normals."""
    corners, normals, first = [np.zeros((0, 3, 3), np.float32)], {}, 0
    for mesh in meshes:
        corners.append(np.take(mesh.vertices, mesh.faces, axis=0))  # as vertices[faces], in a quarter of the time
        if mesh.normals is not None:
            normals[first] = np.take(mesh.normals, mesh.faces, axis=0)
        first += len(mesh.faces)
    return np.concatenate(corners), normals


def triangle_records(triangles: NDArray[np.float32], materials: NDArray[np.int32], lights: NDArray[np.int32],
                     normals: dict[int, NDArray[np.float32]]) -> NDArray[Any]:
    """TRIANGLE records. materials, lights: (m,) codes and numbers; normals: see `corners_of`."""
    records = np.zeros(len(triangles), TRIANGLE)
    records["p0"], records["p1"], records["p2"] = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    records["material"], records["light"], records["normals"] = materials, lights, -1
    stored = 0
    for first, smooth in normals.items():
        records["normals"][first:first + len(smooth)] = np.arange(stored, stored + len(smooth))
        stored += len(smooth)
    return records


def normal_records(normals: dict[int, NDArray[np.float32]]) -> NDArray[Any]:
    """NORMALS records of the smooth triangles, in order; normals: see `corners_of`."""
    smooth = np.concatenate(list(normals.values()))
    records = np.zeros(len(smooth), NORMALS)
    records["n0"], records["n1"], records["n2"] = smooth[:, 0], smooth[:, 1], smooth[:, 2]
    return records


def sphere_records(spheres: NDArray[np.float32], materials: NDArray[np.int32],
                   lights: NDArray[np.int32]) -> NDArray[Any]:
    """SPHERE records of spheres (s, 4). materials, lights: (s,) codes and numbers."""
    records = np.zeros(len(spheres), SPHERE)
    records["center"], records["radius"] = spheres[:, :3], spheres[:, 3]
    records["material"], records["light"] = materials, lights
    return records
