"""Beckmann microfacets: Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces", eq. 25, and the
rational approximation there of Smith's masking, eq. 26."""

from __future__ import annotations

import numpy as np

from ..vectors import Doubles
from .scattering import halfway


def reflection(wo: Doubles, wi: Doubles, alpha: Doubles) -> Doubles:
    """Return D·G/(4·cos wo) (n,), so f·cos wi for F = 1, with height-correlated G; 0 below the horizon."""
    up = (wo[:, 2] > 0) & (wi[:, 2] > 0)
    o, i = np.where(up, wo[:, 2], 1), np.where(up, wi[:, 2], 1)
    z2 = np.maximum(halfway(wo, np.where(up[:, None], wi, wo))[:, 2] ** 2, 1e-300)
    d = np.exp(-(1 - z2) / (alpha**2 * z2)) / (np.pi * alpha**2 * z2**2)
    return np.where(up, d / (1 + smith_lambda(o, alpha) + smith_lambda(i, alpha)) / (4 * o), 0)


def smith_lambda(cosine: Doubles, alpha: Doubles) -> Doubles:
    """Return Λ = 1/G1 − 1 of a cosine."""
    a = cosine / (alpha * np.sqrt(np.maximum(1 - cosine**2, 1e-300)))
    a = np.minimum(a, 1e100)
    g1 = np.where(a < 1.6, (3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2), 1)
    return np.asarray(np.maximum(1 / g1 - 1, 0))
