"""Check of pdfs by change of variables: 1 over the Jacobian determinant of the map from random numbers to directions.

The maps are differentiated on the device's own samples, by central differences of sixth order.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..kernel_probe import Doubles
from .bsdf_cases import Bsdfs, view

STEP = 2.0**-6
#: f' ≈ Σ WEIGHTS[k]·(f(x + (k + 1)·step) − f(x − (k + 1)·step))/step. With twice the step the error is 64 times larger;
#: an eighth of the difference between the two is thus an upper bound for the error of the finer one.
WEIGHTS = np.array([45, -9, 1]) / 60
#: Offsets of all points of the differences.
MOVES = STEP * np.array([k * np.eye(2)[axis] for k in (-6, -4, -3, -2, -1, 1, 2, 3, 4, 6) for axis in (0, 1)])
#: Rounding of unit vectors, a few units in the last place, propagated through the differences.
NOISE = 3 * 2.0**-24 * 2 * np.abs(WEIGHTS).sum() / STEP
#: Samples with a larger relative error of the area are ignored.
LEAST_KNOWN = 0.05
#: How many values are tried of the random number that selects the lobe.
LOBES = 1 << 8


class Areas(NamedTuple):
    """Area scale of a map around each point, and its maximum relative error; (n,) each."""

    scale: Doubles
    error: Doubles


def areas(mapping: Callable[[Doubles], Doubles], u: Doubles) -> Areas:
    """Return the area scale of a map u (n, 2) -> unit vectors (n, 3) at u, which is at least 6·STEP from 0 and 1."""
    fine, coarse = _slopes(mapping, u, STEP), _slopes(mapping, u, 2 * STEP)
    scale, rough = (np.linalg.norm(np.cross(slopes[:, 0], slopes[:, 1]), axis=1) for slopes in (fine, coarse))
    longest = np.linalg.norm(fine, axis=2).max(axis=1)
    return Areas(scale, (NOISE * longest + np.abs(scale - rough) / 8) / np.maximum(scale, 1e-30))


def _slopes(mapping: Callable[[Doubles], Doubles], u: Doubles, step: float) -> Doubles:
    """Return the partial derivatives of the map, (n, 2, 3)."""
    moves = np.array([(axis, sign * (k + 1) * step) for axis in (0, 1) for k in range(3) for sign in (1, -1)])
    moved = u[:, None, :] + np.where(np.arange(2) == moves[:, :1], moves[:, 1:], 0)
    w = mapping(moved.reshape(-1, 2)).reshape(len(u), 2, 3, 2, 3)
    return np.asarray(np.einsum("k,nakx->nax", WEIGHTS / step, w[:, :, :, 0] - w[:, :, :, 1]))


def grid(side: int = 12) -> Doubles:
    """Return (side², 2) points well inside the unit square, exact in float32."""
    inside = (0.2 + 0.6 * (np.arange(side) + 0.5) / side).astype(np.float32).astype(np.float64)
    return np.stack(np.meshgrid(inside, inside), axis=-1).reshape(-1, 2)


def missed(mapping: Callable[[Doubles], Doubles], u: Doubles, density: Doubles) -> float:
    """Return the largest relative deviation of a map's pdf from 1/area beyond the area's error, where known."""
    area = areas(mapping, u)
    known = area.error < LEAST_KNOWN
    return float(np.max((np.abs(1 - density * area.scale) - area.error)[known], initial=0.0))


class Checked(NamedTuple):
    """Result of a check. known: samples whose area is known; lobes: number of maps; error: the largest relative
    deviation of a sample's reported pdf from 1/area beyond the error of the area.

    If there are several maps, or one that folds, 1/area times a map's probability is only a part of the pdf: `error` is
    then how much the pdf falls below that part.
    """

    known: int
    lobes: int
    error: float


def check_density(bsdfs: Bsdfs, which: int, cosine: float) -> Checked:
    """Compare the pdfs of one material's samples, seen from `cosine`, with the areas of its maps."""
    wo, u = view(cosine), grid()

    def draw(at: Doubles, lobe: Doubles | float) -> tuple[Doubles, Doubles]:
        wi, _, pdf, _ = bsdfs.sample(which, wo, np.column_stack([at, np.broadcast_to(lobe, len(at))]))
        return wi, pdf

    known, error, single = 0, 0.0, False
    tried = np.linspace(0, 1 - 2.0**-24, LOBES)  # the least likely lobes are at the ends
    folds = "DIELECTRIC_ENERGY" in bsdfs.materials[which].features()
    every = draw(np.repeat(u, LOBES, axis=0), np.tile(tried, len(u)))[0].reshape(len(u), LOBES, 3)
    lobes = _numbers_of_lobes(every[0], tried)
    for lobe in lobes:
        (wi, pdf), area = draw(u, lobe), areas(lambda at: draw(at, lobe)[0], u)
        single = not folds and bool((every == every[:, :1]).all())
        told = (pdf > 0) & (wi[:, 2] != 0) & (area.error < LEAST_KNOWN)
        moved = draw((u[:, None] + MOVES).reshape(-1, 2), lobe)[0].reshape(len(u), -1, 3)
        told &= (moved[..., 2] * wi[:, 2:] > 0).all(axis=1)  # slopes are meaningless if a lobe ends in between
        same = np.all(every == wi[:, None], axis=2).sum(axis=1)[told]
        part = np.ones(len(same)) if single else np.maximum(same - 1, 0) / LOBES
        lacks = np.where(part > 0, 1 - pdf[told] * area.scale[told] / np.maximum(part, 1 / LOBES), 0)
        off = np.abs(lacks) if single else lacks
        known += int(told.sum())
        error = max(error, float(np.max(off - area.error[told], initial=0.0)))
    return Checked(known, len(lobes), error)


def _numbers_of_lobes(wi: Doubles, tried: Doubles) -> list[float]:
    """Return one of the numbers tried (n,) per lobe, from its middle; wi (n, 3): the direction each number selects."""
    _, lobe, counts = np.unique(wi, axis=0, return_inverse=True, return_counts=True)
    return [float(tried[np.flatnonzero(lobe.ravel() == i)[count // 2]]) for i, count in enumerate(counts)]
