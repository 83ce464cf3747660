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
#: Cells of the grid, along an axis, to whose points a polygon's corners are rounded: cross products are exact in int64.
GRID = 1 << 30
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
            triangles[clipped] = places[_clip_ears(_snapped(flat, sizes[turned]), sizes[turned])]
    return triangles


def ranges(starts: Ints, counts: Ints) -> Ints:
    """Return the concatenated ranges of `counts` integers from `starts` on."""
    return np.repeat(starts - (np.cumsum(counts) - counts), counts) + np.arange(counts.sum())


def fans(sizes: Ints) -> Ints:
    """Return the triangles of each polygon's fan around its first corner, (m, 3)."""
    if (sizes == 3).all():
        return np.arange(3 * len(sizes)).reshape(-1, 3)
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


def _snapped(points: Floats, sizes: Ints) -> Ints:
    """Round the polygons' coordinates to integers from 0 to GRID, each axis of each polygon on its own scale.

    Slender polygons are sheared along the second axis first, since they may extend along a diagonal.
    """
    starts = np.cumsum(sizes) - sizes
    x, y = (points - np.repeat(points[starts], sizes, axis=0)).T
    slopes = np.add.reduceat(x * y, starts) / np.add.reduceat(x * x, starts)
    sheared = np.column_stack([x, y - np.repeat(slopes, sizes) * x])
    least = np.minimum.reduceat(sheared, starts)
    extents = np.maximum.reduceat(sheared, starts) - least
    offsets = sheared - np.repeat(least, sizes, axis=0)
    rounded: Ints = np.rint(offsets * np.repeat(GRID / extents, sizes, axis=0)).astype(np.int64)
    return rounded


def _clip_ears(points: Ints, sizes: Ints) -> Ints:
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


def _ears(points: Ints, around: Ints, polygon: Ints) -> tuple[Flags, int]:
    """Return which corners are ears: convex, and with nothing else of the polygon in the triangle with their neighbors.

    Vertices on its boundary count, too, unless the polygon would be without ears. Where edges turn back or have no
    length, only those corners are ears. Also returns the number of tests.
    """
    triangles = np.ascontiguousarray(points[around.T].transpose(0, 2, 1))
    a, b, c = triangles
    turn = _cross(b - a, c - b)
    back = turn == 0
    back[back] = np.sum((b - a)[:, back] * (c - b)[:, back], axis=0) <= 0
    convex = np.flatnonzero(turn > 0)
    first, counts, vertices = _near(triangles, polygon, convex, np.flatnonzero(turn <= 0))
    too_many = np.bincount(polygon[convex], counts, polygon[-1] + 1) > MOST_PAIRS
    counts[too_many[polygon[convex]]] = 0
    touched, overlapped = np.zeros(len(polygon), np.bool_), (turn <= 0) | too_many[polygon]
    ends = np.cumsum(counts)
    for part in np.split(np.arange(len(convex)), np.searchsorted(ends, np.arange(PAIRS, ends[-1:].sum(), PAIRS))):
        ears, others = np.repeat(convex[part], counts[part]), vertices[ranges(first[part], counts[part])]
        touching, overlapping = _obstacles(triangles, ears, others)
        touched[touching] = overlapped[overlapping] = True
    found = ~overlapped
    for better in (found & ~touched, back):
        found = np.where((np.bincount(polygon[better], minlength=polygon[-1] + 1) > 0)[polygon], better, found)
    return found, len(polygon) + int(counts.sum())


def _obstacles(triangles: Ints, ears: Ints, others: Ints) -> tuple[Ints, Ints]:
    """Return the ears whose triangle's boundary is within rounding of the other corner, and those whose interior is
    entered by that corner or by its edges."""
    corners = triangles[:, :, ears]
    edges = corners[[1, 2, 0]] - corners
    sides = _sides(corners, edges, triangles[1][:, others])
    near = np.flatnonzero((sides >= -2 * (abs(edges[:, 0]) + abs(edges[:, 1]))).all(axis=0))
    ears, others, sides, corners, edges = ears[near], others[near], sides[:, near], corners[..., near], edges[..., near]
    before, at, after = triangles[..., others]
    touching = (corners != at).any(axis=1).all(axis=0)
    entered = [
        ((sides > 0) | (sides == 0) & (_sides(corners, edges, end) > sides)).all(axis=0) for end in (before, after)
    ]
    return ears[touching], ears[entered[0] | entered[1]]


def _near(triangles: Ints, polygon: Ints, ears: Ints, vertices: Ints) -> tuple[Ints, Ints, Ints]:
    """Return the vertices of an ear's polygon whose x or y is in the range of its triangle: for each ear the first one
    and their number in the third array.

    triangles: (3, 2, n), those of all corners, the vertex itself in the middle; polygon: their polygons, ascending.
    """
    first, counts, sources = [], [], []
    for axis in range(2):
        keys = 2 * GRID * polygon + triangles[:, axis]  # ascending from one polygon to the next
        order = vertices[np.argsort(keys[1, vertices])]
        first.append(np.searchsorted(keys[1, order], keys[:, ears].min(axis=0)))
        counts.append(np.searchsorted(keys[1, order], keys[:, ears].max(axis=0), "right") - first[axis])
        sources.append(order)
    along_x = counts[0] <= counts[1]
    return (
        np.where(along_x, first[0], first[1] + len(vertices)),
        np.where(along_x, counts[0], counts[1]),
        np.concatenate(sources),
    )


def _sides(corners: Ints, edges: Ints, points: Ints) -> Ints:
    """Return the cross products of triangles' edges with vectors to points, (3, n): positive inside."""
    return np.stack([_cross(edge, points - corner) for corner, edge in zip(corners, edges)])


def _cross(u: Ints, v: Ints) -> Ints:
    """Return the cross products of vectors in the plane, (2, n)."""
    product: Ints = u[0] * v[1] - u[1] * v[0]
    return product
