"""Variants of every registered material, covering each kind of parameter, and its BSDF kernel called on arrays."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from ...device.open import Device
from ...scene.fields.limits import Limit
from ...scene.materials.material import ALPHA_MIN, SHARED
from ...scene.materials.material_types import MATERIALS, Material
from ...scene.model import Scene, Sphere
from ..kernel_probe import Doubles, Probe

#: Test values of fields for which the ends and the middle of the range are not suitable.
NUMBERS: dict[str, tuple[Any, ...]] = {
    "roughness": (0.0, 0.05, 0.1, 0.3, 0.6, 1.0),
    "ior": (0.25, 1.5),
    "shininess": (0.0, 3.0, 30.0, 1000.0),
    "ambient": (1.0,),
}
COLOR = (1.0, 0.5, 0.2)
#: Sets of fields by kernel, each tested on its own with every second number of the others; other variants leave them at
#: defaults, except for the roughness. Anisotropic lobes are too narrow for the quadrature of densities if smooth.
LAYERS: dict[str, tuple[dict[str, Any], ...]] = {
    "metallic_roughness": (
        {"ior": 2.0},
        {"specular": 0.0},
        {"specular": 0.5, "specular_color": COLOR},
        {"clearcoat": 1.0},
        {"clearcoat": 0.5, "clearcoat_roughness": 0.6},
        {"clearcoat": 1.0, "clearcoat_roughness": 1.0},
        {"sheen_color": COLOR},
        {"sheen_color": (1.0, 1.0, 1.0), "sheen_roughness": 0.5},
        {"sheen_color": (0.2, 0.3, 0.4), "sheen_roughness": 1.0},
        {"transmission": 1.0},
        {"diffuse_transmission": 1.0, "diffuse_transmission_color": COLOR},
        {
            "diffuse_transmission": 0.5,
            "diffuse_transmission_color": (1.0, 1.0, 1.0),
            "transmission": 0.5,
            "clearcoat": 0.7,
            "sheen_color": (0.5, 0.5, 0.5),
            "sheen_roughness": 0.3,
        },
        {"iridescence": 1.0},
        {
            "iridescence": 0.7,
            "iridescence_ior": 1.9,
            "iridescence_thickness": 650.0,
            "iridescence_thickness_minimum": 200.0,
            "iridescence_thickness_map": 0.5,
            "transmission": 0.5,
            "clearcoat": 0.5,
        },
        {"roughness": 0.6, "anisotropy": 0.3},
        {"roughness": 0.3, "anisotropy": 0.6, "anisotropy_degrees": 30.0},
        {"roughness": 0.4, "anisotropy": 1.0, "anisotropy_degrees": 90.0, "clearcoat": 0.7},
        {"roughness": 0.4, "anisotropy": 0.5, "transmission": 0.7, "sheen_color": COLOR, "sheen_roughness": 0.5},
        {
            "transmission": 0.5,
            "specular": 0.5,
            "clearcoat": 0.7,
            "clearcoat_roughness": 0.2,
            "sheen_color": (0.5, 0.5, 0.5),
            "sheen_roughness": 0.3,
        },
    ),
    "plastic": ({"ior": 2.0},),
    "principled": (
        {"ior": 0.6},
        {"spec_tint": 1.0, "ior": 2.0},
        {"sheen": 1.0},
        {"sheen": 0.5, "sheen_tint": 1.0, "flatness": 0.5},
        {"flatness": 1.0},
        {"clearcoat": 1.0},
        {"clearcoat": 0.5, "clearcoat_gloss": 0.7},
        {"roughness": 0.6, "anisotropic": 0.5},
        {"roughness": 0.4, "anisotropic": 1.0, "clearcoat": 0.7, "spec_trans": 0.7},
        {"spec_trans": 1.0},
        {"spec_trans": 0.5, "ior": 0.6},
        {
            "spec_trans": 0.6,
            "spec_tint": 0.5,
            "sheen": 0.5,
            "sheen_tint": 0.5,
            "flatness": 0.3,
            "clearcoat": 0.8,
            "clearcoat_gloss": 0.3,
        },
    ),
    "conductor": (
        {"roughness": 0.6, "roughness_across": 0.3},
        {"roughness": 0.3, "roughness_across": 0.7},
    ),
    "dielectric": (
        {"multiple_scattering": False},
        {"roughness": 0.0, "dispersion": 2.0},
        {"distribution": "beckmann", "smith": "separable", "multiple_scattering": False},
        {"distribution": "beckmann", "reflectance": COLOR, "multiple_scattering": False},
        {"smith": "separable", "multiple_scattering": False},
    ),
}
#: cos θ of wo, down to grazing; the sines are float32 numbers or round to 1.
COSINES = (1.0, 0.6, 0.1, 2.0**-7, 2.0**-10, 2.0**-13)
#: Azimuth of wo in radians for cosines above STEEP; grazing wo have azimuth 0.
AZIMUTH, STEEP = 1.0, 0.05
#: Narrowest lobe under test. A GGX lobe is 2·alpha·cos θ wide across the plane of incidence; below 16 roundings of a
#: unit vector's components it cannot be resolved by float32 directions.
NARROWEST = 16 * 2.0**-24


def variants(kind: type[Material]) -> list[Material]:
    """Return the plain, worded and layered variants of a material class."""
    return plain_variants(kind) + worded_variants(kind) + layered_variants(kind)


def plain_variants(kind: type[Material]) -> list[Material]:
    """Return all combinations of numbers and flags."""
    numbers, flags, _ = _values(kind)
    return [kind(**values) for values in _product(numbers | flags)]


def worded_variants(kind: type[Material]) -> list[Material]:
    """Return each string of each field, one at a time, with all flags, and numbers in the middle of the range."""
    numbers, flags, words = _values(kind)
    middle = {name: values[len(values) // 2] for name, values in numbers.items()}
    return [
        kind(**middle, **raised, **{name: word})
        for name, found in words.items()
        for word in found
        for raised in _product(flags)
    ]


def views(material: Material) -> list[float]:
    """Return those COSINES from which the material's lobes are wide enough for float32."""
    alpha = 1.0 if material.is_specular else max(getattr(material, "roughness", 1.0) ** 2, ALPHA_MIN)
    return [cosine for cosine in COSINES if 2 * alpha * cosine >= NARROWEST]


def view(cosine: float) -> Doubles:
    """Return a unit wo at an angle to the normal, with components that are exact in float32.

    A grazing wo is along x: there the lobe is narrow in y, which float32 resolves best around 0.
    """
    sine, azimuth = np.sqrt(1 - cosine**2), AZIMUTH if cosine > STEEP else 0.0
    return np.array([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], np.float32).astype(np.float64)


def uniform(count: int, seed: int) -> Doubles:
    """Return (count, 3) numbers in [0, 1) that are exact in float32."""
    return np.random.default_rng(seed).integers(1 << 24, size=(count, 3)) / (1 << 24)


@dataclass
class Bsdfs:
    """Materials on a device; `code[i]` identifies the i-th to the kernels."""

    materials: list[Material]
    probe: Probe
    code: NDArray[np.int32]

    def sample(
        self, which: int, wo: Doubles, numbers: Doubles, front: bool = True
    ) -> tuple[Doubles, Doubles, Doubles, Doubles]:
        """Sample wi (n, 3), weight (n, 3), pdf (n,), specular (n,).

        wo: (3,) or (n, 3); numbers: (n, 3) in [0, 1).
        """
        out = self._sample(which, wo, numbers, front)
        return out[:, :3], out[:, 3:6], out[:, 6], out[:, 7]

    def spread(self, which: int, front: bool = True) -> float:
        """Return the ratio of radiance on one side of the surface to that beyond it: 1 unless light is refracted."""
        out = self._sample(which, np.array([0.0, 0.0, 1.0]), uniform(1 << 10, which), front)
        through = out[:, 8][(out[:, 6] > 0) & (out[:, 2] < 0)]
        return float(through[0]) if len(through) else 1.0

    def _sample(self, which: int, wo: Doubles, numbers: Doubles, front: bool) -> Doubles:
        n = len(numbers)
        return self.probe(
            "bsdf_sample", 9, np.full(n, self.code[which]), np.broadcast_to(wo, (n, 3)), numbers, front=front
        )

    def value(
        self, which: NDArray[np.intp] | int, wo: Doubles, wi: Doubles, front: bool = True
    ) -> tuple[Doubles, Doubles]:
        """Evaluate f·|cos| (n, 3) and pdf (n,) for wi (n, 3); which: (n,) or one; wo: (n, 3) or (3,)."""
        codes = np.broadcast_to(self.code[which], len(wi))
        out = self.probe("bsdf_value", 4, codes, np.broadcast_to(wo, wi.shape), wi, front=front)
        return out[:, :3], out[:, 3]


def bsdfs(device: Device, materials: list[Material] | None = None, changes: Mapping[str, str] | None = None) -> Bsdfs:
    """Set up these materials, or all variants of all materials, on a device; changes: see Probe."""
    wanted = materials or [material for kind in MATERIALS for material in variants(kind)]
    probe = Probe(device, Scene(spheres=[Sphere(material=material) for material in wanted]), changes=changes)
    return Bsdfs(wanted, probe, probe.compiled.buffers["spheres"][1]["material"])


def _values(kind: type[Material]) -> tuple[dict[str, tuple[Any, ...]], ...]:
    """Return the test values of the fields that are numbers, of those that are flags, and of those that are strings."""
    hints = get_type_hints(kind)
    apart = {name for layer in LAYERS.get(kind.kernel, ()) for name in layer} - {"roughness"}
    names = [field.name for field in fields(kind) if field.name not in SHARED | apart]
    words = {name: tuple(found) for name in names if (found := _words(hints[name]))}
    flags = {name: (False, True) for name in names if bool in (hints[name], *get_args(hints[name]))}
    numbers = {name: NUMBERS.get(name) or _numbers(kind, name) for name in names if name not in words | flags}
    return numbers, flags, words


def layered_variants(kind: type[Material]) -> list[Material]:
    """Return each of the material's LAYERS with combinations of numbers, using every second one."""
    some = {name: values[::2] for name, values in _values(kind)[0].items()}
    every = [kind(**(values | layer)) for layer in LAYERS.get(kind.kernel, ()) for values in _product(some)]
    return list(dict.fromkeys(every))


def _product(values: Mapping[str, tuple[Any, ...]]) -> list[dict[str, Any]]:
    return [dict(zip(values, chosen)) for chosen in itertools.product(*values.values())]


def _numbers(kind: type[Material], name: str) -> tuple[Any, ...]:
    """Return a color, or both ends and the middle of the field's range; the default if the range lacks an end."""
    hint, default = get_type_hints(kind, include_extras=True)[name], getattr(kind(), name)
    if isinstance(default, tuple):
        return (COLOR,)
    plain = next((part for part in get_args(hint) if get_origin(part) is Annotated), hint)  # of a number or a texture
    limits = [limit.bound for limit in get_args(plain)[1:] if isinstance(limit, Limit)]
    return (min(limits), sum(limits) / 2, max(limits)) if len(limits) == 2 else (default,)


def _words(hint: Any) -> list[str]:
    """Return the strings that a Literal, alone or in a union, allows."""
    if get_origin(hint) is Literal:
        return list(get_args(hint))
    return [word for part in get_args(hint) for word in _words(part)]
