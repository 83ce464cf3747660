"""Random choices for small scenes that the oracle supports, and random materials."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any, TypeVar, get_args

import numpy as np

from clrt.scene.light_images import LightImage
from clrt.scene.materials.material import Material
from clrt.scene.materials.material_types import (
    BlinnPhong,
    Conductor,
    Dielectric,
    Diffuse,
    MetallicRoughness,
    Mirror,
    Phong,
    Plastic,
    Principled,
    SmithTerm,
)
from clrt.scene.materials.metallic_roughness import Coupling, Smith
from clrt.scene.materials.plastic import Distribution
from clrt.scene.materials.presets import CONDUCTORS, F0_PRESETS
from clrt.scene.materials.textures import Channel, Picture, Texture, Wrap

Drawn = TypeVar("Drawn")
Color = tuple[float, float, float]

#: Texels per side.
TEXELS = 4
#: Lobes of lower roughness make single paths so bright that means over thousands of them have little significance.
SMOOTHEST = 0.3


class Draws:
    """Random source whose structural choices are equal for all scenes of a batch, so that they share programs,
    while numbers differ per scene."""

    def __init__(self, seed: int, batch: int, number: int) -> None:
        self._choices = np.random.default_rng([seed, batch])
        self._numbers = np.random.default_rng([seed, batch, number])

    def one_of(self, options: Iterable[Drawn], weights: Sequence[float] | None = None) -> Drawn:
        """Return a choice of the batch, with these probabilities."""
        listed = list(options)
        return listed[int(self._choices.choice(len(listed), p=weights))]

    def chance(self, probability: float) -> bool:
        """Return true with this probability, for the whole batch."""
        return bool(self._choices.random() < probability)

    def between(self, low: float, high: float) -> float:
        """Return a uniform number of the scene."""
        return float(self._numbers.uniform(low, high))

    def vector(self, low: float = -1.0, high: float = 1.0) -> Color:
        """Return three uniform numbers of the scene."""
        return self.between(low, high), self.between(low, high), self.between(low, high)

    def texture(self, factor: float | Color, lowest: int = 40) -> Texture:
        """Return a texture with random texels and a random transform."""
        texels = self._numbers.integers(lowest, 256, (TEXELS, TEXELS, 4), np.uint8)
        wrap: tuple[Wrap, Wrap] = self.one_of(get_args(Wrap)), self.one_of(get_args(Wrap))
        return Texture(
            picture=Picture(texels),
            factor=factor,
            channel=self.one_of(get_args(Channel)),
            wrap=wrap,
            uv_set=self.one_of((0, 1)),
            offset=(self.between(-1, 1), self.between(-1, 1)),
            scale=(self.between(-2, 2), self.between(0.5, 2)),
            rotation_degrees=self.between(-180, 180),
            filter=self.one_of(("linear", "nearest")),
        )

    def light_image(self) -> LightImage | None:
        """Return the image of a light, which some have not."""
        if self.chance(0.3):
            return None
        return LightImage(
            pixels=self._numbers.uniform(0.2, 1, (TEXELS, TEXELS + 1, 3)).astype(np.float32),
            offset=(self.between(-1, 1), self.between(-1, 1)),
            scale=(self.between(-2, 2), self.between(0.5, 2)),
            rotation_degrees=self.between(-180, 180),
            wrap=self.one_of((None, ("repeat", "mirror"), ("mirror", "clamp"))),
            filter=self.one_of(("linear", "nearest")),
        )

    def color(self, low: float = 0.1, high: float = 0.95) -> Color | Texture:
        """Return a random color, or a texture in a fifth of the cases."""
        return self.texture(self.vector(0.5, 1.0)) if self.chance(0.2) else self.vector(low, high)

    def number(self, low: float, high: float = 1.0) -> float | Texture:
        """Return a random number, or a texture in a fifth of the cases."""
        return self.texture(high, int(255 * low / high) + 1) if self.chance(0.2) else self.between(low, high)


def random_material(draws: Draws, kind: type[Material], opaque: bool = False) -> Material:
    """Return a random material of a type. opaque: whether it blocks all light from both sides."""
    material = kind(**DRAWERS[kind](draws))
    if draws.chance(0.1):
        material = replace(material, emission=draws.vector(0.0, 0.6))
    if opaque or draws.chance(0.7):
        return material
    if draws.chance(0.3):
        return replace(material, one_sided=True)
    return replace(material, opacity=draws.number(0.2, 0.9), alpha_cutoff=draws.one_of((None, None, 0.5)))


def _diffuse(draws: Draws) -> dict[str, Any]:
    return {"color": draws.color()}


def _mirror(draws: Draws) -> dict[str, Any]:
    return {"color": draws.color(0.5, 1.0)}


def _dielectric(draws: Draws) -> dict[str, Any]:
    least, most = draws.one_of(((1.1, 2.0), (0.5, 0.9)))
    given: dict[str, Any] = {"color": draws.color(0.5, 1.0), "ior": draws.between(least, most)}
    given["roughness"] = draws.number(SMOOTHEST) if draws.chance(0.5) else 0.0
    inside = draws.one_of(("clear", "thin", "absorbing"))
    if inside == "absorbing":
        given |= {"attenuation_color": draws.vector(0.1, 0.9), "attenuation_distance": draws.between(0.2, 2.0)}
    if given["roughness"] == 0.0 and inside != "thin" and draws.chance(0.3):
        given |= {"dispersion": draws.between(0.5, 10.0)}
    elif draws.chance(0.3):
        given |= {"multiple_scattering": False, "distribution": draws.one_of(get_args(Distribution))}
        given |= {"smith": draws.one_of(get_args(SmithTerm)), "reflectance": draws.color(0.5, 1.0)}
    return given | {"thin": inside == "thin"}


def _conductor(draws: Draws) -> dict[str, Any]:
    given: dict[str, Any] = {"roughness": draws.number(SMOOTHEST), "preset": draws.one_of(CONDUCTORS)}
    given |= {"eta": draws.vector(0.2, 3.0), "k": draws.vector(0.0, 5.0)} if draws.chance(0.3) else {}
    given |= {"distribution": "beckmann"} if draws.chance(0.3) else {}
    given |= {"smith": "separable"} if draws.chance(0.3) else {}
    return given | ({"reflectance": draws.color()} if draws.chance(0.3) else {})


def _metallic_roughness(draws: Draws) -> dict[str, Any]:
    given: dict[str, Any] = {
        "color": draws.color(),
        "roughness": draws.number(SMOOTHEST),
        "ior": draws.between(1.0, 2.5),
        "metallic": draws.one_of((0.0, 1.0, draws.number(0.0))),
        "smith": draws.one_of(get_args(Smith)),
    }
    if draws.chance(0.3):
        given |= {"specular": draws.number(0.0), "specular_color": draws.color(0.2, 2.0)}
    given |= _layers(draws)
    coupling = draws.one_of((None, *get_args(Coupling)))
    # The oracle supports multiple scattering of metals only with the albedo coupling.
    given |= {"coupling": coupling, "multiple_scattering": None if coupling in (None, "albedo") else False}
    if MetallicRoughness(**given).coupled_by == "albedo" and draws.chance(0.3):
        given |= {"diffuse_transmission": draws.number(0.0), "diffuse_transmission_color": draws.color()}
    return given | {"preset": draws.one_of(F0_PRESETS) if draws.chance(0.2) else None}


def _layers(draws: Draws) -> dict[str, Any]:
    """Return a random subset of clearcoat, sheen and transmission."""
    given: dict[str, Any] = {}
    if draws.chance(0.3):
        given |= {"clearcoat": draws.number(0.0), "clearcoat_roughness": draws.number(SMOOTHEST)}
    if draws.chance(0.3):
        given |= {"sheen_color": draws.color(0.0, 1.0), "sheen_roughness": draws.number(0.0)}
    return given | ({"transmission": draws.number(0.0)} if draws.chance(0.3) else {})


def _phong(draws: Draws) -> dict[str, Any]:
    return {"color": draws.color(), "specular": draws.color(0.0, 0.8), "shininess": 10 ** draws.between(0.0, 1.7)}


def _plastic(draws: Draws) -> dict[str, Any]:
    return {
        "color": draws.color(),
        "ior": draws.between(1.1, 2.0),
        "roughness": draws.between(SMOOTHEST, 0.9),
        "specular": draws.color(0.2, 1.0),
        "distribution": draws.one_of(get_args(Distribution)),
        "nonlinear": draws.chance(0.5),
    }


def _principled(draws: Draws) -> dict[str, Any]:
    """Return random parameters; anisotropy needs tangents, which the oracle has not."""
    least, most = draws.one_of(((1.05, 2.0), (0.5, 0.9)))
    given: dict[str, Any] = {"color": draws.color(), "roughness": draws.number(SMOOTHEST)}
    given |= {"ior": draws.between(least, most), "metallic": draws.one_of((0.0, 1.0, draws.number(0.0)))}
    for name in ("spec_trans", "spec_tint", "flatness"):
        given |= {name: draws.number(0.0)} if draws.chance(0.3) else {}
    if draws.chance(0.3):
        given |= {"sheen": draws.number(0.0), "sheen_tint": draws.number(0.0)}
    if draws.chance(0.3):
        given |= {"clearcoat": draws.number(0.0), "clearcoat_gloss": draws.number(0.0, 0.5)}
    return given


DRAWERS: dict[type[Material], Callable[[Draws], dict[str, Any]]] = {
    Diffuse: _diffuse,
    Mirror: _mirror,
    Dielectric: _dielectric,
    Conductor: _conductor,
    MetallicRoughness: _metallic_roughness,
    Phong: _phong,
    BlinnPhong: _phong,
    Plastic: _plastic,
    Principled: _principled,
}
