"""Random values for the fields of dataclasses, by type: new fields need no change here."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import MISSING, Field, fields
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from ...errors import ObjectError
from ...scene.fields.limits import Ge, Gt, Le, Limit, Lt
from ...scene.light_images import LightImage
from ...scene.materials.material import Material
from ...scene.materials.textures import Picture, Texture
from ..numerics.bsdf_cases import NUMBERS

Drawn = TypeVar("Drawn")

#: Probabilities that a field keeps its default. Each batch uses one of them, so that some scenes are simple.
USUAL = (0.3, 0.7, 0.95)
#: For other fields: the probabilities that a parameter is a texture, that a flag is set, and that an optional field is
#: None.
TEXTURED, RAISED, ABSENT = 0.25, 0.5, 0.3
#: Probabilities that a number is the low or the high end of its range, or inside.
PLACES = {"low": 0.15, "high": 0.2, "inside": 0.65}
#: Ranges of moderate draws, by suffix of the field name: a single strategy hardly samples narrower lobes and lights.
WIDE = {
    "roughness": (0.4, 1.0),
    "clearcoat_gloss": (0.0, 0.2),
    "shininess": (0.0, 30.0),
    "angle_degrees": (30.0, 180.0),
}
#: Smallest texel of moderate draws, out of 255.
DIM = 140
#: Texels per side of a texture.
TEXELS = 4
#: Fields that make the image something else than the light of the scene, and names of layers.
COMPOSITED = {"camera_visible", "catcher", "light_group"}


class Draws:
    """Random choices of one scene of a batch.

    All that programs depend on (types, strings, flags, which parameters are textures or at an end of their range) is
    equal for all scenes of a batch, which thus share programs; numbers differ per scene. moderate: without the extremes
    for which a single sampling strategy needs too many samples.
    """

    def __init__(self, seed: int, batch: int, number: int, moderate: bool = False) -> None:
        self._choices = np.random.default_rng([seed, batch])
        self._numbers = np.random.default_rng([seed, batch, number])
        self.moderate = moderate
        self._usual = self.one_of(USUAL)

    def one_of(self, options: Iterable[Drawn], weights: Sequence[float] | None = None) -> Drawn:
        """Return one of the options, the same throughout the batch; equally probable unless weights are given."""
        listed = list(options)
        return listed[int(self._choices.choice(len(listed), p=weights))]

    def chance(self, probability: float) -> bool:
        """Return True with this probability, the same throughout the batch."""
        return bool(self._choices.random() < probability)

    def between(self, low: float, high: float) -> float:
        """Return a number of the scene, uniform in this range."""
        return float(self._numbers.uniform(low, high))

    def decades(self, low: float, high: float) -> float:
        """Return a number of the scene between these powers of ten, uniform in its logarithm."""
        return float(10 ** self.between(low, high))

    def vector(self, low: float = -1.0, high: float = 1.0) -> tuple[float, float, float]:
        """Return three numbers of the scene."""
        return self.between(low, high), self.between(low, high), self.between(low, high)

    def texels(self, shape: tuple[int, ...], low: int = 0, high: int = 256) -> np.ndarray[Any, np.dtype[np.uint8]]:
        """Return texels of the scene."""
        return self._numbers.integers(low, high, shape, np.uint8)

    def record(self, kind: type[Drawn], **given: Any) -> Drawn:
        """Return a dataclass with random fields, except those given."""
        return kind(**self.values(kind, **given))

    def values(self, kind: type, **given: Any) -> dict[str, Any]:
        """Return random values for the fields of a dataclass, except those given, and these."""
        hints = get_type_hints(kind, include_extras=True)
        specular = issubclass(kind, Material) and kind().is_specular
        drawn = {
            field.name: self._field(hints[field.name], field, specular)
            for field in fields(kind)
            if field.name not in given
        }
        return given | drawn

    def material(self, kind: type[Material], **given: Any) -> Material:
        """Return a random material of a type whose fields do not conflict."""
        while True:
            with suppress(ObjectError):
                return self.record(kind, **given)

    def _field(self, hint: Any, field: Field[Any], specular: bool) -> Any:
        """Return a random value of a field; specular: whether it belongs to a material that is specular by default."""
        if field.name in COMPOSITED:
            return field.default
        narrow = self.moderate and field.name.endswith("roughness") and not specular
        if field.default is not MISSING and not narrow and self.chance(self._usual):
            return field.default
        parts = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
        plain = next((part for part in parts if part not in (NoneType, Texture)), None)
        if NoneType in parts and self.chance(ABSENT):
            return None
        if plain is None:
            return self._map()
        if plain is LightImage:
            return self._light_image()
        if Texture in parts and self.chance(TEXTURED):
            return self.texture(self._plain(plain, field.name))
        return self._plain(plain, field.name)

    def texture(self, factor: float | tuple[float, float, float]) -> Texture:
        """Return a texture with random texels and settings."""
        low = DIM if self.moderate else 0
        return self.record(Texture, picture=Picture(self.texels((TEXELS, TEXELS, 4), low)), factor=factor)

    def _map(self) -> Texture:
        """Return a normal map of moderate slopes."""
        texels = self.texels((TEXELS, TEXELS, 4), 90, 166)
        texels[..., 2:] = 255
        return self.record(Texture, picture=Picture(texels), factor=self.between(0.2, 1.0))

    def _light_image(self) -> LightImage:
        """Return an image with random pixels and settings."""
        low = DIM if self.moderate else 0
        pixels = self.texels((TEXELS, TEXELS, 3), low).astype(np.float32) / np.float32(128)
        return self.record(LightImage, pixels=pixels, name="image")

    def _plain(self, hint: Any, name: str) -> Any:
        origin, parts = get_origin(hint), get_args(hint)
        if hint is bool:
            return self.chance(RAISED)
        if origin is Literal:
            return self.one_of(parts)
        if origin is tuple:
            return tuple(self._plain(part, name) for part in parts)
        limits = {type(limit): limit.bound for limit in parts[1:]} if origin is Annotated else {}
        if (parts[0] if origin is Annotated else hint) is int:
            return self.one_of(range(int(limits.get(Ge, 0)), int(limits.get(Lt, limits.get(Le, 0) + 1))))
        return self._number(name, limits)

    def _number(self, name: str, limits: Mapping[type[Limit], float]) -> float:
        low, high = _range(name, limits)
        low, high = next((ends for end, ends in WIDE.items() if self.moderate and name.endswith(end)), (low, high))
        inside, place = self.between(low, high), self.one_of(PLACES, list(PLACES.values()))
        ends = {"low": low if Ge in limits else inside, "high": high if Le in limits else inside}
        return ends.get(place, inside)


def _range(name: str, limits: Mapping[type[Limit], float]) -> tuple[float, float]:
    """Return the range of a field's numbers: within that of NUMBERS if it is listed, finite if it has no limits."""
    if not limits:
        return (-180.0, 180.0) if name.endswith("degrees") else (-2.0, 2.0)
    low, open_end = (limits[Ge], 1.0) if Ge in limits else (limits[Gt] + 0.5, 6.0)
    high = limits.get(Le, limits.get(Lt, low + open_end))
    tried = NUMBERS.get(name, ())
    return (max(low, min(tried)), min(high, max(tried))) if len(tried) > 1 else (low, high)
