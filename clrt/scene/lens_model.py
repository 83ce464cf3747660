"""Lens distortion as OpenCV defines it: from directions to positions on the image plane at distance 1.

Brown and Conrady's model with a rational radial part, for perspective cameras (OpenCV, "Camera Calibration and 3D
Reconstruction"), and the fisheye model of Kannala and Brandt 2006, "A Generic Camera Model and Calibration Method",
without its asymmetric part. Rays need the inverse, which kernels/camera/radial_lens.cl computes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
#: Numbers of coefficients: k1, k2, p1, p2, k3, k4, k5, k6, the first 4, 5 or all; of a fisheye k1, k2, k3, k4.
BROWN_CONRADY, FISHEYE = (4, 5, 8), (4,)
#: Largest tangent of the angle from the optical axis, 89.94 degrees, at which a perspective lens has rays.
STEEPEST = 1e3


class LensModel(NamedTuple):
    """A direction at the radius r, the tangent of its angle from the optical axis or, if `angular`, the angle itself,
    is imaged at the distance g(r) = r·N(r²)/D(r²) from the axis, in its own azimuth, but for the tangential part.

    numerator: coefficients of N but for the first, which is 1, (4,); denominator: likewise of D, (3,); tangential: p1,
    p2.
    """

    numerator: tuple[float, ...]
    denominator: tuple[float, ...] = (0.0, 0.0, 0.0)
    tangential: tuple[float, float] = (0.0, 0.0)
    angular: bool = False

    @classmethod
    def brown_conrady(cls, coefficients: Sequence[float]) -> LensModel:
        """Return the lens of a perspective camera; coefficients: as in BROWN_CONRADY, or none."""
        k1, k2, p1, p2, k3, k4, k5, k6 = (*coefficients, *[0.0] * (8 - len(coefficients)))
        return cls((k1, k2, k3, 0.0), (k4, k5, k6), (p1, p2))

    @classmethod
    def fisheye(cls, coefficients: Sequence[float]) -> LensModel:
        """Return the lens of a fisheye; coefficients: as in FISHEYE, or none for an equidistant one."""
        return cls(tuple(coefficients) or (0.0,) * 4, angular=True)

    def radial(self, radii: Doubles) -> Doubles:
        """Return g(r)."""
        above, below = self._polynomials()
        squares = radii * radii
        return np.asarray(radii * above(squares) / below(squares))

    @property
    def fold(self) -> float:
        """The radius up to which g increases, so that it can be inverted; infinite if it always does."""
        above, below = self._polynomials()
        square = Polynomial([0.0, 1.0])
        # The sign of g'(r), with r² = s: N·D + 2s·(N'·D − N·D').
        slope = above * below + 2 * square * (above.deriv() * below - above * below.deriv())
        squares = [_first_root(np.asarray(each.coef, np.float64)) for each in (slope, below)]
        radius = float(np.sqrt(min(squares)))
        return min(radius, np.pi) if self.angular else radius

    def reach(self, edge: float) -> float:
        """Return a radius, at most the fold, within which all positions up to the distance `edge` from the axis are
        imaged that the lens images at all."""
        fold = self.fold
        if self.angular:
            return fold
        radii = np.geomspace(1e-3, STEEPEST, 200)
        radii = radii[radii < fold]
        with np.errstate(over="ignore", invalid="ignore"):
            inner = self.radial(radii) - 3 * np.abs(self.tangential).sum() * radii**2
        enough = radii[inner > edge]
        return float(enough[0]) if len(enough) else min(fold, STEEPEST)

    def distorted(self, directions: Doubles) -> Doubles:
        """Return where directions (…, 3), x to the right, y down, z ahead, are imaged, (…, 2); NaN where not."""
        x, y, z = np.moveaxis(directions, -1, 0)
        across = np.hypot(x, y)
        with np.errstate(all="ignore"):
            radii = np.arctan2(across, z) if self.angular else np.where(z > 0, across / z, np.inf)
            radii = np.where(radii < self.fold, radii, np.nan)
            along = self.radial(radii) / across
        u, v = (np.where(across > 0, each * along, each + 0 * radii) for each in (x, y))
        if not any(self.tangential):
            return np.stack([u, v], axis=-1)
        (p1, p2), (a, b), square = self.tangential, (x / z, y / z), radii * radii
        return np.stack(
            [
                u + 2 * p1 * a * b + p2 * (square + 2 * a * a),
                v + p1 * (square + 2 * b * b) + 2 * p2 * a * b,
            ],
            axis=-1,
        )

    def _polynomials(self) -> tuple[Polynomial, Polynomial]:
        """Return N and D."""
        return Polynomial([1.0, *self.numerator]), Polynomial([1.0, *self.denominator])


def _first_root(coefficients: Doubles) -> float:
    """Return the smallest positive real root of a polynomial; infinite if there is none."""
    roots = np.roots(np.trim_zeros(coefficients[::-1], "f"))
    real = roots.real[(roots.real > 0) & (np.abs(roots.imag) <= 1e-9 * np.abs(roots))]
    return float(real.min(initial=np.inf))
