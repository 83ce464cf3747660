"""Whether the materials' samples, densities and values fit each other, for every material from every angle."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..scene.materials import MATERIALS, Material
from . import directions
from .bsdfs import Bsdfs, layered_variants, plain_variants, uniform, view, views, worded_variants
from .probe import Doubles
from .significance import chi2_test, mean_test

#: Two computations of one float32 formula whose products a compiler may fuse or not: some dozen roundings apart.
ROUNDING = 2e-6
#: The quadrature of densities, at directions that are rounded to float32; seen at the narrowest lobes.
QUADRATURE = 5e-4
#: By what the fits of albedos are off at most (kernels/bsdf/ggx_albedo.cl): what white may reflect too much.
FITTED = 1e-3
#: Views of what differs in words only.
FEW = (0.6, 0.1)
#: Makes a direction above the surface one below it.
FLIP = np.array([1.0, 1.0, -1.0])


class Scattered(NamedTuple):
    """What samples of one material seen from one angle showed. p-values of single directions are 1.

    density: chi-square of the samples over cells of the sphere, and one for the failed ones, p; integral: of the
    density; failed: part of the samples below the horizon; energy: that no channel of the furnace exceeds 1, one-sided
    p; weight: largest relative error of the weights, times spread, as value over density; wrong: samples that are no
    unit vectors, are below the horizon without having failed or the other way around (but of materials that light
    goes through), or are specular and have more than one direction a side, or a density elsewhere.
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
    """Materials with the cosines from which they are seen."""
    found: list[tuple[Material, float]] = []
    for kind in kinds:
        found += [(material, cosine) for material in plain_variants(kind) for cosine in views(material)]
        few = worded_variants(kind) + layered_variants(kind)
        found += [(material, cosine) for material in few for cosine in FEW]
    return list(dict.fromkeys(found))


def scatter(bsdfs: Bsdfs, which: int, cosine: float, samples: int, seed: int) -> Scattered:
    """Draws `samples` directions of a material seen from `cosine`."""
    wo = view(cosine)
    wi, weight, pdf, specular = bsdfs.sample(which, wo, uniform(samples, seed))
    name = f"cos {cosine:.3g}: {bsdfs.materials[which]}"
    kept = pdf > 0
    value, density = bsdfs.value(which, wo, wi[kept])
    wrong = np.abs(np.linalg.norm(wi, axis=1) - 1) > ROUNDING
    through = "TRANSMISSION" in bsdfs.materials[which].features()
    wrong |= np.where(kept, (wi[:, 2] < 0) & (not through), ((wi[:, 2] > 0) & (not through)) | weight.any(axis=1))
    if specular.any():
        wrong |= (specular == 0) | (len(np.unique(wi, axis=0)) > 1 + through)
        wrong[kept] |= value.any(axis=1) | (density != 0)
        return Scattered(name, 1.0, 1.0, 0.0, _energy(weight), 0.0, int(wrong.sum()), True)
    sided = wi[kept, 2] != 0 if through else wi[kept, 2] > 0
    carried = weight[kept] * np.where(wi[kept, 2] < 0, bsdfs.spread(which), 1)[:, None]
    off = np.abs(carried[sided] * density[sided, None] - value[sided])
    error = np.max(off / np.maximum(value[sided], 1e-30), initial=0.0, where=value[sided] > 1e-30)
    error = max(error, float(np.max(np.abs(pdf[kept][sided] / density[sided] - 1), initial=0.0)))
    chart = chart_of(bsdfs, which, wo)
    expected = chart.integrate(lambda w: bsdfs.value(which, wo, w)[1])
    return Scattered(name, density_test(chart, wi[kept], expected, samples), float(expected.sum()), 1 - kept.mean(),
                     _energy(weight), error, int(wrong.sum()))


@dataclass(frozen=True)
class Chart:
    """Cells of the hemisphere above, and of that below for what is `through`: around `center`, or as above if None."""

    wo: Doubles
    through: bool = False
    center: Doubles | None = None

    def count(self, wi: Doubles) -> NDArray[np.int64]:
        """(cells,) how many of the unit vectors wi (n, 3) lie in each."""
        if not self.through:
            return directions.count(self.wo, wi)
        down = wi[:, 2] < 0
        under = (directions.count(self.wo, wi[down] * FLIP) if self.center is None
                 else directions.count_below(self.center, wi[down]))
        return np.concatenate([directions.count(self.wo, wi[~down]), under])

    def integrate(self, density: Callable[[Doubles], Doubles]) -> Doubles:
        """(cells,) integrals over solid angle of density(wi (n, 3)) -> (n,)."""
        above = directions.integrate(density, self.wo, self.through)
        if not self.through:
            return above
        under = (directions.integrate(lambda w: density(w * FLIP), self.wo, True) if self.center is None
                 else directions.integrate_below(density, self.center))
        return np.concatenate([above, under])


def chart_of(bsdfs: Bsdfs, which: int, wo: Doubles) -> Chart:
    """The chart for a material's lobes seen from wo. What is bent gathers at the median of some samples of its own."""
    if "TRANSMISSION" not in bsdfs.materials[which].features():
        return Chart(wo)
    wi, _, pdf, _ = bsdfs.sample(which, wo, uniform(1 << 12, 1))
    below = wi[(pdf > 0) & (wi[:, 2] < 0)]
    if bsdfs.spread(which) == 1 or not len(below):
        return Chart(wo, True)
    middle = np.median(below, axis=0)
    return Chart(wo, True, middle / np.linalg.norm(middle))


def density_test(chart: Chart, wi: Doubles, expected: Doubles, samples: int) -> float:
    """p-value of wi (n, 3), those of `samples` directions that did not fail, by their density's integrals."""
    rest = max(1 - float(expected.sum()), 0.0)
    return chi2_test([*chart.count(wi), samples - len(wi)], samples * np.array([*expected, rest]) + 1e-9)


def _energy(weight: Doubles) -> float:
    """One-sided p-value of every channel's mean weight being at most 1, or what multiple scattering is fitted to."""
    mean, variance = weight.mean(axis=0), weight.var(axis=0)
    p = mean_test(mean, np.maximum(variance, 1e-12), len(weight), 1 + FITTED)
    return float(np.where(mean > 1 + FITTED, p / 2, 1).min())


def reciprocity(bsdfs: Bsdfs, which: int, count: int, seed: int) -> Doubles:
    """(count,) |f(wo, wi) − f(wi, wo)| over their sum, at pairs all over the sphere, half of them grazing.

    Through the surface: of f(wo, wi) and of f(wi, wo) as seen from behind, times the spread, since it is radiance over
    the square of the index of refraction that takes the same way back. There the difference is in units of the smaller
    cosine at the microfacet, to which float32 knows both of them.
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
    """(count, 3) unit vectors of the upper hemisphere as float32 holds them: half uniform, half with z down to 1e-4."""
    rng = np.random.default_rng(seed)
    z = np.where(np.arange(count) % 2, rng.uniform(1e-3, 1, count), 10**rng.uniform(-4, -1, count))
    azimuth, sine = rng.uniform(0, 2 * np.pi, count), np.sqrt(1 - z * z)
    unit = np.column_stack([sine * np.cos(azimuth), sine * np.sin(azimuth), z])
    return unit.astype(np.float32).astype(np.float64)
