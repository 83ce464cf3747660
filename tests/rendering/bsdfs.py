"""Every material with every kind of parameters, taken from the registry, and its kernel called on arrays."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, fields
from typing import Any, Literal, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from clrt.device.open import Device
from clrt.scene.materials import MATERIALS, Material
from clrt.scene.model import Scene, Sphere

from ..probe import Probe

Doubles = NDArray[np.float64]

#: What is tried of fields that want more than the ends and the middle of their range.
NUMBERS: dict[str, tuple[Any, ...]] = {"roughness": (0.01, 0.1, 0.3, 0.6, 1.0)}
COLOR = (0.9, 0.5, 0.2)
AZIMUTH = 1.0
GRAZING = 2.0**-10      # its sine is 1 − 2^-21, a float32
COSINES = (1.0, 0.6, 0.1, GRAZING)


def variants(kind: type[Material]) -> list[Material]:
    """All combinations of the numbers above, and each word that a field may be, one at a time."""
    hints = get_type_hints(kind)
    names = [field.name for field in fields(kind) if field.name != "emission"]
    words = {name: found for name in names if (found := _words(hints[name]))}
    numbers = {name: NUMBERS.get(name) or _numbers(kind, name) for name in names if name not in words}
    grid = [dict(zip(numbers, values)) for values in itertools.product(*numbers.values())]
    choices = [{name: word} for name, found in words.items() for word in found]
    middle = {name: values[len(values) // 2] for name, values in numbers.items()}
    return [kind(**values) for values in grid] + [kind(**(middle | choice)) for choice in choices]


def _numbers(kind: type[Material], name: str) -> tuple[Any, ...]:
    """A color, or the ends and the middle of the range in the field's type; its default where it has no two ends."""
    hint, default = get_type_hints(kind, include_extras=True)[name], getattr(kind(), name)
    if isinstance(default, tuple):
        return (COLOR,)
    limits = [getattr(limit, end) for limit in get_args(hint)[1:] for end in ("ge", "gt", "le", "lt")
              if hasattr(limit, end)]
    return (min(limits), sum(limits) / 2, max(limits)) if len(limits) == 2 else (default,)


def _words(hint: Any) -> list[str]:
    """The strings that a Literal, alone or in a union, allows."""
    if get_origin(hint) is Literal:
        return list(get_args(hint))
    return [word for part in get_args(hint) for word in _words(part)]


@dataclass
class Bsdfs:
    """Materials on a device; `code[i]` names the i-th to the kernels."""

    materials: list[Material]
    probe: Probe
    code: NDArray[np.int32]

    def sample(self, which: int, wo: Doubles, numbers: Doubles) -> tuple[Doubles, Doubles, Doubles, Doubles]:
        """wi (n, 3), weight (n, 3), pdf (n,), specular (n,) for one wo (3,) and numbers (n, 3) in [0, 1)."""
        n = len(numbers)
        out = self.probe("bsdf_sample", 8, np.full(n, self.code[which]), np.tile(wo, (n, 1)), numbers)
        return out[:, :3], out[:, 3:6], out[:, 6], out[:, 7]

    def value(self, which: NDArray[np.intp] | int, wo: Doubles, wi: Doubles) -> tuple[Doubles, Doubles]:
        """f·|cos| (n, 3) and pdf (n,) for wi (n, 3); which (n,) or one, wo (n, 3) or (3,)."""
        codes = np.broadcast_to(self.code[which], len(wi))
        out = self.probe("bsdf_value", 4, codes, np.broadcast_to(wo, wi.shape), wi)
        return out[:, :3], out[:, 3]


def bsdfs(device: Device, materials: list[Material] | None = None) -> Bsdfs:
    """These materials, or all variants of all."""
    wanted = materials or [material for kind in MATERIALS for material in variants(kind)]
    probe = Probe(device, Scene(spheres=[Sphere(material=material) for material in wanted]))
    return Bsdfs(wanted, probe, probe.compiled.buffers["spheres"][1]["material"])


def view(cosine: float) -> Doubles:
    """A unit wo at an angle to the normal, with components that float32 holds.

    At GRAZING it is along x, where a mirror-like lobe is 1e-7 wide in azimuth, which float32 resolves only around 0.
    """
    sine, azimuth = np.sqrt(1 - cosine**2), 0.0 if cosine == GRAZING else AZIMUTH
    return np.array([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], np.float32).astype(np.float64)


def uniform(count: int, seed: int) -> Doubles:
    """(count, 3) numbers in [0, 1) that float32 holds exactly."""
    return np.random.default_rng(seed).integers(1 << 24, size=(count, 3)) / (1 << 24)
