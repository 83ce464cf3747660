"""Transmittance of material layers and the reflection of the base below them, in float64."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from clrt.scene.materials.microfacets import albedos, shadowing

from . import sheen

Doubles = NDArray[np.float64]
Left = Callable[[Doubles], Doubles]
ALPHA_MIN = 1e-4
ROOTS = np.linspace(1e-3, 1, 1000)


def under_coat(strength: float, roughness: float) -> Left:
    """Return 1 − strength·E, with E the single-scattering albedo for F0 = 0.04."""
    return lambda cosines: 1 - strength * gloss_albedo(cosines, roughness, 0.04)


def under_fibres(strength: float, roughness: float) -> Left:
    """Return 1 − strength·E, with E the bounded sheen albedo."""
    left = 1 - strength * sheen.bounded_albedo(ROOTS**2, max(roughness, 0.1) ** -2)
    return lambda cosines: np.interp(np.sqrt(cosines), ROOTS, left)


def gloss_albedo(cosines: Doubles, roughness: float, f0: float) -> Doubles:
    """Return the single-scattering directional albedo of GGX, (n,)."""
    whole, grazing = single(cosines, roughness)
    return np.asarray(f0 * (whole - grazing) + grazing)


def lost(cosines: Doubles, roughness: float) -> Doubles:
    """Return the energy lost by a single bounce with F = 1, (n,)."""
    return np.asarray(1 - single(cosines, roughness)[0])


def single(cosines: Doubles, roughness: float) -> tuple[Doubles, Doubles]:
    """Return `microfacets.albedos`, interpolated in √cos, (n,) each."""
    whole, grazing = tables(roughness)
    roots = np.sqrt(cosines)
    return np.interp(roots, ROOTS, whole), np.interp(roots, ROOTS, grazing)


@lru_cache
def tables(roughness: float) -> tuple[Doubles, Doubles]:
    return albedos(ROOTS**2, max(roughness**2, ALPHA_MIN), "height_correlated")


def mean(f: Left) -> Doubles:
    """Return the cosine-weighted hemispherical mean of f, whose values are (n, ...)."""
    t, weight = np.polynomial.legendre.leggauss(60)
    root = (t + 1) / 2
    return np.asarray(np.tensordot(weight * 2 * root**3, f(root**2), 1))


class Below:
    """Base of index 1.5 with multiple scattering below layers: gloss·min(T, T) + R(wo)·R(wi)/(pi·mean R),
    R = T·r + what min takes from the gloss (bsdf/layers.cl). `left` is T."""

    def __init__(self, color: tuple[float, float, float], metallic: float, roughness: float, left: Left) -> None:
        self.roughness, self.metallic, self.colors = roughness, metallic, np.array(color)
        self.f0 = 0.04 + metallic * (self.colors - 0.04)
        steps = np.linspace(0.02, 1, 50)
        taken = [[taken_from_gloss(left, root**2, roughness**2, f0) for f0 in self.f0] for root in steps]
        self.steps, self.taken_at = np.append(0, steps), np.concatenate([np.zeros((1, 3)), taken])
        self.mean = mean(lambda cosines: left(cosines)[:, None] * self.r(cosines) + self.taken(cosines))

    def r(self, cosines: Doubles) -> Doubles:
        """Return the base's albedo without the single-scattering gloss, (n, 3)."""
        fresnel, mean_lost = (1 + 20 * self.colors) / 21, mean(lambda c: lost(c, self.roughness))
        multiple = self.metallic * fresnel**2 * (1 - mean_lost) / (1 - fresnel * mean_lost)
        body = (1 - self.metallic) * self.colors * (1 - gloss_albedo(cosines, self.roughness, 0.04))[:, None]
        return np.asarray(body + multiple * lost(cosines, self.roughness)[:, None])

    def taken(self, cosines: Doubles) -> Doubles:
        """Return what min takes from the gloss, interpolated in √cos, (n, 3)."""
        return np.column_stack([np.interp(np.sqrt(cosines), self.steps, each) for each in self.taken_at.T])

    def value(self, gloss: Doubles, cos_o: Doubles, cos_i: Doubles, left_o: Doubles, left_i: Doubles) -> Doubles:
        """Return f·cos wi (n, 3), given the gloss without layers (n, 3) and the cosines and T of wo and wi, (n,)
        each."""
        each = [
            left[:, None] * self.r(cosines) + self.taken(cosines)
            for left, cosines in ((left_o, cos_o), (left_i, cos_i))
        ]
        diffuse = each[0] * each[1] * cos_i[:, None] / (np.pi * self.mean)
        return np.asarray(np.minimum(left_o, left_i)[:, None] * gloss + diffuse)


def taken_from_gloss(left: Left, cosine: float, alpha: float, f0: float) -> float:
    """Return ∫ (left(cos wo) − min(left(cos wo), left(cos wi))) f·cos wi dwi of GGX with a Schlick term.

    Over half vectors, tan θ = alpha·tan psi, by Gauss–Legendre quadrature in the azimuth and psi.
    """
    t, weight = np.polynomial.legendre.leggauss(200)
    phi, psi = np.pi * (t + 1)[:, None] / 2, np.pi * (t + 1) / 4
    tangent = alpha * np.tan(psi)
    cos_h = 1 / np.sqrt(1 + tangent**2)
    along = np.sqrt(1 - cosine**2) * np.cos(phi) * tangent + cosine
    cos_i = 2 * along * cos_h**2 - cosine
    lit = (along > 0) & (cos_i > 1e-6)
    cos_i = np.where(lit, cos_i, 1)
    g = shadowing(np.array(cosine), cos_i, alpha, "height_correlated")
    fresnel = f0 + (1 - f0) * np.maximum(1 - along * cos_h, 0) ** 5
    # D·cos θ dωh = 2·sin psi·cos psi dpsi dphi/(2·pi), and f·cos wi dwi = F·G·D·(wo·h)/cos wo dωh.
    f = np.where(lit, fresnel * g * along / cosine * 2 * np.sin(psi) * np.cos(psi), 0)
    nodes = np.linspace(0, 1, 4000) ** 2
    at = np.interp(cos_i, nodes, left(np.maximum(nodes, 1e-7)))
    taken = np.maximum(float(left(np.array([cosine]))[0]) - at, 0)
    return float(weight @ (f * taken) @ weight * np.pi / 8)
