"""Light that single scattering between the microfacets of glass loses, after docs/scene-format.md.

Light that single scattering loses returns in two steps: its term is divided by 1 − min(loss(wo), loss(wi)), and the
rest leaves diffusely, by rest(wo)·rest(wi)/(pi·m), where m = Σ n²·∫ rest·2c dc over n² of the side that light arrives
on. Losses are sums over visible normals, instead of the kernels' tables.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ....scene.materials.microfacets import Doubles
from .layer_tables import ROOTS, gloss, means_of, normals


def losses(ior: float, alpha: float) -> tuple[Doubles, Doubles]:
    """Return (SIDE, 4) at ROOTS: loss and rest outside, loss and rest inside; and the m of both sides."""
    single = [scattered(eta, alpha) for eta in (ior, 1 / ior)]
    loss = [1 - sum(weight.sum(axis=1) for weight, _ in parts) for parts in single]
    rest = []
    for side, parts in enumerate(single):
        kept = sum(
            np.sum(weight / (1 - np.minimum(loss[side][:, None], _at(loss[there], cosine))), axis=1)
            for (weight, cosine), there in zip(parts, (side, 1 - side))
        )
        rest.append(np.maximum(1 - kept, 0))
    table = np.column_stack([loss[0], rest[0], loss[1], rest[1]])
    means = means_of(table)
    return table, (means[1] + ior**2 * means[3]) / np.array([1, ior**2])


def sheet_losses(alpha: float) -> tuple[Doubles, float]:
    """Return (SIDE, 2), loss and rest, and m of a thin sheet, which loses as much as a mirror of the same roughness."""
    cos_i, weight, _ = gloss(alpha, "height_correlated")
    loss = 1 - weight.sum(axis=1)
    rest = 1 - np.sum(weight / (1 - np.minimum(loss[:, None], _at(loss, cos_i))), axis=1)
    table = np.column_stack([loss, np.maximum(rest, 0)])
    return table, float(means_of(table)[1])


def scattered(eta: float, alpha: float, roots: Doubles = ROOTS) -> list[tuple[Doubles, Doubles]]:
    """Return fractions of light and their cosines, (n, points) each, reflected and refracted in one bounce from
    `roots` (n,) of cosines."""
    o = (roots**2)[:, None]
    h, cos_h = normals(alpha, roots)
    cos_t = np.sqrt(np.maximum(1 - (1 - cos_h**2) / eta**2, 0))
    f = np.where(cos_t > 0, fresnel(cos_h, cos_t, eta), 1)
    parts = []
    for share, cosine in ((f, 2 * cos_h * h - o), (1 - f, o / eta - (cos_h / eta - cos_t) * h)):
        lambda_o, lambda_i = (np.sqrt(1 + alpha**2 * (1 / np.maximum(c, 1e-9) ** 2 - 1)) / 2 - 0.5 for c in (o, cosine))
        seen = np.where(cosine > 0, (1 + lambda_o) / (1 + lambda_o + lambda_i), 0)
        parts.append((share * seen / h.shape[1], cosine))
    return parts


def fresnel(cos_o: Any, cos_t: Any, eta: float) -> Any:
    """Return the unpolarized Fresnel reflectance; eta: of the far side, relative."""
    parallel, perpendicular = ((a * cos_o - b * cos_t) / (a * cos_o + b * cos_t) for a, b in ((eta, 1), (1, eta)))
    return (parallel * parallel + perpendicular * perpendicular) / 2


def _at(values: Doubles, cosines: Doubles) -> Doubles:
    return np.asarray(np.interp(np.sqrt(np.maximum(cosines, 0)), ROOTS, values))
