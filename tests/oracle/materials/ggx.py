"""GGX microfacets: Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces"; Heitz 2014,
"Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs"; Heitz 2018, "Sampling the GGX Distribution of
Visible Normals"."""

from __future__ import annotations

import numpy as np

from ..vectors import Doubles, dot, unit
from .scattering import halfway, reflected

#: The smallest alpha, as documented.
LEAST = 1e-4


def alpha_of(roughness: Doubles) -> Doubles:
    """Return alpha (n,) of roughnesses (n,)."""
    return np.maximum(roughness**2, LEAST)


def distribution(h: Doubles, alpha: Doubles) -> Doubles:
    """Return D (Walter 2007, eq. 33)."""
    z2 = h[:, 2] ** 2
    return np.where(h[:, 2] > 0, alpha**2 / (np.pi * (1 - z2 + alpha**2 * z2) ** 2), 0)


def smith_lambda(cosine: Doubles, alpha: Doubles) -> Doubles:
    """Return Λ of |cosine| (Heitz 2014, eq. 72)."""
    c2 = np.maximum(cosine**2, 1e-300)
    return np.asarray((np.sqrt(1 + alpha**2 * (1 - c2) / c2) - 1) / 2)


def shadowing(cos_o: Doubles, cos_i: Doubles, alpha: Doubles, smith: str = "height_correlated") -> Doubles:
    """Return G2 on one side: Heitz 2014, eq. 99 (height-correlated) and 98 (separable); Schlick's form with k of
    (roughness + 1)²/8 or alpha/2 (Karis 2013, "Real Shading in Unreal Engine 4")."""
    if smith.startswith("schlick"):
        k = alpha / 2 if smith == "schlick_ibl" else (np.sqrt(alpha) + 1) ** 2 / 8
        return np.asarray(cos_o / (cos_o * (1 - k) + k) * cos_i / (cos_i * (1 - k) + k))
    lambda_o, lambda_i = smith_lambda(cos_o, alpha), smith_lambda(cos_i, alpha)
    if smith == "separable":
        return np.asarray(1 / ((1 + lambda_o) * (1 + lambda_i)))
    return np.asarray(1 / (1 + lambda_o + lambda_i))


def reflection(wo: Doubles, wi: Doubles, alpha: Doubles, smith: str = "height_correlated") -> Doubles:
    """Return D·G/(4·cos wo) (n,), so f·cos wi for F = 1 (Walter 2007, eq. 20); 0 below the horizon."""
    up = (wo[:, 2] > 0) & (wi[:, 2] > 0)
    o, i = np.where(up, wo[:, 2], 1), np.where(up, wi[:, 2], 1)
    h = halfway(wo, np.where(up[:, None], wi, wo))
    return np.where(up, distribution(h, alpha) * shadowing(o, i, alpha, smith) / (4 * o), 0)


class VisibleNormals:
    """Reflection at sampled normals that are visible from wo."""

    def __init__(self, alpha: Doubles) -> None:
        self._alpha = alpha

    def draw(self, wo: Doubles, rng: np.random.Generator) -> Doubles:
        return reflected(wo, visible_normals(wo, self._alpha, rng.random((len(wo), 2))))

    def density(self, wo: Doubles, wi: Doubles) -> Doubles:
        h = halfway(wo, wi)
        h = np.where(h[:, 2:] < 0, -h, h)
        cosine = dot(wo, h)
        d = visible_density(wo, h, self._alpha)
        return np.divide(d, 4 * cosine, out=np.zeros_like(d), where=cosine > 0)


def visible_density(wo: Doubles, h: Doubles, alpha: Doubles) -> Doubles:
    """Return the pdf of visible normals (Heitz 2018, eq. 3)."""
    g1 = 1 / (1 + smith_lambda(wo[:, 2], alpha))
    return np.asarray(g1 * np.maximum(dot(wo, h), 0) * distribution(h, alpha) / np.maximum(wo[:, 2], 1e-300))


def visible_normals(wo: Doubles, alpha: Doubles, u: Doubles) -> Doubles:
    """Return normals (n, 3) from numbers (n, 2) in [0, 1) (Heitz 2018, listing 1)."""
    v = unit(wo * np.column_stack([alpha, alpha, np.ones_like(alpha)]))
    across = np.hypot(v[:, 0], v[:, 1])
    steep = across < 1e-12
    safe = np.where(steep, 1, across)
    t1 = np.column_stack([np.where(steep, 1, -v[:, 1] / safe), np.where(steep, 0, v[:, 0] / safe), np.zeros_like(safe)])
    t2 = np.cross(v, t1)
    r, phi = np.sqrt(u[:, 0]), 2 * np.pi * u[:, 1]
    x, s = r * np.cos(phi), (1 + v[:, 2]) / 2
    y = (1 - s) * np.sqrt(np.maximum(1 - x * x, 0)) + s * r * np.sin(phi)
    h = x[:, None] * t1 + y[:, None] * t2 + np.sqrt(np.maximum(1 - x * x - y * y, 0))[:, None] * v
    return unit(np.column_stack([alpha * h[:, 0], alpha * h[:, 1], np.maximum(h[:, 2], 1e-300)]))


def visible_nodes(cosine: float, alpha: float, count: int) -> tuple[Doubles, Doubles, Doubles]:
    """Return a quadrature over the normals visible from an angle: wo (n, 3), h (n, 3), and weights (n,) that sum to 1.

    A normal's first number is sin² of an angle, in which it is smooth; count: nodes for each number.
    """
    x, weights = np.polynomial.legendre.leggauss(count)
    angle, turn = np.meshgrid((x + 1) * np.pi / 4, (np.arange(count) + 0.5) / count, indexing="ij")
    u = np.column_stack([np.sin(angle).ravel() ** 2, turn.ravel()])
    wo = np.tile([np.sqrt(1 - cosine**2), 0.0, cosine], (len(u), 1))
    share = (np.sin(2 * angle) * weights[:, None] * np.pi / 4 / count).ravel()
    return wo, visible_normals(wo, np.full(len(u), alpha), u), share
