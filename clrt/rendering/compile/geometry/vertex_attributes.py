"""Packing of further per-corner attributes of triangles: texture coordinates, colours and tangents."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....scene.geometry.tangents import corner_tangents
from ....scene.model import Mesh
from ..records import COLORS, TANGENTS, TEXCOORDS
from .pack_geometry import put_corners


def pack_corners(meshes: Sequence[Mesh], uv_sets: int, with_tangents: bool) -> dict[str, tuple[str, NDArray[Any]]]:
    """Return the buffers texcoords (a record per triangle and UV set), colors and tangents, as far as they are needed.

    Attributes that a mesh lacks are 0, or white for colors.
    """
    count = sum(len(mesh.faces) for mesh in meshes)
    texcoords = np.zeros((count, uv_sets), TEXCOORDS)
    colors = np.ones((count if any(mesh.colors is not None for mesh in meshes) else 0, 3, 4), np.float32)
    tangents = np.zeros(count if with_tangents else 0, TANGENTS)
    first = 0
    for mesh in meshes:
        own = slice(first, first + len(mesh.faces))
        for i, uv in enumerate([mesh.uv, mesh.uv1][:uv_sets]):
            if uv is not None:
                put_corners(texcoords[own, i], "uv", uv, mesh.faces)
        if mesh.colors is not None:
            colors[own, :, : mesh.colors.shape[1]] = mesh.colors[mesh.faces]
        if mesh.material.bent_by is not None and with_tangents:
            tangent, sign = corner_tangents(mesh, mesh.material.bent_by)
            for i in range(3):
                tangents[f"t{i}"][own] = tangent[:, i]
            tangents["sign"][own] = sign
        first += len(mesh.faces)
    buffers: dict[str, tuple[str, NDArray[Any]]] = {}
    if texcoords.size:
        buffers["texcoords"] = ("Texcoords", texcoords.ravel())
    if len(colors):
        buffers["colors"] = ("Colors", colors.reshape(-1, 12).view(COLORS).ravel())
    if len(tangents):
        buffers["tangents"] = ("Tangents", tangents)
    return buffers
