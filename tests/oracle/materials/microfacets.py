"""Microfacets of either distribution, "ggx" or "beckmann": D, and Smith's terms."""

from __future__ import annotations

import numpy as np

from ..vectors import Doubles
from . import beckmann, ggx
from .scattering import halfway


def distribution(h: Doubles, alpha: Doubles, kind: str) -> Doubles:
    """Return D (n,) of normals (n, 3)."""
    return ggx.distribution(h, alpha) if kind == "ggx" else beckmann.distribution(h, alpha)


def masking(cosine: Doubles, alpha: Doubles, kind: str) -> Doubles:
    """Return G1; 0 below the horizon."""
    smith = ggx.smith_lambda if kind == "ggx" else beckmann.smith_lambda
    return np.where(cosine > 0, 1 / (1 + smith(np.maximum(cosine, 1e-9), alpha)), 0)


def shadowing(cos_o: Doubles, cos_i: Doubles, alpha: Doubles, kind: str, smith: str) -> Doubles:
    """Return G2 of cosines above 0: 1/(1 + Λo + Λi), or the separable G1·G1."""
    o, i = (masking(cosine, alpha, kind) for cosine in (cos_o, cos_i))
    return np.asarray(o * i if smith == "separable" else 1 / (1 / o + 1 / i - 1))


def reflection(wo: Doubles, wi: Doubles, alpha: Doubles, kind: str, smith: str) -> Doubles:
    """Return D·G/(4·cos wo) (n,), so f·cos wi for F = 1; 0 below the horizon."""
    up = (wo[:, 2] > 0) & (wi[:, 2] > 0)
    o, i = np.where(up, wo[:, 2], 1), np.where(up, wi[:, 2], 1)
    h = halfway(wo, np.where(up[:, None], wi, wo))
    return np.where(up, distribution(h, alpha, kind) * shadowing(o, i, alpha, kind, smith) / (4 * o), 0)
