"""Cook–Torrance with GGX in float64: the published formulas, and the microfacet albedo by quadrature."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from clrt.scene.materials.material_types import MetallicRoughness
from clrt.scene.materials.presets import F0_PRESETS
from clrt.scene.materials.textures import untextured

Doubles = NDArray[np.float64]


def cook_torrance(material: MetallicRoughness, wo: Doubles, wi: Doubles) -> Doubles:
    """Return f = F·G·D/(4 cos cos) + coupling·(1 − metallic)·color/pi, (n, 3).

    F is Schlick's, D that of Walter 2007 (eq. 33); the coupling is the one that the material names.
    """
    color, f0 = np.array(untextured(material.color)), np.full(3, ((material.ior - 1) / (material.ior + 1)) ** 2)
    metallic, roughness = untextured(material.metallic), untextured(material.roughness)
    if material.preset is not None:
        f0, metallic = np.array(F0_PRESETS[material.preset][0]), F0_PRESETS[material.preset][1]
        color = f0 if metallic else color
    body_f0 = f0
    f0 = (1 - metallic) * f0 + metallic * color
    h = (wo + wi) / np.linalg.norm(wo + wi, axis=1, keepdims=True)
    alpha, cos_h = roughness**2, h[:, 2]
    tan2_h = (1 - cos_h**2) / cos_h**2
    d = alpha**2 / (np.pi * cos_h**4 * (alpha**2 + tan2_h) ** 2)
    g = masking(material.smith, alpha, wo[:, 2], wi[:, 2])
    fresnel, enter, leave = (
        f0 + (1 - f0) * (1 - cosine) ** 5 for cosine in (np.sum(wi * h, axis=1, keepdims=True), wi[:, 2:], wo[:, 2:])
    )
    specular = (d * g / (4 * wo[:, 2] * wi[:, 2]))[:, None]
    coupling = {"fresnel": (1 - enter) * (1 - leave), "half_vector": 1 - fresnel}.get(material.coupled_by)
    if coupling is None:
        coupling = coupling_by_albedo(float(body_f0[0]), alpha, material.smith, wo[:, 2:], wi[:, 2:])
    return np.asarray(fresnel * specular + coupling * (1 - metallic) * color / np.pi)


def coupling_by_albedo(f0: float, alpha: float, smith: str, cos_o: Doubles, cos_i: Doubles) -> Doubles:
    """Return (1 − E(wi))(1 − E(wo))/(1 − mean E), E = f0·(first − second) + second of `albedos`, interpolated in
    √cos."""
    nodes = np.linspace(0.01, 1, 60)
    left = [1 - f0 * (whole - part) - part for whole, part in (albedos(alpha, c * c, smith, 300) for c in nodes)]
    spline = CubicSpline(nodes, left)
    t, weight = np.polynomial.legendre.leggauss(50)
    roots = (t + 1) / 2
    mean = weight @ (spline(roots) * 2 * roots**3)  # ∫ 2·cos·(1 − E) dcos, cos = root²
    return np.asarray(spline(np.sqrt(cos_o)) * spline(np.sqrt(cos_i)) / mean)


def masking(smith: str, alpha: float, cos_o: Doubles, cos_i: Doubles) -> Doubles:
    """Return G in one of its four forms: Heitz 2014 (eq. 99 and 72), Walter 2007 (eq. 34), Karis 2013 with its two
    k."""
    if smith.startswith("schlick"):
        k = (np.sqrt(alpha) + 1) ** 2 / 8 if smith == "schlick" else alpha / 2
        return np.asarray(cos_o / (cos_o * (1 - k) + k) * cos_i / (cos_i * (1 - k) + k))
    root_o, root_i = (np.sqrt(1 + alpha**2 * (1 - c**2) / c**2) for c in (cos_o, cos_i))
    if smith == "separable":
        return np.asarray(2 / (1 + root_o) * 2 / (1 + root_i))
    return np.asarray(2 / (root_o + root_i))


def bump_shadowing(unbent: Doubles, bent: Doubles, w: Doubles) -> float:
    """Return the bump shadowing factor of diffuse light from w: listing 12-1 of Estevez, Lecocq and Stein 2019."""
    slope, angle = (1 / float(v @ unbent / np.linalg.norm(v)) ** 2 - 1 for v in (bent, w))
    return 2 / (1 + np.sqrt(1 + min(slope / 8, 1) * angle)) if w @ unbent > 0 else 0.0


def albedo(alpha: float, cosine: float, smith: str, steps: int = 500) -> float:
    """Return the single-scattering albedo of microfacets with F = 1 in a white furnace."""
    return albedos(alpha, cosine, smith, steps)[0]


def albedos(alpha: float, cosine: float, smith: str, steps: int = 500) -> tuple[float, float]:
    """Return the single-scattering albedos of microfacets in a white furnace, with F = 1 and with F = (1 − wo·h)^5.

    ∫ f·cos wi dωi over half vectors, dωi = 4 (wo·h) dωh, with s from D·cos θh dωh = ds dphi/(2·pi),
    tan²θh = alpha²·s/(1 − s): the midpoint rule in phi and x, where 1 − s = (1 − x)³ to reach steep half vectors.
    """
    x = (np.arange(steps) + 0.5)[:, None] / steps
    phi = np.pi * (np.arange(steps) + 0.5) / steps
    rest = (1 - x) ** 3
    tangent = alpha * np.sqrt((1 - rest) / rest)
    cos_h = 1 / np.sqrt(1 + tangent**2)
    cos_oh = cosine * cos_h + np.sqrt(1 - cosine**2) * tangent * cos_h * np.cos(phi)
    cos_i = 2 * cos_oh * cos_h - cosine
    lit = (cos_oh > 0) & (cos_i > 0)
    g = masking(smith, alpha, np.full(lit.shape, cosine)[lit], cos_i[lit])
    reflected = g * (3 * (1 - x) ** 2 * cos_oh / (cosine * cos_h))[lit] / steps**2
    return float(np.sum(reflected)), float(np.sum(reflected * (1 - cos_oh[lit]) ** 5))
