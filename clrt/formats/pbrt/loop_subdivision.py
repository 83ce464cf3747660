"""Loop's subdivision surfaces: C. Loop, "Smooth Subdivision Surfaces Based on Triangles", 1987, with the weights of
Warren and the rules for boundaries of Hoppe et al. 1994, as in pbrt."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .tokens import Doubles

Ints = NDArray[np.int64]


def subdivided(points: Doubles, faces: Ints, levels: int) -> tuple[Doubles, Ints]:
    """Return vertices on the limit surface (n, 3), and faces (m, 3), four times as many per level."""
    for _ in range(levels):
        points, faces = _finer(points, faces)
    return _limit(points, faces), faces


class _Edges:
    """Edges of a mesh: ends (e, 2); opposite: the sum of the vertices across, boundary: whether only one face has it;
    of_faces: (m, 3), the edges from each corner to the next."""

    def __init__(self, faces: Ints) -> None:
        corners = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
        self.ends, found, counts = np.unique(np.sort(corners, axis=1), axis=0, return_inverse=True, return_counts=True)
        self.of_faces = found.reshape(-1, 3)
        self.boundary = counts == 1

    def summed(self, values: Doubles, count: int) -> Doubles:
        """Return the sum, at each vertex, of values (count, 3) at the other ends of its edges."""
        found = np.zeros((count, values.shape[1]))
        np.add.at(found, self.ends[:, 0], values[self.ends[:, 1]])
        np.add.at(found, self.ends[:, 1], values[self.ends[:, 0]])
        return found


def _finer(points: Doubles, faces: Ints) -> tuple[Doubles, Ints]:
    edges, count = _Edges(faces), len(points)
    opposite = np.zeros((len(edges.ends), 3))
    np.add.at(opposite, edges.of_faces, points[np.roll(faces, -2, axis=1)])
    between = points[edges.ends].sum(axis=1)
    inner = 0.375 * between + 0.125 * opposite
    middle = np.where(edges.boundary[:, None], 0.5 * between, inner)
    rim, valence = _rim(edges, points), _valence(edges, count)
    beta = np.where(valence == 3, 3 / 16, 3 / (8 * np.maximum(valence, 1)))[:, None]
    moved = (1 - valence[:, None] * beta) * points + beta * edges.summed(points, count)
    moved = np.where(rim.flags[:, None], 0.75 * points + 0.125 * rim.neighbors, moved)
    a, b, c = (count + edges.of_faces).T
    x, y, z = faces.T
    finer = np.concatenate([np.column_stack(each) for each in ((x, a, c), (y, b, a), (z, c, b), (a, b, c))])
    return np.concatenate([moved, middle]), finer


def _limit(points: Doubles, faces: Ints) -> Doubles:
    edges, count = _Edges(faces), len(points)
    rim, valence = _rim(edges, points), _valence(edges, count)
    beta = np.where(valence == 3, 3 / 16, 3 / (8 * np.maximum(valence, 1)))
    gamma = (1 / (valence + 3 / (8 * beta)))[:, None]
    moved = (1 - valence[:, None] * gamma) * points + gamma * edges.summed(points, count)
    return np.where(rim.flags[:, None], (4 * points + rim.neighbors) / 6, moved)


class _Rim:
    """flags: which vertices are on the boundary; neighbors: the sum of their neighbors there."""

    def __init__(self, flags: NDArray[np.bool_], neighbors: Doubles) -> None:
        self.flags = flags
        self.neighbors = neighbors


def _rim(edges: _Edges, points: Doubles) -> _Rim:
    ends = edges.ends[edges.boundary]
    flags = np.zeros(len(points), np.bool_)
    flags[ends.ravel()] = True
    neighbors = np.zeros((len(points), 3))
    np.add.at(neighbors, ends[:, 0], points[ends[:, 1]])
    np.add.at(neighbors, ends[:, 1], points[ends[:, 0]])
    return _Rim(flags, neighbors)


def _valence(edges: _Edges, count: int) -> NDArray[np.int64]:
    return np.bincount(edges.ends.ravel(), minlength=count)
