"""Points of a mesh's surface that the texels of its texture coordinates show."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from ..scene.model import Mesh
from .triangle_points import cross, nearest_weights
from .uv_raster import TexelFaces, texel_faces

Doubles = NDArray[np.float64]
#: Points within a texel: a rotated grid.
PLACES = np.array([(1, 5), (3, 1), (5, 7), (7, 3)]) / 8
#: Smallest weight of a face's corner at a point: on an edge, the point could lie behind the face next to it.
INSET = 1e-4
#: Distance from 0 to 1 that texture coordinates may have by rounding.
ROUNDING = 1e-5


@dataclass
class SurfacePoints:
    """Points, unit shading normals and unit geometric normals, each (n, 3); the normals are on one side."""

    points: Doubles
    normals: Doubles
    surface_normals: Doubles


class TexelPoints:
    """The texels of an image of `size` (width, height) that a mesh covers, and the points that they show.

    to_world: (3, 4), of the mesh; name: in messages. Raises SceneError if its texture coordinates cannot be used.
    """

    def __init__(self, mesh: Mesh, to_world: Doubles, name: str, uv_set: int, size: tuple[int, int]) -> None:
        uv = _checked_uv(mesh, name, uv_set)
        self._corners = uv[mesh.faces] * size
        self._mesh = mesh
        self._vertices = mesh.vertices.astype(np.float64) @ to_world[:, :3].T + to_world[:, 3]
        self._to_normal = np.linalg.inv(to_world[:, :3])
        self._width = size[0]
        drawn = np.flatnonzero(self._surface_normals(np.arange(len(mesh.faces))).any(axis=1))
        first, second, third = np.moveaxis(self._corners[drawn], 1, 0)
        #: Number of faces that have an area, but none in texture coordinates.
        self.flat = int(np.count_nonzero(cross(second - first, third - first) == 0))
        self.faces: TexelFaces = texel_faces(self._corners[drawn], drawn, size, PLACES)
        self.texels: NDArray[np.intp] = np.flatnonzero(self.covered)

    @property
    def covered(self) -> NDArray[np.bool_]:
        """(height, width): whether the mesh covers the texel at least partly."""
        return np.asarray(self.faces.face[..., 0] >= 0)

    def of(self, texels: NDArray[np.intp]) -> SurfacePoints:
        """Return len(PLACES) points for each of these texels, nearest to the places in the texel."""
        face = self.faces.face.reshape(-1, len(PLACES))[texels].reshape(-1)
        centers = np.stack([texels % self._width, texels // self._width], axis=1)
        places = (centers[:, None] + PLACES).reshape(-1, 2)
        weights = np.maximum(nearest_weights(self._corners[face], places), INSET)
        weights /= weights.sum(axis=1)[:, None]
        corners = self._mesh.faces[face]
        flat = self._surface_normals(face)
        points = _between(weights, self._vertices[corners])
        return SurfacePoints(points, self._shading_normals(flat, corners, weights), flat)

    def _surface_normals(self, face: NDArray[np.signedinteger[Any]]) -> Doubles:
        """Return the unit normals of the faces' fronts in the world; 0 of those without area."""
        a, b, c = np.moveaxis(self._mesh.vertices[self._mesh.faces[face]].astype(np.float64), 1, 0)
        return _unit(_unit(np.cross(b - a, c - a)) @ self._to_normal)

    def _shading_normals(self, flat: Doubles, corners: NDArray[np.int32], weights: Doubles) -> Doubles:
        """Return the interpolated normals, on the side of the faces' fronts."""
        if self._mesh.normals is None:
            return flat
        smooth = _unit(_between(weights, self._mesh.normals[corners].astype(np.float64)) @ self._to_normal)
        side = np.sign((smooth * flat).sum(axis=1))
        return np.where(side[:, None] == 0, flat, smooth * side[:, None])


def _between(weights: Doubles, values: Doubles) -> Doubles:
    """Return the weighted sums (n, 3) of values (n, 3, 3) at three corners."""
    return np.asarray((weights[:, :, None] * values).sum(axis=1))


def _unit(vectors: Doubles) -> Doubles:
    lengths = np.linalg.norm(vectors, axis=1)
    return np.asarray(vectors / np.where(lengths > 0, lengths, 1)[:, None])


def _checked_uv(mesh: Mesh, name: str, uv_set: int) -> Doubles:
    """Return the texture coordinates. Raises SceneError if there are none, or they exceed the image."""
    uv, which = (mesh.uv1, "uv1") if uv_set else (mesh.uv, "uv")
    if uv is None:
        raise SceneError(
            f"mesh {name} has no texture coordinates {which} to bake into; unwrap it in a modeling program, in Blender "
            f"by UV > Smart UV Project, and export it with its UVs{other_set(mesh, uv_set)}"
        )
    used = uv[mesh.faces].astype(np.float64)
    beyond = int(np.count_nonzero(((used < -ROUNDING) | (used > 1 + ROUNDING)).any(axis=(1, 2))))
    if beyond:
        raise SceneError(
            f"mesh {name}: {beyond} of its {len(mesh.faces)} faces have texture coordinates {which} outside 0 to 1, "
            f"where the image would repeat; pack them into the unit square, in Blender by UV > Pack Islands"
            f"{other_set(mesh, uv_set)}"
        )
    return uv.astype(np.float64)


def other_set(mesh: Mesh, uv_set: int) -> str:
    """Return the advice to use the mesh's other texture coordinates, if it has such, to be appended to a message."""
    other = mesh.uv if uv_set else mesh.uv1
    return "" if other is None else f", or bake into its other set with --uv-set {1 - uv_set} (in Python uv_set)"
