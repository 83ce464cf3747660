"""Beckmann microfacets: Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces", eq. 25, and the
rational approximation there of Smith's masking, eq. 26."""

from __future__ import annotations

import numpy as np

from ..vectors import Doubles


def distribution(h: Doubles, alpha: Doubles) -> Doubles:
    """Return D (eq. 25)."""
    z2 = np.maximum(h[:, 2] ** 2, 1e-300)
    return np.where(h[:, 2] > 0, np.exp(-(1 - z2) / (alpha**2 * z2)) / (np.pi * alpha**2 * z2**2), 0)


def smith_lambda(cosine: Doubles, alpha: Doubles) -> Doubles:
    """Return Λ = 1/G1 − 1 of a cosine."""
    a = cosine / (alpha * np.sqrt(np.maximum(1 - cosine**2, 1e-300)))
    a = np.minimum(a, 1e100)
    g1 = np.where(a < 1.6, (3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2), 1)
    return np.asarray(np.maximum(1 / g1 - 1, 0))
