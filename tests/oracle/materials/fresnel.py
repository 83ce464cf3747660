"""Fresnel's equations for unpolarized light (Born and Wolf, 1.5 and 14.2), and Schlick's approximation."""

from __future__ import annotations

import numpy as np

from ..vectors import Doubles


def dielectric(cos_o: Doubles, eta: Doubles) -> tuple[Doubles, Doubles]:
    """Return F at an interface of relative index eta, and the cosine of refraction, 0 for total internal reflection."""
    cos2_t = 1 - (1 - cos_o**2) / eta**2
    cos_t = np.sqrt(np.maximum(cos2_t, 0))
    perpendicular = (cos_o - eta * cos_t) / (cos_o + eta * cos_t)
    parallel = (eta * cos_o - cos_t) / (eta * cos_o + cos_t)
    return np.where(cos2_t > 0, (perpendicular**2 + parallel**2) / 2, 1), cos_t


def conductor(cosine: Doubles, eta: Doubles, k: Doubles) -> Doubles:
    """Return F (n, 3) of a complex index eta + i·k, (n, 3) or (3,): squared amplitudes, in complex numbers."""
    index = eta + 1j * k
    c = cosine[:, None].astype(complex)
    cos_t = np.sqrt(1 - (1 - c**2) / index**2)
    perpendicular = (c - index * cos_t) / (c + index * cos_t)
    parallel = (index * c - cos_t) / (index * c + cos_t)
    return np.asarray((np.abs(perpendicular) ** 2 + np.abs(parallel) ** 2) / 2)


def schlick(cosine: Doubles, f0: Doubles, f90: Doubles) -> Doubles:
    """Return F (n, 3) from f0 (n, 3) at normal incidence and f90 (n, 3) at grazing angles (Schlick 1994)."""
    return np.asarray(f0 + (f90 - f0) * (1 - np.clip(cosine, 0, 1)[:, None]) ** 5)
