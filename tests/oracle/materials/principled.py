"""Disney's principled BSDF in the form of Mitsuba 3's `principled`: B. Burley, "Physically Based Shading at Disney",
2012, and "Extending the Disney BRDF to a BSDF with Integrated Subsurface Scattering", 2015. Isotropic."""

from __future__ import annotations

import numpy as np

from clrt.scene.materials.material_types import Principled

from ..surface import Surface
from ..vectors import Bools, Doubles, dot, unit
from . import fresnel, ggx
from .microfacets import masking, shadowing
from .scattering import Cosine, Mixed, halfway, reflected

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
#: The smallest alpha, as documented.
LEAST = 1e-3


class Lobes(Mixed):
    """eta: (n,) index beyond the surface over that on wo's side; outside: (n, 1) where all lobes are."""

    def __init__(self, material: Principled, at: Surface) -> None:
        transmits = material.spec_trans != 0
        self._color = at.tinted(material.color)
        bright = (self._color @ LUMINANCE)[:, None]
        self._hue = np.where(bright > 0, self._color / np.where(bright > 0, bright, 1), 1.0)
        self._metallic, self._roughness = at.number(material.metallic)[:, None], at.number(material.roughness)[:, None]
        self._spec_tint, self._spec_trans = (
            at.number(each)[:, None] for each in (material.spec_tint, material.spec_trans)
        )
        self._sheen, self._sheen_tint = at.number(material.sheen)[:, None], at.number(material.sheen_tint)[:, None]
        self._flatness, self._clearcoat = at.number(material.flatness)[:, None], at.number(material.clearcoat)[:, None]
        self._outside = (at.front | (not transmits))[:, None]
        self._eta = np.where(self._outside[:, 0], material.ior, 1 / material.ior)
        self._alpha, self._reflects = np.maximum(self._roughness[:, 0] ** 2, LEAST), float(material.ior != 1)
        self._coat_alpha = 0.1 + (0.001 - 0.1) * at.number(material.clearcoat_gloss)
        self.strategies = [Facets(self._alpha, self._eta, transmits), Cosine()]

    def evaluate(self, wo: Doubles, wi: Doubles) -> Doubles:
        up = (wo[:, 2] > 0) & (wi[:, 2] > 0)
        above = np.where(up[:, None], wi, wo)
        facets = self._specular(wo, above) + self._outside * (self._matte(wo, above) + self._coat(wo, above))
        return np.where(up[:, None], facets, self._refracted(wo, wi))

    def _specular(self, wo: Doubles, wi: Doubles) -> Doubles:
        """Return microfacet reflection with the blend of Fresnel's equations and Schlick's approximation."""
        h = halfway(wo, wi)
        exact, cos_t = fresnel.dielectric(dot(wo, h), self._eta)
        at = np.where(self._eta > 1, dot(wo, h), cos_t)
        normal = ((self._eta - 1) / (self._eta + 1))[:, None] ** 2
        plain, white = 1 - self._metallic, np.ones_like(self._color)
        front = plain * (1 - self._spec_tint) * exact[:, None]
        front = front + self._metallic * fresnel.schlick(at, self._color, white)
        front += plain * self._spec_tint * fresnel.schlick(at, self._hue * normal, white)
        f = np.where(self._outside, front, plain * self._spec_trans * exact[:, None])
        return np.asarray(self._reflects * f * ggx.reflection(wo, wi, self._alpha, "separable")[:, None])

    def _matte(self, wo: Doubles, wi: Doubles) -> Doubles:
        """Return Burley's diffuse lobe, its flat variant, and the sheen."""
        cos_d = dot(wi, halfway(wo, wi))[:, None]
        o, i = ((1 - w[:, 2:]) ** 5 for w in (wo, wi))
        retro = 2 * self._roughness * cos_d**2
        lobe = (1 - o / 2) * (1 - i / 2) + retro * (o + i + o * i * (retro - 1))
        grazing = self._roughness * cos_d**2
        both = (1 - o + o * grazing) * (1 - i + i * grazing)
        flat = 1.25 * (both * (1 / (wo[:, 2:] + wi[:, 2:]) - 0.5) + 0.5)
        lobe = (1 - self._flatness) * lobe + self._flatness * flat
        sheen = self._sheen * (1 + self._sheen_tint * (self._hue - 1)) * (1 - cos_d) ** 5
        body = (1 - self._spec_trans) * self._color * lobe / np.pi
        return np.asarray((1 - self._metallic) * (body + sheen) * wi[:, 2:])

    def _coat(self, wo: Doubles, wi: Doubles) -> Doubles:
        """Return the clearcoat: a quarter of Schlick's F for 0.04, GTR1, and G of alpha 0.25, without 1/(4·cos·cos)."""
        h = halfway(wo, wi)
        _, cos_t = fresnel.dielectric(dot(wo, h), self._eta)
        f = fresnel.schlick(
            np.where(self._eta > 1, dot(wo, h), cos_t), np.full((len(wo), 1), 0.04), np.ones((len(wo), 1))
        )
        a2 = self._coat_alpha**2
        d = (a2 - 1) / (np.pi * np.log(a2) * (1 + (a2 - 1) * h[:, 2] ** 2))
        quarter = np.full(len(wo), 0.25)
        g = masking(wo[:, 2], quarter, "ggx") * masking(wi[:, 2], quarter, "ggx")
        return np.asarray(self._clearcoat / 4 * f * (d * g * wi[:, 2])[:, None])

    def _refracted(self, wo: Doubles, wi: Doubles) -> Doubles:
        h, crosses, cos_o, cos_i = crossing(wo, wi, self._eta)
        f = fresnel.dielectric(np.where(crosses, cos_o, 1), self._eta)[0]
        g = shadowing(wo[:, 2], np.maximum(-wi[:, 2], 1e-9), self._alpha, "ggx", "separable")
        stretch = np.where(crosses, (cos_o + self._eta * cos_i) ** 2, 1)
        value = (1 - f) * np.abs(cos_i * cos_o) / wo[:, 2] * ggx.distribution(h, self._alpha) * g / stretch
        tint = (1 - self._metallic) * self._spec_trans * np.sqrt(self._color)
        return np.asarray(tint * np.where(crosses, value, 0)[:, None])


class Facets:
    """Reflection and, if `transmits`, refraction at sampled visible normals, by Fresnel's equations."""

    def __init__(self, alpha: Doubles, eta: Doubles, transmits: bool) -> None:
        self._alpha, self._eta, self._transmits = alpha, eta, transmits

    def draw(self, wo: Doubles, rng: np.random.Generator) -> Doubles:
        h = ggx.visible_normals(wo, self._alpha, rng.random((len(wo), 2)))
        cos_o = dot(wo, h)
        f, cos_t = fresnel.dielectric(cos_o, self._eta)
        on = unit(-wo / self._eta[:, None] + (cos_o / self._eta - cos_t)[:, None] * h)
        returns = (rng.random(len(wo)) < f) | (not self._transmits)
        drawn = np.where(returns[:, None], reflected(wo, h), on)
        lost = returns != (drawn[:, 2] > 0)  # ends up on the wrong side
        return np.where(lost[:, None], [1.0, 0.0, 0.0], drawn)

    def density(self, wo: Doubles, wi: Doubles) -> Doubles:
        up = wi[:, 2] > 0
        back = ggx.VisibleNormals(self._alpha).density(wo, np.where(up[:, None], wi, wo))
        if not self._transmits:
            return np.where(up, back, 0)
        f = fresnel.dielectric(dot(wo, halfway(wo, np.where(up[:, None], wi, wo))), self._eta)[0]
        h, crosses, cos_o, cos_i = crossing(wo, wi, self._eta)
        through = 1 - fresnel.dielectric(np.where(crosses, cos_o, 1), self._eta)[0]
        stretch = np.where(crosses, (cos_o + self._eta * cos_i) ** 2, 1)
        on = ggx.visible_density(wo, h, self._alpha) * through * self._eta**2 * np.abs(cos_i) / stretch
        return np.where(up, back * f, np.where(crosses, on, 0))


def crossing(wo: Doubles, wi: Doubles, eta: Doubles) -> tuple[Doubles, Bools, Doubles, Doubles]:
    """Return normals of the facets that refract wo to wi, whether any does, and both cosines."""
    h = wo + eta[:, None] * wi
    length = np.linalg.norm(h, axis=1, keepdims=True)
    h = h / np.where(length > 0, length, 1)
    h = np.where(h[:, 2:] < 0, -h, h)
    cos_o, cos_i = dot(wo, h), dot(wi, h)
    return h, (wo[:, 2] > 0) & (cos_o > 0) & (cos_i < 0) & (wi[:, 2] < 0), cos_o, cos_i
