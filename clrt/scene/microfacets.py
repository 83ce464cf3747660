"""What GGX loses by following light for one bounce only, as a polynomial that a kernel can evaluate.

With F = 1 microfacets reflect all light, but part of it only after they met it twice or more, and the usual
single-bounce f leaves that out: of light from an angle of cosine c to the normal the part loss(c), which for
alpha = 1 is up to 0.69. Kulla and Conty (2017, "Revisiting Physically Based Shading at Imageworks") give it back by a
reciprocal lobe whose albedo is just that: loss(cos wo)·loss(cos wi)/(pi·mean), mean = ∫ loss(c)·2c dc.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]

#: Coefficients of the polynomial. The loss is then off by less than 1e-4, by 5e-4 for "schlick_ibl".
COEFFICIENTS = 12


class Loss(NamedTuple):
    """loss(c) = max(0, (1 − q)·Σ coefficients[k]·x^k), q = c/(c + width), x = 2·sqrt(q·(1 + width)) − 1.

    q brings the peak, at c ≈ alpha, to the same place for every alpha, and 1 − q falls as the loss behind it does; the
    root takes in the slope of c·log c at c = 0. x runs from −1 to 1.
    """

    width: float
    coefficients: tuple[float, ...]
    mean: float

    def at(self, cosines: Doubles) -> Doubles:
        """The loss at cosines in (0, 1], as the kernel computes it."""
        q = cosines / (cosines + self.width)
        x = 2 * np.sqrt(q * (1 + self.width)) - 1
        return np.asarray(np.maximum((1 - q) * np.polynomial.polynomial.polyval(x, self.coefficients), 0))


@lru_cache
def fitted_loss(alpha: float, smith: str) -> Loss:
    """The loss of GGX with this alpha and form of shadowing (see `shadowing`), interpolated at Chebyshev points."""
    x = np.polynomial.chebyshev.chebpts1(COEFFICIENTS)
    width = 16 * schlick_k(alpha, smith) if smith.startswith("schlick") else 4 * alpha
    q = (x + 1)**2 / (4 * (1 + width))
    values = (1 - albedo(width * q / (1 - q), alpha, smith)) / (1 - q)
    coefficients = np.linalg.solve(np.polynomial.polynomial.polyvander(x, COEFFICIENTS - 1), values)
    loss = Loss(width, tuple(coefficients.astype(np.float32).tolist()), 0.0)
    steps = 1000    # of log c, in which the integrand is smooth for every alpha
    cosines = np.exp(-16 * (np.arange(steps) + 0.5) / steps)
    return loss._replace(mean=float(np.mean(2 * cosines**2 * loss.at(cosines))) * 16)


def multiple_scattering(f0: tuple[float, ...], mean: float) -> tuple[float, ...]:
    """The lobe's factor in each channel: what is reflected after two or more bounces, over the mean loss.

    Every bounce takes Schlick's F in the cosine-weighted mean over the hemisphere, f0 + (1 − f0)/21, and after each the
    part 1 − mean of the light leaves: a geometric series from the second bounce on, 1 for F = 1.
    """
    averages = [f + (1 - f) / 21 for f in f0]
    return tuple(f * f * (1 - mean) / (1 - f * mean) / mean for f in averages)


def albedo(cosines: Doubles, alpha: float, smith: str) -> Doubles:
    """(n,) of cosines (n,) in (0, 1]: what a single bounce with F = 1 reflects of light from there; error below 1e-6.

    ∫ D·G·(wo·h)/cos wo dωh over the half vectors for which wi is above the horizon. Of h, tan θ = alpha·tan psi, which
    makes D·cos θ dωh = 2·sin psi·cos psi dpsi dphi/(2·pi), and phi is its azimuth from wo. Gauss–Legendre points,
    gathered by cubes where the integrand bends: in phi at 90°, in psi at the horizon.
    """
    y, weight = np.polynomial.legendre.leggauss(32)
    phi, phi_weight = np.pi / 2 * (1 - y**3), 1.5 * y**2 * weight
    rest, psi_weight = ((1 - y) / 2)**3, 1.5 * ((1 - y) / 2)**2 * weight
    cosine = np.asarray(cosines, np.float64)[:, None, None]
    along = np.sqrt(1 - cosine**2) * np.cos(phi)[:, None]
    root = np.sqrt(along**2 + cosine**2)
    horizon = np.where(along > 0, (along + root) / cosine, cosine / (root - np.minimum(along, 0)))
    psi = np.arctan(horizon / alpha) * (1 - rest)
    slope = alpha * np.tan(psi)
    cos_i = np.maximum(2 * (cosine + along * slope) / (1 + slope**2) - cosine, 1e-300)
    visible = 2 * np.sin(psi) * (np.cos(psi) + alpha * along / cosine * np.sin(psi))
    reflected = visible * shadowing(cosine, cos_i, alpha, smith) * np.arctan(horizon / alpha)
    return np.asarray(np.sum(reflected * psi_weight, axis=2) @ phi_weight)


def shadowing(cos_o: Doubles, cos_i: Doubles, alpha: float, smith: str) -> Doubles:
    """G2 by its name in `MetallicRoughness`: Smith's of GGX, height-correlated or separable (Heitz 2014, eq. 99, 98),
    or Schlick's form of the latter (Karis 2013).
    """
    if smith.startswith("schlick"):
        k = schlick_k(alpha, smith)
        return np.asarray(cos_o * cos_i / ((cos_o * (1 - k) + k) * (cos_i * (1 - k) + k)))
    lambda_o, lambda_i = (np.sqrt(1 + alpha**2 * (1 / c**2 - 1)) / 2 - 0.5 for c in (cos_o, cos_i))
    if smith == "separable":
        return np.asarray(1 / ((1 + lambda_o) * (1 + lambda_i)))
    return np.asarray(1 / (1 + lambda_o + lambda_i))


def schlick_k(alpha: float, smith: str) -> float:
    """k of Schlick's form: (roughness + 1)²/8, or alpha/2 for "schlick_ibl"."""
    return float(alpha / 2 if smith == "schlick_ibl" else (np.sqrt(alpha) + 1)**2 / 8)
