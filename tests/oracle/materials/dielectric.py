"""Glass: Fresnel's equations and Snell's law at a smooth surface, at microfacets (Walter et al. 2007, by default GGX
with the height-correlated G2 of Heitz 2014), and at both faces of a thin sheet; for lost energy see glass_energy.

Radiance increases on entering a denser medium by the square of the relative index (Walter 2007, sec. 4.1).
"""

from __future__ import annotations

import numpy as np

from clrt.scene.materials.material_types import Dielectric

from ..surface import Surface
from ..vectors import Bools, Doubles, dot, unit
from . import fresnel
from .ggx import LEAST, distribution as sampled_distribution, smith_lambda, visible_normals
from .glass_energy import Energy
from .microfacets import distribution, reflection, shadowing
from .scattering import Cosine, Sample, Scattering, halfway, mirrored_below, reflected


class Glass(Scattering):
    """eta: (n,) index beyond the surface over that on wo's side; rough: (n,) whether there are microfacets."""

    def __init__(self, material: Dielectric, at: Surface) -> None:
        roughness = at.number(material.roughness)
        self.color, self.thin = at.tinted(material.color), material.thin
        self.eta = np.where(at.front | material.thin, material.ior, 1 / material.ior)
        self.alpha = np.maximum(roughness**2, LEAST)
        self.rough = (roughness > 0) & (material.thin or material.ior != 1)
        self.reflectance, self.facets = at.color(material.reflectance), (material.distribution, material.smith)
        self.outside, self.energy = at.front | material.thin, None
        if material.multiple_scattering and self.rough.any():
            assert self.rough.all()
            self.energy = Energy(material.ior, material.thin, roughness)
        if not material.thin:
            self.absorption_beyond = np.where(at.front[:, None], _absorption(material), 0.0)

    def parts(self, f: Doubles) -> tuple[Doubles, Doubles]:
        """Return what microfacets with Fresnel term F reflect and transmit, (n, 3) each."""
        f, c = f[:, None], self.color
        if not self.thin:
            return f * self.reflectance, (1 - f) * c
        # All bounces between the faces: a geometric series.
        between = 1 - (c * f) ** 2
        safe = np.where(between > 0, between, 1)
        return self.reflectance * (f + (1 - f) ** 2 * c**2 * f / safe), (1 - f) ** 2 * c / safe

    def evaluate(self, wo: Doubles, wi: Doubles) -> Doubles:
        same_side = wi[:, 2:] > 0
        up = np.where(same_side, wi, mirrored_below(wi))
        f, _ = fresnel.dielectric(np.abs(dot(wo, halfway(wo, up))), self.eta)
        back, on = self.parts(f)
        mirrored = reflection(wo, up, self.alpha, *self.facets)[:, None]
        passed = on * mirrored if self.thin else self._refracted(wo, wi)
        once = np.where(self.rough[:, None], np.where(same_side, back * mirrored, passed), 0.0)
        return np.asarray(once * self._raised(wo, wi) + self._later(wo, wi))

    def _raised(self, wo: Doubles, wi: Doubles) -> Doubles | float:
        """Return the factor by which later bounces scale the first one, (n, 1)."""
        if self.energy is None:
            return 1.0
        losses = [self.energy.at(np.abs(w[:, 2]), self._side_of(w))[0] for w in (wo, wi)]
        return np.asarray(1 / (1 - np.minimum(*losses)))[:, None]

    def _later(self, wo: Doubles, wi: Doubles) -> Doubles | float:
        """Return f·|cos wi| of the remaining later bounces, (n, 3)."""
        if self.energy is None:
            return 0.0
        rest = [self.energy.at(np.abs(w[:, 2]), self._side_of(w))[1] for w in (wo, wi)]
        own, other = self.energy.mean_rest(self.outside)
        if self.thin:
            mean, (back, on) = own, self.parts(np.full_like(own, _mean_fresnel(self.eta[0])))
        else:
            mean, back, on = own + self.eta**2 * other, np.ones_like(self.color), self.color
        f = rest[0] * rest[1] * np.abs(wi[:, 2]) / (np.pi * np.maximum(mean, 1e-300))
        return np.asarray(f[:, None] * np.where(wi[:, 2:] > 0, back, on))

    def _side_of(self, w: Doubles) -> Bools:
        """Return whether w is outside; a sheet's outside is like its inside."""
        return np.asarray(self.outside if self.thin else self.outside ^ (w[:, 2] < 0))

    def _refracted(self, wo: Doubles, wi: Doubles) -> Doubles:
        """Return f·|cos wi| (Walter 2007, eq. 16 and 21)."""
        h = -(wo + self.eta[:, None] * wi)
        length = np.linalg.norm(h, axis=1, keepdims=True)
        h = h / np.where(length > 0, length, 1)
        h = np.where(h[:, 2:] < 0, -h, h)
        cos_o, cos_i = dot(wo, h), dot(wi, h)
        crosses = (cos_o > 0) & (cos_i < 0) & (wi[:, 2] < 0)
        _, on = self.parts(fresnel.dielectric(np.abs(cos_o), self.eta)[0])
        g = shadowing(wo[:, 2], np.maximum(-wi[:, 2], 1e-9), self.alpha, *self.facets)
        stretch = np.where(crosses, (cos_o + self.eta * cos_i) ** 2, 1)
        f = np.abs(cos_i * cos_o) / wo[:, 2] * distribution(h, self.alpha, self.facets[0]) * g / stretch
        return on * np.where(crosses, f, 0)[:, None]

    def sample(self, wo: Doubles, rng: np.random.Generator) -> Sample:
        once = self._sample_once(wo, rng)
        if self.energy is None:
            return once
        up = Cosine().draw(wo, rng)
        spread = np.where(rng.random((len(wo), 1)) < 0.5, up, mirrored_below(up))
        later, density = rng.random((len(wo), 1)) < 0.5, up[:, 2:] / np.pi / 2
        weight = np.where(later, self._later(wo, spread) / density, once.weight * self._raised(wo, once.wi))
        return Sample(np.where(later, spread, once.wi), 2 * weight)

    def _sample_once(self, wo: Doubles, rng: np.random.Generator) -> Sample:
        """Sample a single bounce."""
        h = np.where(self.rough[:, None], visible_normals(wo, self.alpha, rng.random((len(wo), 2))), [0.0, 0.0, 1.0])
        cos_o = dot(wo, h)
        f, cos_t = fresnel.dielectric(cos_o, self.eta)
        back, on = self.parts(f)
        chance = back.mean(axis=1) / (back + on).mean(axis=1)
        returns = (rng.random(len(wo)) < chance)[:, None]
        eta = self.eta[:, None]
        if self.thin:
            through, bundled = mirrored_below(reflected(wo, h)), np.ones_like(eta)
        else:
            through = unit(-wo / eta + (cos_o / self.eta - cos_t)[:, None] * h)
            bundled = 1 / eta**2
        wi = np.where(returns, reflected(wo, h), through)
        weight = np.where(returns, back / chance[:, None], on * bundled / np.maximum(1 - chance, 1e-300)[:, None])
        return Sample(wi, weight * self._seen(wo, wi, h, returns[:, 0])[:, None])

    def _seen(self, wo: Doubles, wi: Doubles, h: Doubles, returns: Doubles) -> Doubles:
        """Return D·G2 of microfacets over D·G1 of the sampled ones, 0 if light ends up on the wrong side."""
        height = np.where(returns, wi[:, 2], -wi[:, 2])
        g2 = shadowing(wo[:, 2], np.maximum(height, 1e-9), self.alpha, *self.facets)
        ratio = distribution(h, self.alpha, self.facets[0]) / sampled_distribution(h, self.alpha)
        seen = ratio * g2 * (1 + smith_lambda(wo[:, 2], self.alpha))
        return np.where(height > 0, np.where(self.rough, seen, 1), 0)


def _absorption(material: Dielectric) -> Doubles:
    """Return the absorption per length (3,) by Beer and Lambert's law (KHR_materials_volume)."""
    if material.attenuation_distance is None:
        return np.zeros(3)
    color = np.maximum(np.array(material.attenuation_color, float), 1e-300)
    return np.asarray(-np.log(color) / material.attenuation_distance)


def _mean_fresnel(eta: float) -> float:
    """Return F of diffuse light."""
    x, weights = np.polynomial.legendre.leggauss(200)
    cosine = (x + 1) / 2
    return float(fresnel.dielectric(cosine, np.full_like(cosine, eta))[0] @ (weights * cosine))
