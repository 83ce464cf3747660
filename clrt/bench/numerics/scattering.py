"""Consistency of the materials' samples, pdfs and values, for every material and angle."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...scene.materials.material_types import MATERIALS, Material
from ..kernel_probe import Doubles
from ..significance import chi2_test, mean_test
from . import sphere_cells
from .bsdf_cases import Bsdfs, layered_variants, plain_variants, uniform, view, views, worded_variants

#: Relative difference of two float32 evaluations of a formula with different contraction (FMA): a dozen roundings.
ROUNDING = 2e-6
#: Error of the quadrature of pdfs, at directions rounded to float32; reached with the narrowest lobes.
QUADRATURE = 5e-4
#: Largest error of the albedo fits (kernels/bsdf/ggx_albedo.cl), which white materials may reflect in excess.
FITTED = 1e-3
#: Kernels of empirical models, which reflect more light than they receive.
GAINING = {"principled"}
#: Cosines for variants that differ in strings or layers only.
FEW = (0.6, 0.1)
#: Mirrors a direction above the surface to one below it.
FLIP = np.array([1.0, 1.0, -1.0])


class Scattered(NamedTuple):
    """Results for samples of one material from one angle. For specular materials, `density` is 1.

    density: p-value of the chi-square test of samples over cells of the sphere, with a cell for failed ones; integral:
    of the pdf; failed: fraction of samples below the horizon; energy: one-sided p-value of no furnace channel exceeding
    1, which is 1 for GAINING models; weight: largest relative error of the weights, times spread, against value over
    pdf; wrong: samples that are not unit vectors, that are below the horizon without having failed or vice versa
    (except for transmissive materials), or that are specular with more than one direction per side, or with a pdf
    elsewhere.
    """

    name: str
    density: float
    integral: float
    failed: float
    energy: float
    weight: float
    wrong: int
    specular: bool = False


def cases(kinds: Iterable[type[Material]] = MATERIALS) -> list[tuple[Material, float]]:
    """Return the materials with the cosines from which they are seen."""
    found: list[tuple[Material, float]] = []
    for kind in kinds:
        found += [(material, cosine) for material in plain_variants(kind) for cosine in views(material)]
        few = worded_variants(kind) + layered_variants(kind)
        found += [(material, cosine) for material in few for cosine in FEW]
    return list(dict.fromkeys(found))


def scatter(bsdfs: Bsdfs, which: int, cosine: float, samples: int, seed: int) -> Scattered:
    """Sample `samples` directions of a material seen from `cosine`, and test them."""
    wo = view(cosine)
    wi, weight, pdf, specular = bsdfs.sample(which, wo, uniform(samples, seed))
    name = f"cos {cosine:.3g}: {bsdfs.materials[which]}"
    energy = 1.0 if bsdfs.materials[which].kernel in GAINING else _energy(weight)
    kept = pdf > 0
    value, density = bsdfs.value(which, wo, wi[kept])
    wrong = np.abs(np.linalg.norm(wi, axis=1) - 1) > ROUNDING
    through = "TRANSMISSION" in bsdfs.materials[which].features()
    wrong |= np.where(kept, (wi[:, 2] < 0) & (not through), ((wi[:, 2] > 0) & (not through)) | weight.any(axis=1))
    if specular.any():
        refracted = 3 if "DISPERSION" in bsdfs.materials[which].features() else int(through)
        wrong |= (specular == 0) | (len(np.unique(wi, axis=0)) > 1 + refracted)
        wrong[kept] |= value.any(axis=1) | (density != 0)
        return Scattered(name, 1.0, 1.0, 0.0, energy, 0.0, int(wrong.sum()), True)
    sided = wi[kept, 2] != 0 if through else wi[kept, 2] > 0
    carried = weight[kept] * np.where(wi[kept, 2] < 0, bsdfs.spread(which), 1)[:, None]
    off = np.abs(carried[sided] * density[sided, None] - value[sided])
    error = np.max(off / np.maximum(value[sided], 1e-30), initial=0.0, where=value[sided] > 1e-30)
    error = max(error, float(np.max(np.abs(pdf[kept][sided] / density[sided] - 1), initial=0.0)))
    chart = chart_of(bsdfs, which, wo)
    expected = chart.integrate(lambda w: bsdfs.value(which, wo, w)[1])
    return Scattered(
        name,
        density_test(chart, wi[kept], expected, samples),
        float(expected.sum()),
        1 - kept.mean(),
        energy,
        error,
        int(wrong.sum()),
    )


@dataclass(frozen=True)
class Chart:
    """Cells of the upper hemisphere and, if `through`, of the lower: around `center`, or as above if that is None."""

    wo: Doubles
    through: bool = False
    center: Doubles | None = None

    def count(self, wi: Doubles) -> NDArray[np.int64]:
        """Count the unit vectors wi (n, 3) in each cell, (cells,)."""
        if not self.through:
            return sphere_cells.count(self.wo, wi)
        down = wi[:, 2] < 0
        under = (
            sphere_cells.count(self.wo, wi[down] * FLIP)
            if self.center is None
            else sphere_cells.count_below(self.center, wi[down])
        )
        return np.concatenate([sphere_cells.count(self.wo, wi[~down]), under])

    def integrate(self, density: Callable[[Doubles], Doubles]) -> Doubles:
        """Integrate density(wi (n, 3)) -> (n,) over solid angle, for each cell, (cells,)."""
        above = sphere_cells.integrate(density, self.wo, self.through)
        if not self.through:
            return above
        under = (
            sphere_cells.integrate(lambda w: density(w * FLIP), self.wo, True)
            if self.center is None
            else sphere_cells.integrate_below(density, self.center)
        )
        return np.concatenate([above, under])


def chart_of(bsdfs: Bsdfs, which: int, wo: Doubles) -> Chart:
    """Return the chart for a material's lobes seen from wo. The center for refraction is the median of some samples."""
    if "TRANSMISSION" not in bsdfs.materials[which].features():
        return Chart(wo)
    wi, _, pdf, _ = bsdfs.sample(which, wo, uniform(1 << 12, 1))
    below = wi[(pdf > 0) & (wi[:, 2] < 0)]
    if bsdfs.spread(which) == 1 or not len(below):
        return Chart(wo, True)
    middle = np.median(below, axis=0)
    return Chart(wo, True, middle / np.linalg.norm(middle))


def density_test(chart: Chart, wi: Doubles, expected: Doubles, samples: int) -> float:
    """Return the p-value of wi (n, 3), the successful ones of `samples` sphere_cells, given their pdf's integrals."""
    rest = max(1 - float(expected.sum()), 0.0)
    return chi2_test([*chart.count(wi), samples - len(wi)], samples * np.array([*expected, rest]) + 1e-9)


def _energy(weight: Doubles) -> float:
    """Return the one-sided p-value of every channel's mean weight being at most 1, up to the error of the fits."""
    mean, variance = weight.mean(axis=0), weight.var(axis=0)
    p = mean_test(mean, np.maximum(variance, 1e-12), len(weight), 1 + FITTED)
    return float(np.where(mean > 1 + FITTED, p / 2, 1).min())


def reciprocity(bsdfs: Bsdfs, which: int, count: int, seed: int) -> Doubles:
    """Return |f(wo, wi) − f(wi, wo)| over their sum, (count,), for pairs all over the sphere, half of them grazing.

    With transmission, f(wo, wi) is compared with f(wi, wo) as seen from behind, times the spread, since the reciprocal
    quantity is radiance over the squared index of refraction. That difference is relative to the smaller cosine at the
    microfacet, which limits the accuracy of both in float32.
    """
    wo, wi = above(count, seed), above(count, seed + 1)
    there, back = bsdfs.value(which, wo, wi)[0] / wi[:, 2:], bsdfs.value(which, wi, wo)[0] / wo[:, 2:]
    through = "TRANSMISSION" in bsdfs.materials[which].features()
    if through:
        half, spread = count // 2, bsdfs.spread(which)
        there[:half] = bsdfs.value(which, wo[:half], wi[:half] * FLIP)[0] / wi[:half, 2:]
        back[:half] = spread * bsdfs.value(which, wi[:half], wo[:half] * FLIP, front=False)[0] / wo[:half, 2:]
    relative = np.abs(there - back) / np.maximum(there + back, 1e-3)
    if through and spread != 1:
        h = wo[:half] + wi[:half] * FLIP / np.sqrt(spread)
        h /= np.linalg.norm(h, axis=1, keepdims=True)
        cosines = np.minimum(np.abs(np.sum(wo[:half] * h, axis=1)), np.abs(np.sum(wi[:half] * FLIP * h, axis=1)))
        relative[:half] *= cosines[:, None]
    return np.asarray(np.max(relative, axis=1))


def above(count: int, seed: int) -> Doubles:
    """Return (count, 3) unit vectors of the upper hemisphere in float32: half uniform, half with z down to 1e-4."""
    rng = np.random.default_rng(seed)
    z = np.where(np.arange(count) % 2, rng.uniform(1e-3, 1, count), 10 ** rng.uniform(-4, -1, count))
    azimuth, sine = rng.uniform(0, 2 * np.pi, count), np.sqrt(1 - z * z)
    unit = np.column_stack([sine * np.cos(azimuth), sine * np.sin(azimuth), z])
    return unit.astype(np.float32).astype(np.float64)
