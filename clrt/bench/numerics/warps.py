"""Warps of the unit square against their pdfs: chi-square tests over cells of known probability."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from ...device.open import Device
from ...scene.materials.material import ALPHA_MIN
from ...scene.materials.material_types import MetallicRoughness
from ...scene.model import Scene, Sphere
from ..kernel_probe import Doubles, Probe
from ..significance import chi2_test
from .bsdf_cases import uniform, view
from .jacobians import grid, missed

#: 1 − cos of the cones' half angles: from the whole sphere of directions down to a sun of 1e-5 degrees.
HEIGHTS = (2.0, 1.0, 0.3, 1e-3, 1e-7, 1e-14)
ALPHAS = (ALPHA_MIN, 1e-3, 0.01, 0.1, 0.36, 1.0)
COSINES = (1.0, 0.6, 0.1, 1e-2, 1e-3, 1e-4)
#: Cells per side of a square, or of a chart.
SIDE = 16


def warp_probe(device: Device, changes: Mapping[str, str] | None = None) -> Probe:
    """Return a program with all warps; changes: see Probe."""
    return Probe(device, Scene(spheres=[Sphere(material=MetallicRoughness())]), changes=changes)


def warp_p_values(probe: Probe, samples: int, seed: int) -> dict[str, float]:
    """Return a p-value for each warp and each of its parameters."""
    return dict(_closed_forms(probe, samples, seed)) | dict(_visible_normals(probe, samples, seed))


def _closed_forms(probe: Probe, samples: int, seed: int) -> Iterator[tuple[str, float]]:
    """Test warps with a known inverse, which maps their samples back to uniform ones."""
    u = uniform(samples, seed)[:, :2]
    for height in HEIGHTS:
        out = probe("warps", 12, u, np.full(samples, height))
        wi = out[:, 4:7]
        # Computed from the sine: for small cones cos θ is 1 in float32.
        sin2 = wi[:, 0] ** 2 + wi[:, 1] ** 2
        yield (
            f"cone of 1 - cos = {height:g}",
            uniform_test(np.where(wi[:, 2] > 0, sin2 / (1 + np.abs(wi[:, 2])), 1 - wi[:, 2]) / height, turn(wi)),
        )
    yield "cosine", uniform_test(out[:, 0] ** 2 + out[:, 1] ** 2, turn(out[:, :3]))
    yield "triangle", triangle_test(out[:, 8], out[:, 9])


def warp_density_errors(probe: Probe) -> dict[str, float]:
    """Return the largest relative deviation of each warp's pdf from 1/area, beyond the area's error (see jacobians)."""
    u = grid()
    errors = {}
    for height in HEIGHTS:
        out = probe("warps", 12, u, np.full(len(u), height))
        errors[f"cone of 1 - cos = {height:g}"] = missed(
            lambda at: probe("warps", 12, at, np.full(len(at), height))[:, 4:7], u, out[:, 7]
        )
    errors["cosine"] = missed(lambda at: probe("warps", 12, at, np.ones(len(at)))[:, :3], u, out[:, 3])
    for alpha in ALPHAS:
        for cosine in COSINES:
            wo = view(cosine)

            def normals(at: Doubles) -> Doubles:
                return probe("visible_normal", 3, np.broadcast_to(wo, (len(at), 3)), np.full(len(at), alpha), at)

            h = normals(u)
            name = f"visible normals of alpha {alpha:g} from cos {cosine:g}"
            errors[name] = missed(normals, u, _density(h, alpha, wo))
    return errors


def uniform_test(x: Doubles, y: Doubles) -> float:
    """Return the p-value of points being uniform over the unit square."""
    cells = [np.clip((SIDE * a).astype(int), 0, SIDE - 1) for a in (x, y)]
    return chi2_test(np.bincount(cells[0] * SIDE + cells[1], minlength=SIDE**2), np.full(SIDE**2, len(x) / SIDE**2))


def triangle_test(b1: Doubles, b2: Doubles) -> float:
    """Return the p-value of points being uniform over b1 + b2 <= 1: mirroring every other one fills the square."""
    folded = np.arange(len(b1)) % 2 == 1
    return uniform_test(np.where(folded, 1 - b1, b1), np.where(folded, 1 - b2, b2))


def turn(wi: Doubles) -> Doubles:
    """Return the azimuth as a fraction of a turn."""
    return np.asarray(np.arctan2(wi[:, 1], wi[:, 0]) / (2 * np.pi) % 1)


def _visible_normals(probe: Probe, samples: int, seed: int) -> Iterator[tuple[str, float]]:
    for i, alpha in enumerate(ALPHAS):
        for k, cosine in enumerate(COSINES):
            wo, u = view(cosine), uniform(samples, seed + 1 + len(COSINES) * i + k)[:, :2]
            h = probe("visible_normal", 3, np.broadcast_to(wo, (samples, 3)), np.full(samples, alpha), u)
            psi = np.arctan(np.hypot(h[:, 0], h[:, 1]) / h[:, 2] / np.float32(alpha))
            phi = (turn(h) - np.arctan2(wo[1], wo[0]) / (2 * np.pi)) % 1
            cells = [np.minimum((SIDE * a).astype(int), SIDE - 1) for a in (psi / (np.pi / 2), phi)]
            counts = np.bincount(cells[0] * SIDE + cells[1], minlength=SIDE**2)
            yield (
                f"visible normals of alpha {alpha:g} from cos {cosine:g}",
                chi2_test(counts, visible_normals(float(np.float32(alpha)), wo).ravel() * samples),
            )


def visible_normals(alpha: float, wo: Doubles) -> Doubles:
    """Return (SIDE, SIDE) probabilities of visible normals from wo, in cells of psi and azimuth; tan θ = alpha·tan psi.

    D·max(0, wo·h)/(cos wo·(1 + Λ)) dωh = (1 + k·tan psi)⁺·2 sin psi cos psi dpsi dphi/(2·pi·(1 + Λ)), with
    k = alpha·tan θo·cos phi; exact in psi, by Gauss–Legendre points in phi clustered at the edges of cells.
    """
    t, weight = np.polynomial.legendre.leggauss(64)
    inside, weight = (2 + t * (3 - t * t)) / 4, 0.75 * (1 - t * t) * weight
    phi = 2 * np.pi * np.add.outer(np.arange(SIDE), inside) / SIDE
    slope = alpha * np.hypot(wo[0], wo[1]) / wo[2]
    k = slope * np.cos(phi)
    last = np.where(k < 0, np.arctan2(1, -k), np.pi / 2)
    psi = np.minimum(np.linspace(0, np.pi / 2, SIDE + 1)[:, None, None], last)
    below = np.sin(psi) ** 2 + k * (psi - np.sin(psi) * np.cos(psi))
    shadowed = 2 / (1 + np.sqrt(1 + slope**2))
    return np.asarray(np.maximum(np.diff(below, axis=0), 0) @ weight * shadowed / SIDE)


def _density(h: Doubles, alpha: float, wo: Doubles) -> Doubles:
    """Return D·max(0, wo·h)/(cos wo·(1 + Λ)), (n,), for unit normals h (n, 3)."""
    a2 = float(np.float32(alpha)) ** 2
    d = a2 / (np.pi * (h[:, 0] ** 2 + h[:, 1] ** 2 + a2 * h[:, 2] ** 2) ** 2)
    stretched = np.sqrt(a2 * (wo[0] ** 2 + wo[1] ** 2) + wo[2] ** 2)
    return np.asarray(2 * d * np.maximum(h @ wo, 0) / (wo[2] + stretched))
