"""What layers leave to what lies below them, in float64, by quadratures of clrt's own."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from clrt.scene.microfacets import albedos, shadowing

from . import sheen

Doubles = NDArray[np.float64]
Left = Callable[[Doubles], Doubles]
ALPHA_MIN = 1e-4
ROOTS = np.linspace(1e-3, 1, 1000)


def under_coat(strength: float, roughness: float) -> Left:
    """1 − strength·E, E of a single bounce with F0 = 0.04."""
    return lambda cosines: 1 - strength * gloss_albedo(cosines, roughness, 0.04)


def under_fibres(strength: float, roughness: float) -> Left:
    """1 − strength·E, E at most 1."""
    left = 1 - strength * np.minimum(sheen.albedo(ROOTS**2, max(roughness, 0.1)**-2), 1)
    return lambda cosines: np.interp(np.sqrt(cosines), ROOTS, left)


def gloss_albedo(cosines: Doubles, roughness: float, f0: float) -> Doubles:
    """(n,) what GGX reflects of light from there in a single bounce."""
    whole, grazing = single(cosines, roughness)
    return np.asarray(f0 * (whole - grazing) + grazing)


def lost(cosines: Doubles, roughness: float) -> Doubles:
    """(n,) what a single bounce with F = 1 loses."""
    return np.asarray(1 - single(cosines, roughness)[0])


def single(cosines: Doubles, roughness: float) -> tuple[Doubles, Doubles]:
    """(n,) `microfacets.albedos`, interpolated in √cos."""
    whole, grazing = tables(roughness)
    roots = np.sqrt(cosines)
    return np.interp(roots, ROOTS, whole), np.interp(roots, ROOTS, grazing)


@lru_cache
def tables(roughness: float) -> tuple[Doubles, Doubles]:
    return albedos(ROOTS**2, max(roughness**2, ALPHA_MIN), "height_correlated")


def mean(f: Left) -> float:
    """Over the hemisphere, weighted by the cosine."""
    t, weight = np.polynomial.legendre.leggauss(60)
    root = (t + 1) / 2
    return float(weight @ (f(root**2) * 2 * root**3))


def diffuse(color: tuple[float, float, float], metallic: float, roughness: float) -> Left:
    """r of the lobe of body and further bounces, in luminance, with an index of 1.5 (bsdf/metallic_roughness.cl)."""
    luminance, colors = np.array([0.2126, 0.7152, 0.0722]), np.array(color)
    fresnel, mean_lost = (1 + 20 * colors) / 21, mean(lambda c: lost(c, roughness))
    multiple = metallic * fresnel**2 * (1 - mean_lost) / (1 - fresnel * mean_lost)
    return lambda c: ((1 - metallic) * (luminance @ colors) * (1 - gloss_albedo(c, roughness, 0.04))
                      + (luminance @ multiple) * lost(c, roughness))


def left_to_diffuse(left: Left, r: Left) -> Left:
    """What a lobe r(wo)·r(wi)/(pi·mean r) is weighed by at wo and wi: left/√(mean r·left/mean r)."""
    scale = np.sqrt(mean(r) / mean(lambda c: r(c) * left(c)))
    return lambda cosines: scale * left(cosines)


def taken_from_gloss(left: Left, cosine: float, alpha: float, f0: float) -> float:
    """∫ (left(cos wo) − min(left(cos wo), left(cos wi))) f·cos wi dwi of GGX with a Schlick term.

    Over half vectors, tan θ = alpha·tan psi, by Gauss and Legendre's rule in the azimuth and psi.
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
    fresnel = f0 + (1 - f0) * np.maximum(1 - along * cos_h, 0)**5
    # D·cos θ dωh = 2·sin psi·cos psi dpsi dphi/(2·pi), and f·cos wi dwi = F·G·D·(wo·h)/cos wo dωh.
    f = np.where(lit, fresnel * g * along / cosine * 2 * np.sin(psi) * np.cos(psi), 0)
    nodes = np.linspace(0, 1, 4000)**2
    at = np.interp(cos_i, nodes, left(np.maximum(nodes, 1e-7)))
    taken = np.maximum(float(left(np.array([cosine]))[0]) - at, 0)
    return float(weight @ (f * taken) @ weight * np.pi / 8)
