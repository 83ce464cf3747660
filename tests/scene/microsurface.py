"""A random walk between the microfacets of rough glass, in float64: the Smith model of Heitz et al. (2016,
"Multiple-Scattering Microfacet BSDFs with the Smith Model", sections 3 and 4), with uniform heights between 0 and 1."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
Masks = NDArray[np.bool_]
STEPS = 200


def reflected_part(alpha: float, eta: float, cosine: float, count: int, rng: np.random.Generator) -> float:
    """Return the share of light from this angle that leaves on the side of incidence, after all bounces; the index on
    the other side is eta times as large."""
    w = np.tile([np.sqrt(1 - cosine**2), 0, -cosine], (count, 1))
    height, outside, going = np.ones(count), np.ones(count, bool), np.arange(count)
    for _ in range(STEPS):
        sign = np.where(outside[going], 1.0, -1.0)[:, None]
        here = np.where(outside[going], height[going], 1 - height[going])
        here = _next_height(sign * w[going], here, alpha, rng)
        stays = here <= 1
        going, sign, here = going[stays], sign[stays], here[stays]
        if not len(going):
            return float(outside.mean())
        side = outside[going]
        turned, reflected = _scattered(-sign * w[going], alpha, np.where(side, eta, 1 / eta), rng)
        w[going], height[going] = sign * turned, np.where(side, here, 1 - here)
        outside[going] = side == reflected
    raise AssertionError(f"{len(going)} of {count} walks have not ended")


def _lambda(w: Doubles, alpha: float) -> Doubles:
    """Return Smith's Lambda of directions (n, 3), including downward ones."""
    root = np.sqrt(1 + alpha**2 * (w[:, 0] ** 2 + w[:, 1] ** 2) / np.maximum(w[:, 2] ** 2, 1e-30))
    return np.asarray(np.where(w[:, 2] > 0, root - 1, -root - 1) / 2)


def _next_height(w: Doubles, height: Doubles, alpha: float, rng: np.random.Generator) -> Doubles:
    """Return the next height at which rays hit the surface, infinite if they leave (algorithm 1)."""
    u, shadow = rng.random(len(w)), _lambda(w, alpha)
    up = w[:, 2] > 0
    leaves = up & (u > 1 - np.maximum(height, 1e-300) ** np.where(up, shadow, 1))
    exponent = 1 / np.where(np.abs(shadow) < 1e-12, 1e-12, shadow)
    with np.errstate(over="ignore"):
        return np.where(leaves, np.inf, np.clip(height * (1 - u) ** -exponent, 0, 1))


def _scattered(wo: Doubles, alpha: float, eta: Doubles, rng: np.random.Generator) -> tuple[Doubles, Masks]:
    """Reflect or refract light that travels along −wo at a visible normal, (n, 3); wo may point down."""
    stretched = wo * [alpha, alpha, 1]
    stretched /= np.linalg.norm(stretched, axis=1, keepdims=True)
    turn, z = 2 * np.pi * rng.random(len(wo)), 1 - rng.random(len(wo)) * (1 + stretched[:, 2])
    radius = np.sqrt(np.maximum(1 - z * z, 0))
    h = (np.column_stack([radius * np.cos(turn), radius * np.sin(turn), z]) + stretched) * [alpha, alpha, 1]
    h[:, 2] = np.maximum(h[:, 2], 1e-30)
    h /= np.linalg.norm(h, axis=1, keepdims=True)
    cosine = np.maximum(np.sum(wo * h, axis=1), 0)
    cos_t = np.sqrt(np.maximum(1 - (1 - cosine**2) / eta**2, 0))
    parallel = (eta * cosine - cos_t) / (eta * cosine + cos_t)
    perpendicular = (cosine - eta * cos_t) / (cosine + eta * cos_t)
    reflected = rng.random(len(wo)) < np.where(cos_t > 0, (parallel**2 + perpendicular**2) / 2, 1)
    back, on = 2 * cosine[:, None] * h - wo, (cosine / eta - cos_t)[:, None] * h - wo / eta[:, None]
    turned = np.where(reflected[:, None], back, on)
    return turned / np.linalg.norm(turned, axis=1, keepdims=True), reflected
