"""Triangulation of polygons: as fans, or by clipping ears where a triangle of the fan would be turned over.

Method: G. H. Meisters, "Polygons have ears", 1975; in array operations, all ears that do not touch each other at once.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

#: Triangles that are examined at a time.
PART = 1 << 16
#: A fan's triangle is turned over if its projection onto the polygon's plane has less than −TOLERANCE of its area.
TOLERANCE = 1e-9
#: Pairs of an ear and a vertex that are tested for overlap at a time, at most between two cuts of a polygon, and at
#: most for all polygons; what is left after that becomes fans.
PAIRS, MOST_PAIRS, WORK = 1 << 18, 1 << 22, 1 << 24


def triangulate(points: Floats, corners: NDArray[np.integer[Any]], sizes: Ints) -> Ints:
    """Return triangles, (m, 3), as indices into `corners`, by polygon and with its orientation.

    points: (n, 3). corners: the polygons' vertices, valid indices into the points. sizes: corners per polygon, at least
    3. A polygon of k corners becomes k − 2 triangles. They cover it without overlap unless it intersects itself.
    """
    triangles = fans(sizes)
    if (sizes == 3).all():
        return triangles
    ends = np.cumsum(sizes - 2)
    with np.errstate(all="ignore"):  # coordinates may be huge or not finite
        turned, normals = _turned_over(points, corners, triangles, ends)
        if len(turned):
            places = ranges((np.cumsum(sizes) - sizes)[turned], sizes[turned])
            flat = _projected(points[corners[places]], np.repeat(normals, sizes[turned], axis=0))
            clipped = ranges(ends[turned] - (sizes[turned] - 2), sizes[turned] - 2)
            triangles[clipped] = places[_clip_ears(flat, sizes[turned])]
    return triangles


def ranges(starts: Ints, counts: Ints) -> Ints:
    """Return the concatenated ranges of `counts` integers from `starts` on."""
    return np.repeat(starts - (np.cumsum(counts) - counts), counts) + np.arange(counts.sum())


def fans(sizes: Ints) -> Ints:
    """Return the triangles of each polygon's fan around its first corner, (m, 3)."""
    first = np.repeat(np.cumsum(sizes) - sizes, sizes - 2)
    step = ranges(np.ones_like(sizes), sizes - 2)
    return np.stack([first, first + step, first + step + 1], axis=1)


def _turned_over(points: Floats, corners: NDArray[np.integer[Any]], triangles: Ints, ends: Ints) -> tuple[Ints, Floats]:
    """Return the polygons of whose fans a triangle is turned over, and their normals. ends: of their triangles."""
    turned, normals, first = [np.zeros(0, np.int64)], [np.zeros((0, 3))], 0
    while first < len(ends):
        start = ends[first - 1] if first else 0
        stop = max(int(np.searchsorted(ends, start + PART)), first + 1)
        a, b, c = (points[corners[each]] for each in triangles[start : ends[stop - 1]].T)
        areas = np.cross(b - a, c - a)
        begins = np.concatenate([[start], ends[first : stop - 1]]) - start
        sums = np.add.reduceat(areas, begins)
        projected = np.sum(areas * np.repeat(sums, np.diff(ends[first:stop], prepend=start), axis=0), axis=1)
        found = np.flatnonzero(np.minimum.reduceat(projected, begins) < -TOLERANCE * np.sum(sums**2, axis=1))
        turned.append(first + found)
        normals.append(sums[found])
        first = stop
    return np.concatenate(turned), np.concatenate(normals)


def _projected(points: Floats, normals: Floats) -> Floats:
    """Drop the coordinate in which each point's normal is longest: (n, 2), counter-clockwise polygons."""
    axis = np.argmax(abs(normals), axis=1)
    rows = np.arange(len(points))
    flat = np.stack([points[rows, (axis + 1) % 3], points[rows, (axis + 2) % 3]], axis=1)
    return np.where(normals[rows, axis, None] < 0, flat[:, ::-1], flat)


def _clip_ears(points: Floats, sizes: Ints) -> Ints:
    """Triangulate counter-clockwise polygons in the plane, (n, 2): indices, (m, 3), polygon after polygon."""
    owner = np.repeat(np.arange(len(sizes)), sizes)
    ring, clipped, work = np.arange(len(points)), [], 0
    while len(ring):
        change = np.flatnonzero(np.diff(owner[ring])) + 1
        starts, stops = np.concatenate([[0], change]), np.concatenate([change, [len(ring)]])
        polygon = np.repeat(np.arange(len(starts)), stops - starts)
        before, after = np.arange(len(ring)) - 1, np.arange(len(ring)) + 1
        before[starts], after[stops - 1] = stops - 1, starts
        around = np.stack([ring[before], ring, ring[after]], axis=1)
        ears, effort = _ears(points, around, polygon)
        work += effort
        solvable = np.bincount(polygon[ears], minlength=len(starts)) > 0
        if work > WORK:
            solvable[:] = False
        # The ears with the largest of arbitrary distinct numbers do not touch each other.
        rank = np.where(ears, ring * 2654435761 % (1 << 32), -1)
        chosen = solvable[polygon] & ears & (rank > rank[before]) & (rank > rank[after])
        rest = ~solvable[polygon]
        clipped += [around[chosen], ring[rest][fans((stops - starts)[~solvable])]]
        left = ~chosen & ~rest
        left &= (np.bincount(polygon[left], minlength=len(starts)) >= 3)[polygon]
        ring = ring[left]
    triangles = np.concatenate(clipped)
    return triangles[np.argsort(owner[triangles[:, 0]], kind="stable")]


def _ears(points: Floats, around: Ints, polygon: Ints) -> tuple[Flags, int]:
    """Return which corners are ears: convex, and with no other vertex in the triangle with their neighbors.

    Vertices on its boundary count, too, unless the polygon would be without ears. Also returns the number of tests.
    """
    triangles = points[around]
    a, b, c = triangles.transpose(1, 2, 0)
    turn = _cross(b - a, c - b)
    convex = np.flatnonzero(turn > 0)
    first, counts, vertices = _near(triangles, polygon, convex, np.flatnonzero(turn <= 0))
    too_many = np.bincount(polygon[convex], counts, polygon[-1] + 1) > MOST_PAIRS
    counts[too_many[polygon[convex]]] = 0
    touched, overlapped = np.zeros(len(polygon), np.bool_), (turn <= 0) | too_many[polygon]
    ends = np.cumsum(counts)
    for part in np.split(np.arange(len(convex)), np.searchsorted(ends, np.arange(PAIRS, ends[-1:].sum(), PAIRS))):
        ears, at = np.repeat(convex[part], counts[part]), b[:, vertices[ranges(first[part], counts[part])]]
        sides = np.stack([_cross(v[:, ears] - u[:, ears], at - u[:, ears]) for u, v in ((a, b), (b, c), (c, a))])
        elsewhere = np.all([(at != corner[:, ears]).any(axis=0) for corner in (a, b, c)], axis=0)
        touched[ears[(sides >= 0).all(axis=0) & elsewhere]] = True
        overlapped[ears[(sides > 0).all(axis=0)]] = True
    strict = ~(touched | overlapped)
    enough = np.bincount(polygon[strict], minlength=polygon[-1] + 1) > 0
    return np.where(enough[polygon], strict, ~overlapped), len(polygon) + int(counts.sum())


def _near(triangles: Floats, polygon: Ints, ears: Ints, vertices: Ints) -> tuple[Ints, Ints, Ints]:
    """Return the vertices of an ear's polygon whose x or y is in the range of its triangle: for each ear the first one
    and their number in the third array.

    triangles: (n, 3, 2), those of all corners, the vertex itself in the middle; polygon: their polygons, ascending.
    """
    first, counts, sources = [], [], []
    starts = np.flatnonzero(np.diff(polygon, prepend=-1))
    for axis in range(2):
        coordinates = triangles[:, :, axis]
        least = np.minimum.reduceat(coordinates[:, 1], starts)
        extent = np.maximum.reduceat(coordinates[:, 1], starts) - least
        offsets = (coordinates - least[polygon, None]) / np.where(extent > 0, extent, 1)[polygon, None]
        keys = 2.0 * polygon[:, None] + offsets  # ascending within a polygon, and from one to the next
        order = vertices[np.argsort(keys[vertices, 1])]
        first.append(np.searchsorted(keys[order, 1], keys[ears].min(axis=1)))
        counts.append(np.searchsorted(keys[order, 1], keys[ears].max(axis=1), "right") - first[axis])
        sources.append(order)
    along_x = counts[0] <= counts[1]
    return (
        np.where(along_x, first[0], first[1] + len(vertices)),
        np.where(along_x, counts[0], counts[1]),
        np.concatenate(sources),
    )


def _cross(u: Floats, v: Floats) -> Floats:
    """Return the cross products of vectors in the plane, (2, n)."""
    product: Floats = u[0] * v[1] - u[1] * v[0]
    return product
