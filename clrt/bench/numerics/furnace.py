"""White furnace tests: what a surface reflects under uniform illumination, for all viewing angles."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple, get_args

import numpy as np

from ...device.open import Device
from ...scene.materials.material_types import Dielectric, Diffuse, MetallicRoughness, Mirror
from ...scene.materials.metallic_roughness import Smith
from ...scene.materials.microfacets import albedo
from ..kernel_probe import Doubles
from .bsdf_cases import Bsdfs, bsdfs

ROUGHNESSES = (0.0, 0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0)
COSINES = (1.0, 0.8, 0.6, 0.4, 0.2, 0.1, 0.03, 1e-2, 1e-3, 1e-4)
SMITHS: tuple[Smith, ...] = get_args(Smith)
IORS = (1.0, 1.2, 1.5, 2.5, 4.0)
COLOR = (0.8, 0.5, 0.2)
#: Rough glass from nearly smooth to the roughest, for every index of refraction, and thin sheets.
GLASSES = [
    Dielectric(ior=ior, roughness=roughness, thin=thin)
    for ior, thin in [*((ior, False) for ior in (0.25, 0.7, 0.99, 1.01, 1.1, 1.33, 1.5, 2.4, 4.0)), (1.5, True)]
    for roughness in ROUGHNESSES[1:]
]


#: White layers on top of white materials (LAYERS) and the materials below them (BELOW).
WHITE = (1.0, 1.0, 1.0)
FILM_ROUGHNESSES, FIBRE_ROUGHNESSES = (0.0, 0.1, 0.3, 0.6, 1.0), (0.1, 0.2, 0.35, 0.6, 1.0)
FILMS: list[dict[str, Any]] = [{"clearcoat": 1.0, "clearcoat_roughness": roughness} for roughness in FILM_ROUGHNESSES]
FIBRES: list[dict[str, Any]] = [{"sheen_color": WHITE, "sheen_roughness": roughness} for roughness in FIBRE_ROUGHNESSES]
LAYERS: dict[str, list[dict[str, Any]]] = {
    "a film": FILMS,
    "fibres": FIBRES,
    "a film over fibres": [film | fibres for film in FILMS for fibres in FIBRES],
    "a thin sheet": [{"transmission": transmission} for transmission in (0.5, 1.0)],
    "a sheet under a film": [{"transmission": 0.5} | film for film in FILMS],
}
BELOW: dict[str, dict[str, Any]] = {
    "matte": {"specular": 0.0},
    "ior 1.5": {},
    "ior 3": {"ior": 3.0},
    "half metal": {"metallic": 0.5},
    "metal": {"metallic": 1.0},
}
#: Closer to the horizon the albedo fits are less accurate, and light from there has negligible weight.
LAYER_COSINES = tuple(cosine for cosine in COSINES if cosine >= 0.03)


class Reflected(NamedTuple):
    """Reflectance of a white material; exact: 1, or the single-bounce albedo without multiple scattering."""

    material: MetallicRoughness
    cosine: float
    found: float
    exact: float


class Kept(NamedTuple):
    """Fraction of light that white glass reflects and transmits, seen from its front or back; 1 is exact."""

    glass: Dielectric
    front: bool
    cosine: float
    found: float


def measure_metals(device: Device, samples: int, smiths: Iterable[Smith] = SMITHS) -> Iterator[Reflected]:
    """Measure white metals without and with multiple scattering, for every roughness and angle."""
    metals = [
        MetallicRoughness(
            color=(1.0, 1.0, 1.0), metallic=1.0, roughness=roughness, smith=smith, multiple_scattering=multiple
        )
        for smith in smiths
        for multiple in (False, True)
        for roughness in ROUGHNESSES
    ]
    subject, numbers = bsdfs(device, [*metals]), evenly(samples)
    for which, metal in enumerate(metals):
        single = albedo(np.array(COSINES), metal.lobes.alpha, metal.smith)
        for cosine, once in zip(COSINES, single):
            found = float(_weights(subject, which, cosine, numbers)[:, 0].mean())
            yield Reflected(metal, cosine, found, 1.0 if metal.multiple_scattering else float(once))


def measure_plastics(device: Device, samples: int) -> Iterator[Reflected]:
    """Measure white plastics of every roughness and several indices, without and with metal, for every angle."""
    plastics = [
        MetallicRoughness(color=(1.0, 1.0, 1.0), metallic=metallic, roughness=roughness, ior=ior)
        for metallic in (0.0, 0.5)
        for ior in IORS
        for roughness in ROUGHNESSES
    ]
    subject, numbers = bsdfs(device, [*plastics]), evenly(samples)
    for which, plastic in enumerate(plastics):
        for cosine in COSINES:
            yield Reflected(plastic, cosine, float(_weights(subject, which, cosine, numbers)[:, 0].mean()), 1.0)


def measure_layers(device: Device, samples: int, name: str, step: int = 1) -> Iterator[Reflected]:
    """Measure white materials below the layers of a name of LAYERS, using every step-th roughness."""
    whites = [
        MetallicRoughness(color=WHITE, roughness=roughness, **below, **layer)
        for layer in LAYERS[name]
        for below in BELOW.values()
        for roughness in ROUGHNESSES[::step]
    ]
    subject, numbers = bsdfs(device, [*whites]), evenly(samples)
    for which, white in enumerate(whites):
        for cosine in LAYER_COSINES:
            yield Reflected(white, cosine, float(_weights(subject, which, cosine, numbers)[:, 0].mean()), 1.0)


def measure_glass(device: Device, samples: int, glasses: Sequence[Dielectric] = GLASSES) -> Iterator[Kept]:
    """Measure white glasses from both sides, for every angle."""
    subject, numbers = bsdfs(device, [*glasses]), evenly(samples)
    for which, glass in enumerate(glasses):
        for front in (True, False):
            for cosine in COSINES:
                found = float(_weights(subject, which, cosine, numbers, front)[:, 0].mean())
                yield Kept(glass, front, cosine, found)


def inexact(device: Device, samples: int) -> tuple[int, int]:
    """Count samples of diffuse and mirror whose weight is not their color, and all samples."""
    subject, numbers = bsdfs(device, [Diffuse(color=COLOR), Mirror(color=COLOR)]), evenly(samples)
    weights = [_weights(subject, which, cosine, numbers) for which in (0, 1) for cosine in COSINES]
    wrong = sum(int(np.any(weight != np.array(COLOR, np.float32), axis=1).sum()) for weight in weights)
    return wrong, len(weights) * samples


def evenly(count: int) -> Doubles:
    """Return (count, 3) Hammersley points in the unit cube, exact in float32."""
    points = np.column_stack([(np.arange(count) + 0.5) / count, _reversed_digits(count, 2), _reversed_digits(count, 3)])
    return np.asarray(np.floor(points * (1 << 24)) / (1 << 24))


def _reversed_digits(count: int, base: int) -> Doubles:
    """Return the radical inverses of 0, 1, 2 …, (count,)."""
    number, place, mirrored = np.arange(count), 1.0, np.zeros(count)
    while number.any():
        place /= base
        mirrored += place * (number % base)
        number //= base
    return mirrored


def _weights(subject: Bsdfs, which: int, cosine: float, numbers: Doubles, front: bool = True) -> Doubles:
    wo = np.array([np.sqrt(1 - cosine**2), 0.0, cosine])
    return subject.sample(which, wo, numbers, front)[1]
