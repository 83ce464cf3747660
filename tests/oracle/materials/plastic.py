"""Diffuse base under a coat of microfacets (W. Jakob, Mitsuba's `roughplastic`; Walter et al. 2007 for the coat):
F·D·G/(4·cos·cos) + color·T(wi)·T(wo)/(π·ior²·(1 − r)), with separable G."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from clrt.scene.materials.material_types import Plastic

from ..surface import Surface
from ..vectors import Doubles, dot
from . import fresnel, ggx
from .microfacets import masking, reflection
from .scattering import Cosine, Mixed, halfway

#: Nodes over the slopes of facets and over their azimuths, and of the cosines at which T is known.
SLOPES, TURNS, COSINES = 160, 256, 64


class CoatedBase(Mixed):
    def __init__(self, material: Plastic, at: Surface) -> None:
        self._material = material
        color = at.tinted(material.color)
        self._transmitted, inside = coat(material.ior, material.roughness, material.distribution)
        self._base = color / (material.ior**2 * (1 - (color if material.nonlinear else 1.0) * inside))
        self._specular = at.color(material.specular)
        self._alpha = np.full(len(color), max(material.roughness**2, ggx.LEAST))
        self.strategies = [ggx.VisibleNormals(self._alpha), Cosine()]

    def evaluate(self, wo: Doubles, wi: Doubles) -> Doubles:
        up = (wo[:, 2] > 0) & (wi[:, 2] > 0)
        o, i = (np.where(up, w[:, 2], 1.0) for w in (wo, wi))
        h = halfway(wo, np.where(up[:, None], wi, wo))
        f = fresnel.dielectric(dot(wo, h), np.full(len(wo), self._material.ior))[0]
        coated = f * reflection(wo, wi, self._alpha, self._material.distribution, "separable")
        under = self._through(o) * self._through(i) * i / np.pi
        return np.where(up[:, None], self._specular * coated[:, None] + self._base * under[:, None], 0.0)

    def _through(self, cosine: Doubles) -> Doubles:
        if self._material.roughness == 0:
            return np.asarray(1 - fresnel.dielectric(cosine, np.full_like(cosine, self._material.ior))[0])
        return np.interp(cosine, np.linspace(0, 1, COSINES), self._transmitted)


@lru_cache
def coat(ior: float, roughness: float, kind: str) -> tuple[Doubles, float]:
    """Return T at COSINES cosines, and the fraction of diffuse light from inside that the coat reflects: if it is
    smooth from the outside's integral, by reciprocity; else by Mitsuba's sum over these cosines."""
    if roughness == 0:
        x, weights = np.polynomial.legendre.leggauss(64)
        f = fresnel.dielectric((x + 1) / 2, np.full(64, ior))[0]
        return np.ones(COSINES), float(1 - weights @ ((1 - f) * (x + 1) / 2) / ior**2)
    cosines = np.linspace(0, 1, COSINES)
    cosines[0] = 1e-6
    reflected = [split(cosine, roughness**2, 1 / ior, kind)[0] for cosine in cosines.tolist()]
    transmitted = [split(cosine, roughness**2, ior, kind)[1] for cosine in cosines.tolist()]
    return np.array(transmitted), float(2 * np.mean(reflected * cosines))


def split(cosine: float, alpha: float, eta: float, kind: str) -> tuple[float, float]:
    """Return the fractions of light at a cosine that visible facets reflect and refract, times G1 where it leaves."""
    x, weights = np.polynomial.legendre.leggauss(SLOPES)
    u, turn = np.meshgrid((x + 1) / 2, 2 * np.pi * (np.arange(TURNS) + 0.5) / TURNS, indexing="ij")
    # D·cos θ is uniform in sin² of an angle (GGX) or in exp(−tan²/alpha²) (Beckmann); s and ds: of that number.
    s = np.sin(u * np.pi / 2) ** 2
    ds = np.pi / 2 * np.sin(u * np.pi)
    tangent = alpha * np.sqrt(s / (1 - s) if kind == "ggx" else -np.log1p(-s))
    z = 1 / np.hypot(1, tangent)
    seen = np.maximum(cosine + np.sqrt(1 - cosine**2) * tangent * np.cos(turn), 0) * ds * weights[:, None]
    cos_o = (cosine + np.sqrt(1 - cosine**2) * tangent * np.cos(turn)) * z
    f, cos_t = fresnel.dielectric(np.maximum(cos_o, 1e-12), np.full_like(cos_o, eta))
    alphas = np.full(cos_o.shape, alpha)
    back = masking(2 * cos_o * z - cosine, alphas, kind)
    on = masking((cosine - cos_o * z) / eta + cos_t * z, alphas, kind)
    reflected, refracted = (float((seen * part).sum() / seen.sum()) for part in (f * back, (1 - f) * on))
    return reflected, refracted
