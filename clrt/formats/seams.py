"""Attributes of faces and their corners: splitting of vertices whose faces differ in them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
#: The default material's color, encoded, for faces without a color in files whose other faces have one.
PLAIN = 0.9063


def with_corner_attributes(whole: Mapping[str, Any], of_corners: Mapping[str, Array]) -> dict[str, Any]:
    """Return a mesh, trimesh's names of arrays, with attributes by corner of its faces, (3m, k) each, in place of those
    by vertex; vertices whose corners differ in them are split."""
    if not of_corners or not len(whole["faces"]):
        return dict(whole)
    vertices, count = np.ravel(whole["faces"]), len(whole["vertices"])
    faces, corner = _split(vertices, count, np.column_stack(list(of_corners.values())))
    old = np.arange(len(corner))
    old[count:] = vertices[corner[count:]]
    split = {name: None if values is None else values[old] for name, values in whole.items() if name != "faces"}
    return split | {name: values[corner] for name, values in of_corners.items()} | {"faces": faces.reshape(-1, 3)}


def _split(vertices: Array, count: int, attributes: NDArray[np.float32]) -> tuple[Array, Array]:
    """Return the vertex of each corner (c,) after splitting, and for each vertex a corner with its attributes.

    The `count` vertices keep their numbers; corners whose attributes (c, k) differ from those of the vertex's last
    corner get new ones.
    """
    last = np.zeros(count, np.int64)
    last[vertices] = np.arange(len(vertices))
    others = np.flatnonzero(np.any([column != column[last[vertices]] for column in attributes.T], axis=0))
    keys = vertices[others].astype(np.int64)
    for column in attributes[others].T:
        values = np.unique(column, return_inverse=True)[1]
        keys = np.unique(keys * (len(others) + 1) + values, return_inverse=True)[1]
    _, first, numbers = np.unique(keys, return_index=True, return_inverse=True)
    split = vertices.astype(np.int64)
    split[others] = count + numbers
    return split, np.append(last, others[first])
