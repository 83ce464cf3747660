"""Growth of a quantity with the number of triangles: the cost of a ray in a good BVH grows logarithmically."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


def fit_logarithm(sizes: ArrayLike, values: ArrayLike) -> dict[str, float]:
    """Fit a + b·log2(size) by least squares to values (k,) at sizes (k,) > 0, k >= 2, with the coefficient R², `r2`.

    R² is the fraction of the values' variance that the line explains; 1 if they are all equal.
    """
    x, y = np.log2(np.asarray(sizes, np.float64)), np.asarray(values, np.float64)
    from_mean, deviations = x - x.mean(), y - y.mean()
    b = from_mean @ deviations / (from_mean @ from_mean)
    residuals, variance = deviations - b * from_mean, deviations @ deviations
    return {
        "a": float(y.mean() - b * x.mean()),
        "b": float(b),
        "r2": float(1 - residuals @ residuals / variance) if variance > 0 else 1.0,
    }
