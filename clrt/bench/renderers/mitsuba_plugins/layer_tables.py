"""Tables for the plugin of metallic-roughness (gltf_bsdf.py): what microfacets, clearcoat ("film") and sheen
("fibres") reflect and transmit by angle, after docs/scene-format.md. All integrals are midpoint sums of its own.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ....scene.materials.material import ALPHA_MIN
from ....scene.materials.metallic_roughness import Smith
from ....scene.materials.microfacets import Doubles, albedos, shadowing

#: Tabulated angles, uniform in the root of the cosine, and those of an integral in each dimension.
SIDE, POINTS = 128, 192
FILM_F0 = 0.04
#: Lower bound of the sheen roughness.
SMOOTHEST = 0.1
ROOTS = (np.arange(SIDE) + 0.5) / SIDE
MIDDLES = (np.arange(POINTS) + 0.5) / POINTS
#: Values per angle: T, T·E1, T·E5, taken by F0, taken by F90, taken from fibres.
PARTS = 6


@lru_cache
def angle_tables(roughnesses: tuple[float, ...], smith: Smith, layers: tuple[float, float] | None) -> Doubles:
    """Return (corners, roughnesses, SIDE, PARTS) at ROOTS.

    layers: roughness of film and fibres; None: no layers. Corners: without layers, below a film of strength 1, below
    white fibres, below both; everything is bilinear in the strengths. T: the fraction of light that the layers transmit
    at an angle; E1 and E5: albedos of the specular lobe for F = 1 and F = (1 − wo·h)^5; taken:
    ∫ lobe·max(T(wo) − T(wi), 0) dwi of the specular lobe for F0 and F90, and of white fibres below the film.
    """
    left, from_fibres = [np.ones(SIDE)], [np.zeros(SIDE)]
    if layers:
        film = 1 - film_albedo(layers[0])
        cos_i, scattered, _ = fibres(layers[1])
        under = 1 - scattered.sum(axis=1)
        left += [film, under, film * under]
        below_film = taken_by(film, cos_i, scattered)
        from_fibres += [below_film, np.zeros(SIDE), below_film]
    table = np.zeros((len(left), len(roughnesses), SIDE, PARTS))
    for row, roughness in enumerate(roughnesses):
        alpha = max(roughness**2, ALPHA_MIN)
        whole, grazing = albedos(ROOTS**2, alpha, smith)
        facets_i, facets, schlick = gloss(alpha, smith) if layers else (np.ones((1, 1)), np.zeros((1, 1)), 0.0)
        for corner, (each, fibre) in enumerate(zip(left, from_fibres)):
            taken = [taken_by(each, facets_i, facets * part) for part in (1 - schlick, schlick)]
            table[corner, row] = np.column_stack([each, each * whole, each * grazing, *taken, fibre])
    return table


def means_of(table: Doubles) -> Doubles:
    """Return the cosine-weighted means over the hemisphere, ∫ 2·cos·f dcos, of a table whose last axes are ROOTS and
    values."""
    return np.asarray(np.mean(4 * ROOTS[:, None] ** 3 * table, axis=-2))


def film_albedo(roughness: float) -> Doubles:
    """Return (SIDE,) the albedo of a film of strength 1 at ROOTS."""
    whole, grazing = albedos(ROOTS**2, max(roughness**2, ALPHA_MIN), "height_correlated")
    return np.asarray(FILM_F0 * (whole - grazing) + grazing)


def fibres(roughness: float) -> tuple[Doubles, Doubles, Doubles]:
    """Return cosines (1, POINTS), the bounded light (SIDE, POINTS) that white sheen scatters there from ROOTS, and its
    unbounded albedos (SIDE,).
    """
    n = max(roughness, SMOOTHEST) ** -2  # the power of sin θh

    def sent(o: Doubles) -> Doubles:
        i, phi = MIDDLES**2, np.pi * MIDDLES[:, None, None]
        along = np.sqrt((1 - o[:, None] ** 2) * (1 - i**2)) * np.cos(phi)
        cos2_h = (o[:, None] + i) ** 2 / (2 * (1 + o[:, None] * i + along))
        d = (2 + n) / (2 * np.pi) * np.mean(np.maximum(1 - cos2_h, 0) ** (n / 2), axis=0)
        value = 2 * np.pi * d * i / (4 * (o[:, None] + i - o[:, None] * i))
        return np.asarray(value * 2 * MIDDLES / POINTS)  # dcos = 2·root·droot

    values, there = sent(ROOTS**2), sent(MIDDLES**2).sum(axis=1)
    unbounded = values.sum(axis=1)
    return MIDDLES[None] ** 2, values / np.maximum(np.maximum(unbounded[:, None], there), 1), unbounded


def gloss(alpha: float, smith: Smith) -> tuple[Doubles, Doubles, Doubles]:
    """Return cosines (SIDE, POINTS²) of directions that GGX reflects from ROOTS, weights for F = 1 and (1 − wo·h)^5."""
    o = (ROOTS**2)[:, None]
    up, cos_h = normals(alpha)
    i = 2 * cos_h * up - o
    lambda_o = np.sqrt(1 + alpha**2 * (1 / o**2 - 1)) / 2 - 0.5
    seen = np.where(i > 0, shadowing(o, np.maximum(i, 1e-9), alpha, smith) * (1 + lambda_o), 0)
    return i, seen / POINTS**2, np.clip(1 - cos_h, 0, 1) ** 5


def normals(alpha: float, roots: Doubles = ROOTS) -> tuple[Doubles, Doubles]:
    """Return z (n, POINTS²) of visible normals from `roots` (n,) of cosines, and their cosines with wo.

    They are sampled by their visible area: a disc, part of which is compressed according to the slant of wo (Heitz
    2018, "Sampling the GGX Distribution of Visible Normals").
    """
    o = (roots**2)[:, None]
    radius, phi = (each.ravel() for each in np.meshgrid(np.sqrt(MIDDLES), 2 * np.pi * MIDDLES))
    x, z = alpha * np.sqrt(1 - o**2), o
    x, z = x / np.hypot(x, z), z / np.hypot(x, z)
    across, up = radius * np.sin(phi), radius * np.cos(phi)
    up = (1 - z) / 2 * np.sqrt(np.maximum(1 - across**2, 0)) + (1 + z) / 2 * up
    height = np.sqrt(np.maximum(1 - across**2 - up**2, 0))
    h = np.array([alpha * (height * x - up * z), alpha * np.broadcast_to(across, up.shape), height * z + up * x])
    h[2] = np.maximum(h[2], 0)
    h /= np.sqrt(np.sum(h**2, axis=0))
    return h[2], np.clip(h[0] * np.sqrt(1 - o**2) + h[2] * o, 0, 1)


def taken_by(left: Doubles, cos_i: Doubles, sent: Doubles) -> Doubles:
    """Return Σ sent·max(T(wo) − T(wi), 0), (SIDE,), for T (SIDE,) at ROOTS."""
    there = np.interp(np.sqrt(np.maximum(cos_i, 0)), ROOTS, left)
    return np.asarray(np.sum(sent * np.maximum(left[:, None] - there, 0), axis=1))
