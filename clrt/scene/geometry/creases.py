"""Normals that are smooth over soft edges and keep sharp edges sharp, by the angle between faces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..model import Mesh
from .normals import corner_normals, weld

#: If more triangles than this share a point, all of them count as soft, since testing all pairs would take too long.
MOST_AROUND = 256


def creased(mesh: Mesh, degrees: float) -> Mesh:
    """Return the mesh with smooth normals, except at edges whose two faces' normals differ by more than `degrees`.

    Each corner's normal is the mean of the normals of the faces around its point that differ from its own face's by at
    most `degrees`, weighted by their angles there. Corners share no vertices afterwards.
    """
    corners = mesh.faces.ravel()
    arrays = {
        name: array[corners]
        for name in ("uv", "uv1", "colors", "tangents")
        if (array := getattr(mesh, name)) is not None
    }
    return replace(
        mesh,
        vertices=mesh.vertices[corners],
        faces=np.arange(len(corners), dtype=np.int32).reshape(-1, 3),
        normals=_normals(mesh, degrees),
        **arrays,
    )


def _normals(mesh: Mesh, degrees: float) -> NDArray[np.float32]:
    """Compute (3m, 3) unit normals, one per corner."""
    points, count = weld(mesh.vertices)
    weighted = corner_normals(mesh.vertices, mesh.faces)
    own = weighted / np.maximum(np.linalg.norm(weighted, axis=1, keepdims=True), 1e-300)
    at = points[mesh.faces.ravel()]
    order = np.argsort(at, kind="stable")
    around = np.bincount(at, minlength=count)
    crowded, least = around[at[order]] > MOST_AROUND, np.cos(np.radians(degrees))
    sums, first = weighted.copy(), np.flatnonzero(~crowded)
    for step in range(1, MOST_AROUND):
        first = first[first + step < len(order)]
        first = first[at[order[first]] == at[order[first + step]]]  # corners of lower-numbered points are finished
        if not len(first):
            break
        one, other = order[first], order[first + step]
        soft = np.einsum("ij,ij->i", own[one], own[other]) >= least
        one, other = one[soft], other[soft]  # each index occurs at most once in each of the two
        sums[one] += weighted[other]
        sums[other] += weighted[one]
    if crowded.any():
        whole = np.stack([np.bincount(at, weighted[:, axis], count) for axis in range(3)], axis=1)
        sums[order[crowded]] = whole[at[order[crowded]]]
    length = np.linalg.norm(sums, axis=1, keepdims=True)
    return np.where(length > 0, sums / np.maximum(length, 1e-300), (0.0, 1.0, 0.0)).astype(np.float32)
