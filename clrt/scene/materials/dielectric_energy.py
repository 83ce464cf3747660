"""Energy that single scattering at a rough dielectric loses, and its compensation, as a table for kernels.

Walter et al. (2007) model a single scattering event; light that hits a second microfacet is lost: a fraction loss(c),
1 − albedo, at a cosine c, on the denser side up to more than half. It is compensated in two reciprocal steps:

1. The single-scattering BSDF is divided by 1 − min(loss(cos wo), loss(cos wi)), the larger of the two albedos, so that
   no energy is created. On the rarer side this restores nearly all, by Turquin's argument (2019, "Practical Multiple
   Scattering Compensation for Microfacet Models") that later bounces are distributed much like the first; if ior is
   near 1 light still goes straight on.
2. The remaining loss, rest(c), leaves by a lobe like that of Kulla and Conty (2017):
   rest(cos wo)·rest(cos wi)/(pi·m), on both sides of the surface. With m = Σ n²·∫ rest(c)·2c dc over the sides, in
   radiance over n², the albedo of this lobe is the missing energy at every angle; the fraction n²·∫/m of it leaves
   on a side. Nearly all leaves on the denser one, as after a random walk between the microfacets (Heitz et
   al. 2016; tests/scene/test_dielectric_energy.py). For a thin sheet m is one side's integral, and the fractions are
   those of diffuse light that it reflects and transmits.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .material import ALPHA_MIN

Doubles = NDArray[np.float64]

#: Intervals of the angle axis, uniform in t = sqrt(q·(1 + width)), q = c/(c + width), width = 4·grazing: fine there.
STEPS = 96
#: Rows of a table over all roughnesses from 0 to 1, uniform in the square root of the roughness.
ROWS = 41
#: Fibonacci lattices: the number of points, and the previous Fibonacci number. The finer one is for a single
#: roughness: its tables have errors below 7e-4, those of the other below 2e-3, also between rows.
FINE, COARSE = (4181, 2584), (2584, 1597)
TINY = 1e-150


class Met(NamedTuple):
    """Microfacets sampled for n directions of incidence, at the points of a lattice.

    cosine: (n, 1), of the directions. (n, points) each: cos_o: between wo and the microfacet normal; up: z of its
    normal; back: z of wo mirrored by it; seen: G2/G1 of the mirrored direction. weight: (points,), with a sum of 1.
    """

    cosine: Doubles
    cos_o: Doubles
    up: Doubles
    back: Doubles
    seen: Doubles
    weight: Doubles


class Bounce(NamedTuple):
    """Single scattering from each of n directions by each microfacet: the reflected and the transmitted fractions of
    the incident light, and the cosine of each outgoing direction on its own side; (n, points) each."""

    reflected: Doubles
    back: Doubles
    passed: Doubles
    on: Doubles


class Side(NamedTuple):
    """Loss of single scattering at STEPS + 1 angles, and what remains after the division; mean: ∫ rest·2c dc."""

    loss: Doubles
    rest: Doubles
    mean: float


@lru_cache(128)
def tables(ior: float, roughness: float | None, thin: bool) -> tuple[float, ...]:
    """Build the table of one roughness, or a row for each of ROWS roughnesses: for the outside, then the inside,
    STEPS + 1 pairs (loss, rest), m/n² over the mean of grazing²/(grazing² + c²), and the fraction of rest on that side.
    """
    roughnesses = np.linspace(0, 1, ROWS) ** 2 if roughness is None else [roughness]
    lattice = COARSE if roughness is None else FINE
    rows = [_row(ior, max(float(r) ** 2, ALPHA_MIN), thin, lattice) for r in roughnesses]
    return tuple(np.concatenate(rows).astype(np.float32).tolist())


def sides(ior: float, alpha: float, thin: bool = False, lattice: tuple[int, int] = FINE) -> tuple[Side, Side]:
    """Compute the losses outside and inside of a rough GGX dielectric, or on each side of a thin sheet of it."""
    near = grazing(ior, alpha, thin)
    met = microfacets(angles(near), alpha, lattice)
    # A thin sheet scatters equally to both sides: everything counts as reflected.
    bounces = [bounce(met, alpha, eta) for eta in ([np.inf] if thin else [ior, 1 / ior])]
    losses = [1 - b.reflected.sum(axis=1) - b.passed.sum(axis=1) for b in bounces]
    made = []
    for b, loss, beyond in zip(bounces, losses, losses[::-1]):
        kept = sum(
            np.sum(part / (1 - np.minimum(loss[:, None], at_cosines(other, cosines, near))), axis=1)
            for part, cosines, other in ((b.reflected, b.back, loss), (b.passed, b.on, beyond))
        )
        rest = np.maximum(1 - kept, 0)
        made.append(Side(loss, rest, _mean(rest, near)))
    return made[0], made[-1]


def grazing(ior: float, alpha: float, thin: bool = False) -> float:
    """Return the cosine below which the loss is large: alpha, or less for ior near 1, with little deflection."""
    return alpha if thin else min(alpha, float(np.sqrt(alpha * abs(ior - 1 / ior))))


def at_cosines(values: Doubles, cosines: Doubles, near: float) -> Doubles:
    """Interpolate a side's values at other cosines, clamped to the horizon; near: `grazing`."""
    c, width = np.maximum(cosines, 0), 4 * near
    return np.asarray(np.interp(STEPS * np.sqrt(c / (c + width) * (1 + width)), np.arange(STEPS + 1), values))


def angles(near: float) -> Doubles:
    """Return the cosines of a table, (STEPS + 1,); the first is just above 0, as a limit. near: `grazing`."""
    q = (np.arange(STEPS + 1) / STEPS) ** 2 / (1 + 4 * near)
    return np.clip(4 * near * q / (1 - q), 1e-6 * near, 1)


def microfacets(cosines: Doubles, alpha: float, lattice: tuple[int, int] = FINE) -> Met:
    """Sample microfacets from the distribution of visible normals for the cosines (n,)."""
    cosine = np.asarray(cosines, np.float64)[:, None]
    along, up, weight = _normals(cosine, alpha, *lattice)
    cos_o = np.maximum(along * np.sqrt(1 - cosine**2) + up * cosine, TINY)
    back = 2 * cos_o * up - cosine
    return Met(cosine, cos_o, up, back, _seen(cosine, back, alpha), weight)


def bounce(met: Met, alpha: float, eta: float) -> Bounce:
    """Compute single scattering at an interface of relative index eta, infinite for a mirror."""
    fresnel, cos_t = fresnel_dielectric(met.cos_o, eta)
    on = met.cosine / eta - (met.cos_o / eta - cos_t) * met.up
    passed = (1 - fresnel) * _seen(met.cosine, on, alpha)
    return Bounce(fresnel * met.seen * met.weight, met.back, passed * met.weight, on)


def fresnel_dielectric(cos_o: Doubles, eta: float) -> tuple[Doubles, Doubles]:
    """Return F for unpolarised light, 1 for an infinite eta, and the cosine of the refracted direction, or 0."""
    cos2_t = 1 - (1 - cos_o**2) / eta**2
    cos_t = np.sqrt(np.maximum(cos2_t, 0))
    if eta == np.inf:
        return np.ones_like(cos_o), cos_t
    parallel = (eta * cos_o - cos_t) / (eta * cos_o + cos_t)
    perpendicular = (cos_o - eta * cos_t) / (cos_o + eta * cos_t)
    return np.where(cos2_t > 0, (parallel**2 + perpendicular**2) / 2, 1), cos_t


def _normals(cosine: Doubles, alpha: float, points: int, generator: int) -> tuple[Doubles, Doubles, Doubles]:
    """Sample visible normals (Dupuy and Benyoub 2023): x, with wo in the xz plane, and z, (n, points) each; weights.

    Azimuths cover half a turn, by symmetry. A tent map of the other coordinate makes the integrand periodic, and an
    offset of a quarter step spreads its values evenly, excluding the ends. Squaring it places more points at steep
    normals, few of which are sampled and most of which lose their light.
    """
    i = np.arange(points)
    turn, tent = np.pi * (i + 0.5) / points, np.abs(2 * ((i * generator + 0.25) / points % 1) - 1)
    v, weight = 1 - tent**2, 2 * tent / points
    x, z = alpha * np.sqrt(1 - cosine**2), cosine
    length = np.hypot(x, z)
    x, z = x / length, z / length
    height = 1 - v * (1 + z)
    radius = np.sqrt(np.maximum(1 - height**2, 0))
    x, y, z = alpha * (radius * np.cos(turn) + x), alpha * radius * np.sin(turn), np.maximum(height + z, 1e-30)
    length = np.sqrt(x**2 + y**2 + z**2)
    return x / length, z / length, weight


def _seen(cos_o: Doubles, cos_i: Doubles, alpha: float) -> Doubles:
    """Return G2/G1 of the height-correlated Smith term; 0 if light goes to the wrong side."""
    lambda_o, lambda_i = (np.sqrt(1 + alpha**2 * (1 / np.maximum(c, TINY) ** 2 - 1)) / 2 - 0.5 for c in (cos_o, cos_i))
    return np.where(cos_i > 0, (1 + lambda_o) / (1 + lambda_o + lambda_i), 0)


def _mean(rest: Doubles, near: float) -> float:
    """Compute ∫ rest·2c dc, with rest linear in t between the table's angles."""
    t = (np.arange(16 * STEPS) + 0.5) / (16 * STEPS)
    q, width = t**2 / (1 + 4 * near), 4 * near
    slope = width / (1 - q) ** 2 * 2 * t / (1 + width)  # dc/dt
    return float(np.mean(np.interp(t, np.arange(STEPS + 1) / STEPS, rest) * 2 * width * q / (1 - q) * slope))


def _row(ior: float, alpha: float, thin: bool, lattice: tuple[int, int]) -> Doubles:
    """Build the table of one roughness. A thin sheet reflects 2F/(1 + F) of rest, as it does of diffuse light."""
    outside, inside = sides(ior, alpha, thin, lattice)
    parts = np.array([outside.mean, inside.mean * ior**2])
    returned, scale = parts / max(parts.sum(), TINY), parts.sum() / np.array([1, ior**2])
    if thin:
        cosines = (np.arange(1000) + 0.5) / 1000
        mean = np.mean(2 * cosines * fresnel_dielectric(cosines, ior)[0])
        returned, scale = np.full(2, 2 * mean / (1 + mean)), np.full(2, outside.mean)
    near = grazing(ior, alpha, thin)
    falling = near**2 * np.log1p(near**-2)  # ∫ near²/(near² + c²)·2c dc: m divided by it hardly depends on alpha
    return np.concatenate(
        [
            np.ravel([*zip(side.loss, side.rest), (m / falling, part)])
            for side, m, part in zip((outside, inside), scale, returned)
        ]
    )
