"""Plastic: a diffuse base under a dielectric coat, as Mitsuba's `plastic` and `roughplastic` define it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..fields.limits import Ge, Le
from .material import ALPHA_MIN, MOST_IOR, Albedo, Material, Parameter, Unit
from .textures import Texture

Doubles = NDArray[np.float64]
Distribution = Literal["ggx", "beckmann"]

#: Facets per side of a grid over their visible normals.
GRID = 64
#: Number of equidistant cosines, from 0 to 1, at which a rough coat's transmittance is tabulated, as in Mitsuba.
COSINES = 64
#: Stands for the cosine 0.
GRAZING = 1e-6


@dataclass(frozen=True, kw_only=True)
class Plastic(Material):
    """Diffuse base under a dielectric coat of index of refraction `ior`; single scattering at the coat's microfacets.

    color: albedo of the base; specular: multiplies what the coat reflects; roughness: of the coat, alpha =
    roughness²; nonlinear: light that the coat reflects back to the base is colored again at each bounce.
    """

    kernel: ClassVar[str] = "plastic"
    parts: ClassVar[tuple[str, ...]] = ("BECKMANN",)
    color: Albedo | Texture = (0.5, 0.5, 0.5)
    ior: Annotated[float, Ge(1), Le(MOST_IOR)] = 1.5
    roughness: Unit = 0.0
    specular: Albedo | Texture = (1.0, 1.0, 1.0)
    distribution: Distribution = "ggx"
    nonlinear: bool = False

    def parameters(self) -> dict[str, Parameter]:
        coat = coat_of(self.ior, self.roughness, self.distribution)
        values: dict[str, Parameter] = {"color": self.color, "ior": self.ior, "roughness": self.roughness}
        values |= {"specular": self.specular, "nonlinear": float(self.nonlinear)}
        values |= {"inside": coat.inside, "mean": coat.mean}
        has = self.features()
        values |= {"transmittance": coat.transmittance} if "ROUGH_PLASTIC" in has else {}
        return values | ({"beckmann": 1.0} if "BECKMANN_PLASTIC" in has else {})

    def features(self) -> frozenset[str]:
        beckmann = self.distribution == "beckmann" and self.roughness > 0
        has = {"ROUGH_PLASTIC": self.roughness > 0, "BECKMANN": beckmann, "BECKMANN_PLASTIC": beckmann}
        return frozenset(name for name, present in has.items() if present)


class Coat(NamedTuple):
    """inside: fraction of diffuse light from inside that the coat reflects back; mean: fraction of diffuse light from
    outside that it transmits; transmittance: of light at COSINES equidistant cosines."""

    inside: float
    mean: float
    transmittance: tuple[float, ...]


@lru_cache(maxsize=256)
def coat_of(ior: float, roughness: float, distribution: Distribution) -> Coat:
    """Compute what a coat transmits and reflects.

    For a rough one `inside` is the sum over equidistant cosines by which Mitsuba computes it, 0.98 of the integral.
    """
    node, weight = np.polynomial.legendre.leggauss(32)
    cosines, weight = (node + 1) / 2, weight * (node + 1) / 2
    alpha = max(roughness**2, ALPHA_MIN)
    mean = float(weight @ fractions(cosines, alpha, ior, distribution)[1])
    grid = np.linspace(0, 1, COSINES)
    grid[0] = GRAZING
    if roughness == 0:
        inside = 1 - mean / ior**2  # by reciprocity
    else:
        inside = float(2 * np.mean(fractions(grid, alpha, 1 / ior, distribution)[0] * grid))
    table = fractions(grid, alpha, ior, distribution)[1]
    return Coat(inside, mean, tuple(table.tolist()))


def fractions(cosines: Doubles, alpha: float, ior: float, distribution: Distribution) -> tuple[Doubles, Doubles]:
    """Return the fractions (n,) of light at cosines (n,) that visible facets reflect and refract, each times G1 of the
    direction that it leaves in (Walter et al. 2007)."""
    steps = np.arange(GRID) / GRID
    rest, phi = (grid.ravel() for grid in np.meshgrid(steps + 0.5 / GRID, 2 * np.pi * steps))
    above = rest**3  # the fraction of steeper facets; the steepest are what grazing light meets
    tangent2 = alpha**2 * (1 / above - 1 if distribution == "ggx" else -np.log(above))
    z = 1 / np.sqrt(1 + tangent2)
    cosine = cosines[:, None] * z + np.sqrt(1 - cosines**2)[:, None] * np.sqrt(1 - z**2) * np.cos(phi)
    seen = np.maximum(cosine, 0) / z * rest**2
    seen /= seen.sum(axis=1, keepdims=True)
    cosine = np.maximum(cosine, GRAZING)  # facets that face away have no weight
    cos2 = 1 - (1 - cosine**2) / ior**2
    cos_t = np.sqrt(np.maximum(cos2, 0))
    across = (cosine - ior * cos_t) / (cosine + ior * cos_t)
    along = (ior * cosine - cos_t) / (ior * cosine + cos_t)
    fresnel = np.where(cos2 > 0, (across**2 + along**2) / 2, 1)
    reflected = masking(2 * cosine * z - cosines[:, None], alpha, distribution)
    refracted = masking(cosines[:, None] / ior - (cosine / ior - cos_t) * z, alpha, distribution)
    return np.sum(seen * fresnel * reflected, axis=1), np.sum(seen * (1 - fresnel) * refracted, axis=1)


def masking(z: Doubles, alpha: float, distribution: Distribution) -> Doubles:
    """Return Smith's G1 of directions with these cosines, for Beckmann in Walter's rational form; 0 at and below the
    horizon."""
    up = np.clip(z, 1e-9, 1)
    tangent = np.sqrt(np.maximum(1 / up**2 - 1, 1e-18))
    if distribution == "ggx":
        g1 = 2 / (1 + np.sqrt(1 + (alpha * tangent) ** 2))
    else:
        a = np.minimum(1 / (alpha * tangent), 1.6)
        g1 = np.minimum((3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2), 1)
    return np.where(z > 0, g1, 0)
