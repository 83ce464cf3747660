"""Points of triangles in the plane: the nearest one to a given point, as weights of the corners."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]


def cross(a: Doubles, b: Doubles) -> Doubles:
    """Return the cross products (…) of vectors (…, 2)."""
    product: Doubles = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return product


def squared_lengths(vectors: Doubles) -> Doubles:
    """Return the squared lengths (…) of vectors (…, 2)."""
    squares: Doubles = vectors[..., 0] ** 2 + vectors[..., 1] ** 2
    return squares


def nearest_weights(corners: Doubles, points: Doubles) -> Doubles:
    """Return the weights (n, 3) of the corners (n, 3, 2) at the point of each triangle that is nearest to a point
    (n, 2)."""
    a, b, c = np.moveaxis(corners, 1, 0)
    area = cross(b - a, c - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        parts = [cross(end - start, points - start) / area for start, end in ((b, c), (c, a), (a, b))]
        inside = (parts[0] >= 0) & (parts[1] >= 0) & (parts[2] >= 0) & (area != 0)
    weights, outside = np.stack(parts, axis=1), np.flatnonzero(~inside)
    weights[outside] = _nearest_on_edges(corners[outside], points[outside])
    return weights


def _nearest_on_edges(corners: Doubles, points: Doubles) -> Doubles:
    nearest, best = np.zeros((len(points), 3)), np.full(len(points), np.inf)
    for first in range(3):
        second = (first + 1) % 3
        start, edge = corners[:, first], corners[:, second] - corners[:, first]
        length = np.maximum(squared_lengths(edge), np.finfo(float).tiny)
        along = np.clip(np.einsum("ni,ni->n", points - start, edge) / length, 0, 1)
        distance = squared_lengths(start + along[:, None] * edge - points)
        closer = distance < best
        best[closer] = distance[closer]
        nearest[closer] = 0
        nearest[closer, first], nearest[closer, second] = 1 - along[closer], along[closer]
    return nearest
