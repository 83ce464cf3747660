"""Vertex normals: from the file, or computed for smooth shading."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...threads import in_parallel
from ..model import FloatArray, IntArray
from .transform import unit

Normals = Literal["file", "smooth", "flat"]
#: Faces that a thread processes at a time; the arrays are small enough to reuse memory instead of allocating it anew.
PART = 1 << 14


def choose_normals(
    wanted: Normals,
    vertices: FloatArray,
    faces: IntArray,
    stored: FloatArray | None,
) -> FloatArray | None:
    """Return the normals that `wanted` selects: (n, 3) float32 of unit length, or None for flat shading.

    "file" takes the `stored` ones, and is flat if the file has none. Stored normals that are zero or not finite, as
    exporters write them for degenerate triangles, are replaced by smooth ones.
    """
    if wanted == "smooth":
        return smooth_normals(vertices, faces)
    if wanted == "flat" or stored is None:
        return None
    normals = unit(stored)
    useless = ~normals.any(axis=1)
    if useless.any():
        points, count = weld(vertices)
        lacking = np.zeros(count, np.bool_)
        lacking[points[useless]] = True
        around = lacking[points[faces]].any(axis=1)
        normals[useless] = smooth_normals(vertices, faces[around])[useless]
    return normals.astype(np.float32)


def smooth_normals(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Compute unit normals, (n, 3) float32: the faces' normals weighted by their angle at each point.

    Angle weights make the result independent of the triangulation (Thürmer and Wüthrich 1998). Vertices at the same
    position share one normal, since many files store every triangle's corners separately. If the faces cancel (a sheet
    with two sides), the normal is that of one face; +Y if no face has an area.
    """
    points, count = weld(vertices)
    corners = points[faces]
    weighted = corner_normals(vertices, faces)
    sums = np.zeros((count, 3))
    for axis in range(3):
        sums[:, axis] = np.bincount(corners.ravel(), weighted[:, axis], count)
    cancelled = np.linalg.norm(sums, axis=1) < 1e-9
    if cancelled.any():
        around = cancelled[corners].any(axis=1)
        sums[cancelled] = _some_normal(corners[around], unit(weighted[::3][around]), count)[cancelled]
    return unit(sums).astype(np.float32)[points]


def corner_normals(vertices: FloatArray, faces: IntArray) -> NDArray[np.float64]:
    """Compute (3m, 3), by face and corner: the face's normal times its angle there; 0 if the face has no area."""
    axes, weighted = vertices.T.astype(np.float64, order="C"), np.empty((3, len(faces), 3))

    def fill(first: int) -> None:
        part = slice(first, first + PART)
        _weigh(axes.take(faces[part].T, axis=1), weighted[:, part].swapaxes(1, 2))

    in_parallel(fill, range(0, len(faces), PART))
    return weighted.reshape(3, -1).T


def _weigh(positions: NDArray[np.float64], weighted: NDArray[np.float64]) -> None:
    """Compute the weighted normals at faces' corners from the corners' positions: all (x to z, corner, face)."""
    edges = np.roll(positions, -1, axis=1) - positions
    areas = np.cross(edges[:, 0], edges[:, 1], axis=0)
    doubled_area = np.sqrt(np.sum(areas**2, axis=0))
    normals = areas / np.where(doubled_area > 0, doubled_area, 1)
    # Unlike the arc cosine, atan2 is also accurate for needles; |a x b| is the same at all three corners.
    angles = np.arctan2(doubled_area, -np.sum(edges * np.roll(edges, 1, axis=1), axis=0))
    np.multiply(normals[:, None], angles, out=weighted)


def weld(vertices: FloatArray) -> tuple[NDArray[np.int64], int]:
    """Number the distinct positions: each vertex's number (n,), and the count. −0 equals 0."""
    bits = (np.asarray(vertices, np.float32) + np.float32(0)).view(np.uint32).astype(np.uint64)
    pairs = np.unique(bits[:, 0] << 32 | bits[:, 1], return_inverse=True)[1].astype(np.uint64)
    points = np.unique(pairs << 32 | bits[:, 2], return_inverse=True)[1]
    return points, int(points.max(initial=-1)) + 1


def _some_normal(corners: NDArray[np.int64], face_normals: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Return for each of `count` points the normal of one non-degenerate face there; +Y if there is none."""
    normals = np.tile([0.0, 1.0, 0.0], (count, 1))
    real = face_normals.any(axis=1)
    for corner in range(3):
        normals[corners[real, corner]] = face_normals[real]
    return normals
