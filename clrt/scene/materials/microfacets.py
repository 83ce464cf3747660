"""Directional albedo of single scattering at a GGX microfacet surface.

With F = 1 microfacets reflect all light, but some of it only after two bounces or more, and the usual single-scattering
BRDF omits that: the fraction loss(c) of light at a cosine c to the normal, which for alpha = 1 is up to 0.69. The
kernels approximate these albedos by fits (kernels/bsdf/ggx_albedo.cl); here they are computed exactly.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]


def albedo(cosines: Doubles, alpha: float, smith: str) -> Doubles:
    """Compute (n,) single-scattering albedos for F = 1 at cosines (n,) in (0, 1]; error below 1e-6."""
    return albedos(cosines, alpha, smith)[0]


def albedos(cosines: Doubles, alpha: float, smith: str) -> tuple[Doubles, Doubles]:
    """Compute (n,) single-scattering albedos at cosines (n,) in (0, 1] for F = 1, and for F = (1 − wo·h)^5.

    For Schlick's F with f0 and f90 the albedo is f0·(first − second) + f90·second.

    ∫ D·G·(wo·h)/cos wo dωh over the half vectors for which wi is above the horizon. For h, tan θ = alpha·tan psi, which
    makes D·cos θ dωh = 2·sin psi·cos psi dpsi dphi/(2·pi), and phi is its azimuth from wo. Gauss–Legendre nodes, cubed
    to concentrate where the integrand varies most: in phi at 90°, in psi at the horizon.
    """
    y, weight = np.polynomial.legendre.leggauss(32)
    phi, phi_weight = np.pi / 2 * (1 - y**3), 1.5 * y**2 * weight
    rest, psi_weight = ((1 - y) / 2) ** 3, 1.5 * ((1 - y) / 2) ** 2 * weight
    cosine = np.asarray(cosines, np.float64)[:, None, None]
    along = np.sqrt(1 - cosine**2) * np.cos(phi)[:, None]
    root = np.sqrt(along**2 + cosine**2)
    horizon = np.where(along > 0, (along + root) / cosine, cosine / (root - np.minimum(along, 0)))
    psi = np.arctan(horizon / alpha) * (1 - rest)
    slope = alpha * np.tan(psi)
    cos_i = np.maximum(2 * (cosine + along * slope) / (1 + slope**2) - cosine, 1e-300)
    visible = 2 * np.sin(psi) * (np.cos(psi) + alpha * along / cosine * np.sin(psi))
    reflected = visible * shadowing(cosine, cos_i, alpha, smith) * np.arctan(horizon / alpha)
    grazing = np.maximum(1 - (cosine + along * slope) / np.sqrt(1 + slope**2), 0) ** 5
    whole, part = (np.sum(value * psi_weight, axis=2) @ phi_weight for value in (reflected, reflected * grazing))
    return np.asarray(whole), np.asarray(part)


def shadowing(cos_o: Doubles, cos_i: Doubles, alpha: float, smith: str) -> Doubles:
    """Compute G2 by its name in `MetallicRoughness`: Smith's for GGX, height-correlated or separable (Heitz 2014, eq.
    99, 98), or Schlick's approximation of the latter (Karis 2013).
    """
    if smith.startswith("schlick"):
        k = schlick_k(alpha, smith)
        return np.asarray(cos_o * cos_i / ((cos_o * (1 - k) + k) * (cos_i * (1 - k) + k)))
    lambda_o, lambda_i = (np.sqrt(1 + alpha**2 * (1 / c**2 - 1)) / 2 - 0.5 for c in (cos_o, cos_i))
    if smith == "separable":
        return np.asarray(1 / ((1 + lambda_o) * (1 + lambda_i)))
    return np.asarray(1 / (1 + lambda_o + lambda_i))


def schlick_k(alpha: float, smith: str) -> float:
    """Return k of Schlick's approximation: (roughness + 1)²/8, or alpha/2 for "schlick_ibl"."""
    return float(alpha / 2 if smith == "schlick_ibl" else (np.sqrt(alpha) + 1) ** 2 / 8)
