"""Radiance of a clear sky and of the sun: the models of Hosek and Wilkie, in W·m⁻²·sr⁻¹·nm⁻¹.

Sky: 2012, "An Analytic Model for Full Spectral Sky-Dome Radiance", the authors' fit in linear Rec. 709. Sun: 2013,
"Adding a Solar-Radiance Function to the Hosek-Wilkie Skylight Model", at eleven wavelengths. The sky is without the
sun's disc, which the second paper adds. Both were fitted to simulated atmospheres of ten turbidities, for elevations of
the sun from 0 to 90 degrees.

The coefficients are the authors', version 1.4a of their data (hosek_wilkie_license.txt has its license), rounded to
float32 in hosek_wilkie.npz:

- sky (3, 2, 10, 6, 9) and level (3, 2, 10, 6): channels, albedos 0 and 1, turbidities 1 to 10, Bézier control points
- sun (11, 10, 45, 4): wavelengths, turbidities, intervals of the elevation, powers from the cubic to the constant
- limb (11, 6): wavelengths, powers from the constant up
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import comb, pi, radians, sin
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..spectra import FINE, RGB_FROM_XYZ, WAVELENGTHS, Y, xyz_of_spectrum

Doubles = NDArray[np.float64]

DATA = Path(__file__).with_name("hosek_wilkie.npz")
TURBIDITIES = 10
#: Wavelengths of the sun's coefficients in nm.
SUN_WAVELENGTHS = np.arange(320.0, 721.0, 40.0)
#: Angular diameter in degrees of the sun that the coefficients describe.
SUN_DEGREES = 0.5358
#: The sky's channels are integrals over the wavelength in nm: divided by this, that of the color matching function, a
#: radiance of 1 at all wavelengths has a luminance of 1, as in `rgb_of_spectrum`.
WIDTH = float(np.trapezoid(np.interp(FINE, WAVELENGTHS, Y), FINE))
#: Points of the quadrature over the sun's disc: along the radius and around it.
RADII, SECTORS = 8, 32


@lru_cache
def _data() -> dict[str, Doubles]:
    with np.load(DATA) as file:
        return {name: file[name].astype(np.float64) for name in file.files}


class SkyRadiance:
    """Radiance of the sky at one elevation of the sun in degrees, 0 to 90; turbidity: 1 to 10; albedo of the ground:
    three numbers from 0 to 1."""

    def __init__(self, elevation: float, turbidity: float, albedo: Sequence[float]) -> None:
        x = np.cbrt(elevation / 90)
        weights = np.array([comb(5, i) * x**i * (1 - x) ** (5 - i) for i in range(6)])
        sky = np.moveaxis(_between(_data()["sky"], turbidity, 2), -1, -2) @ weights
        level = _between(_data()["level"], turbidity, 2) @ weights
        share = np.asarray(albedo)
        #: (9, 3) and (3,)
        self._shape = (sky[:, 0] + share[:, None] * (sky[:, 1] - sky[:, 0])).T
        self._level = (level[:, 0] + share * (level[:, 1] - level[:, 0])) / WIDTH

    def at(self, cosine: Doubles, angle: Doubles) -> Doubles:
        """Return linear Rec. 709 (…, 3), not negative. cosine: (…), of the angle from the zenith, at least 0; angle:
        from the sun in radians."""
        cosine, angle = cosine[..., None], angle[..., None]
        a, b, c, d, e, f, g, i, h = self._shape  # i before h in the data
        of_sun = np.cos(angle)
        halo = (1 + of_sun**2) / (1 + h**2 - 2 * h * of_sun) ** 1.5
        above = 1 + a * np.exp(b / (cosine + 0.01))
        around = c + d * np.exp(e * angle) + f * of_sun**2 + g * halo + i * np.sqrt(cosine)
        return np.asarray(np.maximum(above * around * self._level, 0))


def sun_irradiance(elevation: float, turbidity: float) -> Doubles:
    """Return the irradiance (3,) in linear Rec. 709 of a surface that faces the sun: of the part of its disc above the
    horizon, darker at the limb. elevation: degrees; turbidity: 1 to 10."""
    # In terms of u = cos ψ at the sun's surface, sin γ = sin(radius)·sqrt(1 − u²), where the limb's is a polynomial.
    nodes, weights = np.polynomial.legendre.leggauss(RADII)
    u, weights = (nodes + 1) / 2, weights / 2
    edge, around = sin(radians(SUN_DEGREES / 2)), 2 * pi * (np.arange(SECTORS) + 0.5) / SECTORS
    off = edge * np.sqrt(1 - u**2)[:, None]
    height = np.radians(elevation)
    heights = np.arcsin(np.clip(np.sin(height) * np.sqrt(1 - off**2) + np.cos(height) * off * np.cos(around), -1, 1))
    mean = _sun_radiance(heights, turbidity).mean(axis=2)
    limb = _data()["limb"] @ u ** np.arange(6)[:, None]
    spectrum = 2 * pi * edge**2 * (mean * limb) @ (weights * u)
    return np.maximum(RGB_FROM_XYZ @ xyz_of_spectrum(SUN_WAVELENGTHS, spectrum, lit=False), 0)


def _sun_radiance(elevation: Doubles, turbidity: float) -> Doubles:
    """Return (11, …), at the center of the disc; 0 below the horizon. elevation: radians."""
    coefficients = _between(_data()["sun"], turbidity, 1)
    count = coefficients.shape[1]
    above = np.maximum(elevation, 0)
    interval = np.minimum(np.cbrt(2 * above / pi) * count, count - 1).astype(int)
    x = above - pi / 2 * (interval / count) ** 3
    found = coefficients[:, interval]
    radiance = ((found[..., 0] * x + found[..., 1]) * x + found[..., 2]) * x + found[..., 3]
    return np.where(elevation > 0, radiance, 0)


def _between(table: Doubles, turbidity: float, axis: int) -> Doubles:
    """Interpolate linearly between the turbidities along an axis."""
    index = min(int(turbidity) - 1, TURBIDITIES - 2)
    low, high = table.take(index, axis), table.take(index + 1, axis)
    return np.asarray(low + (turbidity - 1 - index) * (high - low))
