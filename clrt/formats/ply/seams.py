"""Attributes of faces, for which vertices are split along seams."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .attributes import Array, colors_of, corner_coordinates
from .elements import Columns, Lists
from .triangles import Fans


def with_face_attributes(whole: dict[str, Any], face: Columns, polygons: Lists, fans: Fans) -> dict[str, Any]:
    """Return the arrays with the texture coordinates and colors of faces, if they have any; vertices whose faces differ
    in them are split."""
    uv = corner_coordinates(face, polygons)
    colors = None if whole["vertex_colors"] is not None else colors_of(face)
    of_corners: dict[str, Array] = {}
    if uv is not None:
        of_corners["uv"] = uv[fans.corners.ravel()]
    if colors is not None:
        of_corners["vertex_colors"] = np.repeat(colors[fans.polygons], 3, axis=0)
    if not of_corners:
        return whole
    faces, corner = _split(fans.vertices.ravel(), len(whole["vertices"]), np.column_stack(list(of_corners.values())))
    old = np.arange(len(corner))
    old[len(whole["vertices"]) :] = fans.vertices.ravel()[corner[len(whole["vertices"]) :]]
    split = {name: None if values is None else values[old] for name, values in whole.items() if name != "faces"}
    return split | {name: values[corner] for name, values in of_corners.items()} | {"faces": faces.reshape(-1, 3)}


def _split(vertices: Array, count: int, attributes: NDArray[np.float32]) -> tuple[Array, Array]:
    """Return the vertex of each corner (c,) after splitting, and for each vertex a corner with its attributes.

    The `count` vertices keep their numbers; corners whose attributes (c, k) differ from those of the vertex's last
    corner get new ones.
    """
    last = np.zeros(count, np.int64)
    last[vertices] = np.arange(len(vertices))
    seam = np.zeros(len(vertices), np.bool_)
    for column in attributes.T:
        seam |= column != column[last[vertices]]
    others = np.flatnonzero(seam)
    keys = vertices[others].astype(np.int64)
    for column in attributes[others].T:
        values = np.unique(column, return_inverse=True)[1]
        keys = np.unique(keys * (len(others) + 1) + values, return_inverse=True)[1]
    _, first, numbers = np.unique(keys, return_index=True, return_inverse=True)
    split = vertices.astype(np.int64)
    split[others] = count + numbers
    return split, np.append(last, others[first])
