"""Fits the directional albedos of GGX that kernels/bsdf/ggx_albedo.cl evaluates, and prints a table file of them.

`python -m clrt.bench.numerics.albedo_tables height_correlated > kernels/bsdf/albedo_height_correlated.cl`
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from textwrap import wrap
from typing import NamedTuple, get_args

import numpy as np
from numpy.polynomial import chebyshev, polynomial
from numpy.typing import NDArray

from ...scene.materials.metallic_roughness import Smith
from ...scene.materials.microfacets import albedos, schlick_k

Doubles = NDArray[np.float64]
#: Polynomial terms in x and y, for the loss and for the Fresnel part; terms in y, for their hemispherical means.
LOSS, FRESNEL, MEAN_LOSS, MEAN_FRESNEL = (8, 8), (8, 6), 12, 9
ROUGHNESSES = np.linspace(0.01, 1, 60)
COSINES = np.concatenate([np.geomspace(1e-5, 0.01, 30), np.geomspace(0.011, 0.1, 30), np.linspace(0.11, 1, 60)])
#: Added to the loss in the weights, so that errors of its root count where it is small, as the means depend on them.
SMALL = 0.01
#: Iterations of reweighting towards the minimax fit, and the weight of small errors relative to the largest.
ROUNDS, FLOOR = 60, 0.05
INDENT = "    "


class Table(NamedTuple):
    """Coefficients by power: `loss` and `fresnel` as [x][y], the means as [y]."""

    loss: Doubles
    fresnel: Doubles
    mean_loss: Doubles
    mean_fresnel: Doubles


def fit_table(smith: Smith) -> Table:
    """Fit one form of masking–shadowing over all roughnesses and angles."""
    alpha, root_y = ROUGHNESSES[:, None] ** 2, 2 * np.sqrt(ROUGHNESSES) - 1
    exact = np.array([albedos(COSINES, a, smith) for a in alpha[:, 0]])
    loss, grazing = np.maximum(1 - exact[:, 0], 0), exact[:, 1]
    x, q = stretched(COSINES, loss_width(alpha, smith))
    target, weight = (loss / (1 - q), 1 - q)
    if is_squared(smith):
        target, weight = np.sqrt(loss) / (1 - q), 2 * (1 - q) * np.sqrt(loss + SMALL * (1 - q) ** 2)
    loss_fit = _fit(x, 2 * ROUGHNESSES - 1, target, weight, LOSS)
    x, _ = stretched(COSINES, 2 * alpha)
    root = np.maximum(grazing / (1 - loss), 1e-12) ** 0.2
    weight = 5 * root**4 * alpha * (1 - loss)
    fresnel_fit = _fit(x, root_y, (1 - root - COSINES) / alpha, weight, FRESNEL)
    table = Table(loss_fit, fresnel_fit, np.zeros(1), np.zeros(1))
    means = np.array([_means(table, a, smith) for a in alpha[:, 0]])
    mean_loss = means[:, 0] / mean_scale(alpha[:, 0], smith)
    return table._replace(
        mean_loss=_fit_mean(root_y, mean_loss, MEAN_LOSS), mean_fresnel=_fit_mean(root_y, means[:, 1], MEAN_FRESNEL)
    )


def is_squared(smith: Smith) -> bool:
    """Return whether the loss is fitted as the square of a polynomial: behind its peak, Smith's falls with 1/cos²."""
    return not smith.startswith("schlick")


def stretched(cosines: Doubles, width: Doubles) -> tuple[Doubles, Doubles]:
    """Return x and q for the cosines: features at cosines around `width` map to the same x for every width."""
    q = cosines / (cosines + width)
    return 2 * np.sqrt(q * (1 + width)) - 1, q


def loss_width(alpha: Doubles, smith: Smith) -> Doubles:
    """Return the width of the loss in cos θ: 2·alpha, or 16·k and 32·k for Schlick's forms."""
    if is_squared(smith):
        return 2 * alpha
    return np.asarray(np.vectorize(schlick_k)(alpha, smith) * (16 if smith == "schlick" else 32))


def mean_scale(alpha: Doubles, smith: Smith) -> Doubles:
    """Return the asymptotic behavior of the mean loss for small alpha."""
    if is_squared(smith):
        return np.asarray(alpha**2 * np.log1p(alpha**-2.0))
    k = np.vectorize(schlick_k)(alpha, smith)
    return np.asarray(k * np.log1p(1 / k))


def evaluate(table: Table, cosines: Doubles, alpha: float, smith: Smith) -> tuple[Doubles, Doubles]:
    """Return the loss and the Fresnel part at cosines (n,), as the kernel computes them."""
    roughness = np.sqrt(alpha)
    x, q = stretched(cosines, loss_width(np.asarray(alpha), smith))
    root = np.maximum((1 - q) * polynomial.polyval(x, polynomial.polyval(2 * roughness - 1, table.loss.T)), 0)
    loss = root**2 if is_squared(smith) else root
    x, _ = stretched(cosines, np.asarray(2 * alpha))
    g = cosines + alpha * polynomial.polyval(x, polynomial.polyval(2 * np.sqrt(roughness) - 1, table.fresnel.T))
    return loss, (1 - loss) * (1 - np.clip(g, 0, 1)) ** 5


def _means(table: Table, alpha: float, smith: Smith) -> tuple[float, float]:
    """Return the means of the fits, weighted by 2·cos, by the midpoint rule in log cos."""
    steps = 4000
    cosines = np.exp(-16 * (np.arange(steps) + 0.5) / steps)
    loss, fresnel = (16 * np.mean(2 * cosines**2 * part) for part in evaluate(table, cosines, alpha, smith))
    return float(loss), float(fresnel)


def _fit(x: Doubles, y: Doubles, values: Doubles, weights: Doubles, terms: tuple[int, int]) -> Doubles:
    """Return [x][y] coefficients of the polynomial whose largest weighted error is approximately minimal."""
    basis = chebyshev.chebvander2d(x.ravel(), np.repeat(y, x.shape[1]), [terms[0] - 1, terms[1] - 1])
    target, weight = values.ravel(), np.broadcast_to(weights, values.shape).ravel()
    stress, least = np.ones_like(target), np.inf
    best: Doubles = np.zeros(basis.shape[1])
    for _ in range(ROUNDS):
        scale = weight * np.sqrt(stress)
        scaled = basis * scale[:, None]
        found = np.linalg.solve(scaled.T @ scaled, scaled.T @ (target * scale))
        error = np.abs((basis @ found - target) * weight)
        if error.max() < least:
            least, best = error.max(), np.asarray(found, np.float64)
        stress *= error / error.max() + FLOOR
        stress /= stress.mean()
    matrix = best.reshape(terms)
    powers = np.array([np.pad(chebyshev.cheb2poly(row), (0, terms[1]))[: terms[1]] for row in matrix])
    return np.array([np.pad(chebyshev.cheb2poly(row), (0, terms[0]))[: terms[0]] for row in powers.T]).T


def _fit_mean(y: Doubles, values: Doubles, terms: int) -> Doubles:
    """Return coefficients in y, fitted with equal relative weights."""
    return np.asarray(chebyshev.cheb2poly(chebyshev.chebfit(y, values, terms - 1, w=1 / values)))


def write_table(smith: Smith, table: Table) -> Iterator[str]:
    """Yield the lines of the table file."""
    name = smith.upper()
    scale = {"schlick": "0.125f * square(sqrt(alpha) + 1.0f)", "schlick_ibl": "0.5f * alpha"}.get(
        smith, "square(alpha)"
    )
    width = "2.0f * alpha" if is_squared(smith) else f"{16 if smith == 'schlick' else 32}.0f * scale"
    yield f'// Directional albedos of GGX with smith = "{smith}" (ggx_albedo.cl), written by'
    yield f"// `python -m clrt.bench.numerics.albedo_tables {smith}`."
    for part in ("loss", "fresnel"):
        kind = part.upper()
        yield f"constant float {name}_{kind}[{kind}_X][{kind}_Y] = {{   // [power of x][power of y]"
        yield from (f"    {{{', '.join(map(_literal, row))}}}," for row in getattr(table, part))
        yield "};"
    for part in ("mean_loss", "mean_fresnel"):
        yield f"constant float {name}_{part.upper()}[{part.upper()}_Y] = {{"
        yield from wrap(
            f"{', '.join(map(_literal, getattr(table, part)))}}};", 116, initial_indent=INDENT, subsequent_indent=INDENT
        )
    yield ""
    yield f"static inline GgxAlbedo {smith}_albedo(real alpha) {{"
    yield f"    real scale = {scale};"
    yield f"    return ggx_albedo_of(alpha, {width}, {'ALL_LANES' if is_squared(smith) else 'NO_LANES'},"
    yield "                         scale * log(1.0f + 1.0f / scale),"
    yield f"                         {name}_LOSS, {name}_FRESNEL, {name}_MEAN_LOSS, {name}_MEAN_FRESNEL);"
    yield "}"


def _literal(value: float) -> str:
    text = f"{value:.7g}"
    return f"{text}f" if set(text) & set(".e") else f"{text}.0f"


if __name__ == "__main__":
    chosen: Smith = next(smith for smith in get_args(Smith) if smith == sys.argv[1])
    print("\n".join(write_table(chosen, fit_table(chosen))))
