"""Cells of the upper hemisphere that fit a density, however peaked, and the density's integral over them.

Cells are rectangles (c0, c1, phi0, phi1) in c = 1 − cos θ and the azimuth phi in [0, 2·pi), where area is solid angle.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
HEMISPHERE = (0.0, 1.0, 0.0, 2 * np.pi)
THINNING = (0.0, 0.1, 0.5, 0.9, 1.0)

#: An integral over a rectangle is done when cutting it in four changes it by no more than these, relative or absolute.
RELATIVE, ABSOLUTE, DEEPEST = 2e-3, 2e-6, 14
NODES, WEIGHTS = np.polynomial.legendre.leggauss(3)


def chart(w: Doubles) -> Doubles:
    """(n, 2): c and phi of unit vectors (n, 3); c from the sine where the cosine has lost its digits."""
    x, y, z = w.T
    c = np.where(z < 0.5, 1 - z, (x * x + y * y) / (1 + np.maximum(z, 0)))
    return np.column_stack([c, np.arctan2(y, x) % (2 * np.pi)])


def direction(c: Doubles, phi: Doubles) -> Doubles:
    """(n, 3) unit vectors."""
    sine = np.sqrt(c * (2 - c))
    return np.column_stack([sine * np.cos(phi), sine * np.sin(phi), 1 - c])


@dataclass
class Cells:
    """Parts of the hemisphere: `counts[i]` points lie in the rectangles (m, 4) whose `owner` (m,) is i."""

    counts: list[int]
    rectangles: list[Doubles]

    @property
    def owner(self) -> NDArray[np.intp]:
        return np.repeat(np.arange(len(self.counts)), [len(part) for part in self.rectangles])


def count_in_cells(training: Doubles, points: Doubles, levels: int, cell: tuple[float, ...] = HEMISPHERE) -> Cells:
    """Cuts the hemisphere at the medians of `training`, in turn across c and phi: 2^levels cells that should hold alike.

    Both sets are charted, (n, 2), and independent. A cell's rectangles are cut where its training points thin out, so
    that a peak in its corner is not overlooked.
    """
    if levels == 0:
        return Cells([len(points)], [_graded(training, cell)])
    axis = levels % 2
    middle = float(np.median(training[:, axis]))
    low, high = list(cell), list(cell)
    low[2 * axis + 1] = high[2 * axis] = middle
    first, second = (count_in_cells(training[side(training)], points[side(points)], levels - 1, tuple(part))
                     for part, side in ((low, lambda p: p[:, axis] < middle), (high, lambda p: p[:, axis] >= middle)))
    return Cells(first.counts + second.counts, first.rectangles + second.rectangles)


def _graded(training: Doubles, cell: tuple[float, ...]) -> Doubles:
    c, phi = (np.concatenate([cell[i:i + 1], np.quantile(training[:, i // 2], THINNING), cell[i + 1:i + 2]])
              for i in (0, 2))
    c0, phi0 = np.meshgrid(c[:-1], phi[:-1])
    c1, phi1 = np.meshgrid(c[1:], phi[1:])
    return np.stack([c0, c1, phi0, phi1], axis=-1).reshape(-1, 4)


def integrate(density: Callable[[NDArray[np.intp], Doubles], Doubles], cells: Doubles) -> Doubles:
    """(m,) integrals of a density over cells (m, 4), cut in four where it is not smooth enough.

    density(cell, w) gives the densities at directions w (n, 3), each inside the cell of that number.
    """
    total = np.zeros(len(cells))
    owner, coarse = np.arange(len(cells)), _gauss(density, np.arange(len(cells)), cells)
    for _ in range(DEEPEST):
        quarters, owners = _quarters(cells), np.repeat(owner, 4)
        fine = _gauss(density, owners, quarters).reshape(-1, 4)
        better = fine.sum(axis=1)
        rough = np.abs(better - coarse) > np.maximum(RELATIVE * better, ABSOLUTE)
        np.add.at(total, owner[~rough], better[~rough])
        cells, owner, coarse = quarters[np.repeat(rough, 4)], owners[np.repeat(rough, 4)], fine[rough].ravel()
        if not len(cells):
            break
    np.add.at(total, owner, coarse)
    return total


def _gauss(density: Callable[[NDArray[np.intp], Doubles], Doubles], owner: NDArray[np.intp], cells: Doubles) -> Doubles:
    """Gauss–Legendre, three by three points a cell."""
    c = (cells[:, :1] + cells[:, 1:2]) / 2 + (cells[:, 1:2] - cells[:, :1]) / 2 * NODES
    phi = (cells[:, 2:3] + cells[:, 3:]) / 2 + (cells[:, 3:] - cells[:, 2:3]) / 2 * NODES
    grid_c, grid_phi = np.broadcast_arrays(c[:, :, None], phi[:, None, :])
    values = density(np.repeat(owner, 9), direction(grid_c.ravel(), grid_phi.ravel())).reshape(-1, 3, 3)
    area = (cells[:, 1] - cells[:, 0]) * (cells[:, 3] - cells[:, 2]) / 4
    return np.asarray(np.einsum("nij,i,j->n", values, WEIGHTS, WEIGHTS) * area)


def _quarters(cells: Doubles) -> Doubles:
    c0, c1, phi0, phi1 = cells.T
    c, phi = (c0 + c1) / 2, (phi0 + phi1) / 2
    return np.stack([np.stack(part, axis=-1) for part in
                     ((c0, c, phi0, phi), (c, c1, phi0, phi), (c0, c, phi, phi1), (c, c1, phi, phi1))],
                    axis=1).reshape(-1, 4)
