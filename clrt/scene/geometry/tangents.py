"""Tangents for normal maps: the direction on a surface in which u increases."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..materials.textures import Texture
from ..model import Mesh
from .normals import weld
from .transform import unit

Doubles = NDArray[np.float64]


def corner_tangents(mesh: Mesh, texture: Texture) -> tuple[Doubles, Doubles]:
    """Compute unit tangents (m, 3, 3) at each face's corners, and its handedness (m,): 1, −1, or 0 if it has none.

    The bitangent, up in the image, is handedness · cross(normal, tangent). Uses the mesh's own tangents, otherwise the
    faces' along the image as the texture places it, weighted by their angle at each point and averaged over those
    around it with the same handedness (as Mikkelsen 2008, "Simulation of Wrinkled Surfaces Revisited", ch. 3, without
    splits at sharp seams).
    """
    if mesh.tangents is not None:
        corners = mesh.tangents[mesh.faces].astype(np.float64)
        return unit(corners[..., :3]), np.sign(corners[:, 0, 3])
    uv = mesh.uv1 if texture.uv_set else mesh.uv
    if uv is None:
        return np.zeros((len(mesh.faces), 3, 3)), np.zeros(len(mesh.faces))
    p, t = mesh.vertices[mesh.faces].astype(np.float64), uv[mesh.faces] @ texture.to_picture[:, :2].T
    e1, e2, s1, s2 = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0], t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]
    # Solves e = du·tangent − dv·bitangent for both edges; v points down in the image, the bitangent up.
    area = s1[:, 0] * s2[:, 1] - s2[:, 0] * s1[:, 1]
    handedness = -np.sign(area)
    tangent = unit(unit(e1 * s2[:, 1:] - e2 * s1[:, 1:]) * np.sign(area)[:, None])
    points, count = weld(mesh.vertices)
    group = points[mesh.faces] * 2 + (handedness < 0)[:, None]
    sums = np.zeros((2 * count, 3))
    for i in range(3):
        a, b = unit(p[:, (i + 1) % 3] - p[:, i]), unit(p[:, (i + 2) % 3] - p[:, i])
        angle = np.arccos(np.clip(np.einsum("ij,ij->i", a, b), -1, 1))
        for axis in range(3):
            sums[:, axis] += np.bincount(group[:, i], angle * tangent[:, axis], 2 * count)
    smooth = unit(sums[group])
    return np.where(smooth.any(axis=2, keepdims=True), smooth, tangent[:, None]), handedness
