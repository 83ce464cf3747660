"""UsdPreviewSurface as a metallic-roughness material.

Specification: UsdPreviewSurface 2.6. Not rendered: occlusion, displacement, and textures outside of a material's two
sets of texture coordinates.
"""

from __future__ import annotations

import logging
from dataclasses import replace
from math import degrees, radians
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...file_names import printable
from ...scene.materials.material import MOST_IOR
from ...scene.materials.material_types import MetallicRoughness
from ...scene.materials.textures import Channel, Picture, Texture, Wrap
from ..images.image_reader import linear_from_srgb, read_texels, srgb_from_linear
from ..referenced_files import find_file

log = logging.getLogger(__name__)
Inputs = dict[str, dict[str, Any]]
Use = Literal["color", "number", "normal"]
Rgb = tuple[float, float, float]

WRAPS: dict[str | None, Wrap] = {"repeat": "repeat", "mirror": "mirror", "clamp": "clamp", "black": "clamp"}
CHANNELS: tuple[Channel, ...] = ("red", "green", "blue", "alpha")
#: The specification's defaults of inputs.
DEFAULTS: dict[str, Any] = {
    "diffuseColor": [0.18] * 3,
    "emissiveColor": [0.0] * 3,
    "specularColor": [0.0] * 3,
    "metallic": 0.0,
    "roughness": 0.5,
    "clearcoat": 0.0,
    "clearcoatRoughness": 0.01,
    "opacity": 1.0,
    "opacityThreshold": 0.0,
    "ior": 1.5,
    "useSpecularWorkflow": 0,
}
#: Reflectance of the largest ior at normal incidence.
MOST_REFLECTANCE = ((MOST_IOR - 1) / (MOST_IOR + 1)) ** 2
#: Primvars of vertex colors.
DISPLAY_COLOR = "displayColor"


class Look(NamedTuple):
    """A material, the names of the primvars of its texture coordinates, and whether its color is that of vertices."""

    material: MetallicRoughness
    name: str
    uv: list[str]
    vertex_colors: bool


class Materials:
    """Materials of a stage, as stage_materials returns them."""

    def __init__(self, path: Path, arrays: dict[str, NDArray[Any]], facts: dict[str, Any]) -> None:
        self._path, self._arrays, self._materials, self._images = path, arrays, facts["materials"], facts["textures"]
        self._pictures: dict[tuple[object, ...], Picture] = {}
        self._texels: dict[int, NDArray[np.uint8] | None] = {}
        self._looks: dict[int, Look] = {}
        #: Names of unknown shaders and what else is not rendered.
        self.ignored: list[str] = []

    def look(self, number: int) -> Look:
        """Return a material."""
        if number not in self._looks:
            facts = self._materials[number]
            name = printable(facts["name"])
            if "unknown" in facts:
                self._ignore(f'the shader of material "{name}" ({printable(facts["unknown"])})')
                self._looks[number] = Look(MetallicRoughness(), name, [], False)
            else:
                self._looks[number] = self._read(facts["inputs"], name)
        return self._looks[number]

    def _read(self, inputs: Inputs, name: str) -> Look:
        reads = _Surface(self, inputs, name)
        color = reads.color("diffuseColor")
        specular = bool(reads.plain("useSpecularWorkflow"))
        ior = reads.plain("ior")
        fields: dict[str, Any] = {"metallic": reads.number("metallic"), "ior": _ior(ior)}
        if specular:  # the specular color is F0; as glTF's ior of infinity, see gltf/specular_glossiness.py
            f0 = reads.color("specularColor")
            fields = {"metallic": 0.0, "ior": MOST_IOR, "specular_color": _scaled(f0, 1 / MOST_REFLECTANCE)}
        threshold = reads.plain("opacityThreshold")
        material = MetallicRoughness(
            color=color,
            emission=reads.color("emissiveColor", most=None),
            roughness=reads.number("roughness"),
            clearcoat=reads.number("clearcoat"),
            clearcoat_roughness=reads.number("clearcoatRoughness"),
            opacity=reads.number("opacity"),
            alpha_cutoff=min(threshold, 1.0) if threshold > 0 else None,
            normal_map=reads.normal(),
            **fields,
        )
        if inputs.get("displacement", {}).get("texture") is not None:
            self._ignore(f'the displacement of material "{name}"')
        shown = inputs.get("diffuseColor", {}).get("primvar") == DISPLAY_COLOR
        material = replace(material, color=(1.0, 1.0, 1.0)) if shown else material
        return Look(material, name, reads.uv, shown)

    def ignore_coordinates(self, name: str) -> None:
        """Note a texture whose coordinates cannot be had."""
        self._ignore(f'a texture of material "{name}" with a third set of texture coordinates')

    def _ignore(self, what: str) -> None:
        if what not in self.ignored:
            self.ignored.append(what)

    def picture(self, given: dict[str, Any], use: Use, most: float | None) -> Picture | None:
        """Return the image of a texture, with its scale and bias unless the scale is a factor; None if it cannot be
        read. A color space of "auto" is sRGB for colors and linear for numbers."""
        texels = self.texels(given["texture"])
        if texels is None:
            return None
        encoded = given.get("space") == "sRGB" or (given.get("space") != "raw" and use == "color")
        scale, bias = _mapping(given, use) if _is_baked(given, use, most) else (np.ones(4), np.zeros(4))
        key = given["texture"], encoded, use == "color", *scale, *bias
        if key not in self._pictures:
            same = encoded == (use == "color") and (scale == 1).all() and not bias.any()
            mapped = texels if same else _mapped(texels, encoded, use == "color", scale, bias)
            self._pictures[key] = Picture(mapped, printable(self._images[given["texture"]]["name"]))
        return self._pictures[key]

    def texels(self, number: int | None) -> NDArray[np.uint8] | None:
        """Return the texels of an image; None, with a warning, if it cannot be read."""
        if number is None:
            return None
        if number not in self._texels:
            name = printable(self._images[number]["name"])
            try:
                self._texels[number] = read_texels(self.image(number), name)
            except SceneError as error:
                log.warning("%s: a texture is left out: %s", self._path, error)
                self._texels[number] = None
        return self._texels[number]

    def image(self, number: int) -> Path | bytes:
        """Return the file, or the bytes, of an image. Raises SceneError if there are none."""
        facts = self._images[number]
        if facts["packed"]:
            return self._arrays[f"texture {number}"].tobytes()
        if facts["path"]:
            return Path(facts["path"])
        found = find_file(self._path, [self._path.parent], facts["name"])
        if found is None:
            raise SceneError(f"{printable(facts['name'])}: no such image file")
        return found


class _Surface:
    """Inputs of one surface; `uv`: the names of texture coordinates that they use."""

    def __init__(self, materials: Materials, inputs: Inputs, name: str) -> None:
        self._materials, self._inputs, self._name = materials, inputs, name
        self.uv: list[str] = []

    def plain(self, name: str) -> float:
        """Return a number that cannot be a texture."""
        value = self._inputs.get(name, {}).get("value")
        return float(value) if isinstance(value, int | float) else float(DEFAULTS[name])

    def color(self, name: str, most: float | None = 1.0) -> Rgb | Texture:
        """Return a color, at most `most`, or a texture of colors."""
        given = self._inputs.get(name, {})
        texture = self._texture(given, "color", most)
        if texture is not None:
            red, green, blue, _ = _factor(given, "color", most)
            return replace(texture, factor=(red, green, blue))
        value = given.get("fallback" if "output" in given else "value")
        value = value if isinstance(value, list) and len(value) >= 3 else DEFAULTS[name]
        red, green, blue = np.clip(np.nan_to_num(value[:3]), 0, most).tolist()
        return red, green, blue

    def number(self, name: str) -> float | Texture:
        """Return a number from 0 to 1, or a texture of numbers."""
        given = self._inputs.get(name, {})
        channel = max("rgba".find(str(given.get("output"))[:1]), 0)
        texture = self._texture(given, "number", 1.0)
        if texture is not None:
            return replace(texture, factor=_factor(given, "number", 1.0)[channel], channel=CHANNELS[channel])
        fallback = given.get("fallback")
        value = fallback[channel] if isinstance(fallback, list) and "output" in given else given.get("value")
        value = float(value) if isinstance(value, int | float) else DEFAULTS[name]
        return float(np.clip(np.nan_to_num(value), 0, 1))

    def normal(self) -> Texture | None:
        """Return the normal map; scale 2 and bias −1 are those of glTF's normal maps."""
        given = self._inputs.get("normal", {})
        return self._texture(given, "normal", 1.0)

    def _texture(self, given: dict[str, Any], use: Use, most: float | None) -> Texture | None:
        """Return a texture; None if the input has none, or if it cannot be read."""
        picture = None if given.get("texture") is None else self._materials.picture(given, use, most)
        if picture is None:
            return None
        name = given.get("uv") or "st"
        if name not in self.uv:
            if len(self.uv) == 2:
                self._materials.ignore_coordinates(self._name)
                return None
            self.uv.append(name)
        wrap_s, wrap_t = (WRAPS.get(each, "repeat") for each in given["wrap"])
        return replace(
            _placed(given.get("transform") or {}),
            picture=picture,
            wrap=(wrap_s, wrap_t),
            uv_set=self.uv.index(name),
        )


def _placed(transform: dict[str, Any]) -> Texture:
    """Return a texture with a UsdTransform2d, which scales, rotates and translates coordinates with v upwards."""
    scale_u, scale_v = transform.get("scale") or (1.0, 1.0)
    shift_u, shift_v = transform.get("translation") or (0.0, 0.0)
    angle = radians(transform.get("rotation") or 0.0)
    sine, cosine = float(np.sin(angle)), float(np.cos(angle))
    return Texture(
        picture=Picture(np.zeros((1, 1, 4), np.uint8)),
        offset=(shift_u - scale_v * sine, 1 - scale_v * cosine - shift_v),
        scale=(scale_u, scale_v),
        rotation_degrees=degrees(angle),
    )


def _mapping(given: dict[str, Any], use: Use) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return scale and bias of the four channels; of normal maps those from the texels to the ones of glTF, which have
    a scale of 2 and a bias of −1. So have normal maps without both, as in programs that write them."""
    scale, bias = (
        np.array(given.get(name) or [default] * 4, np.float64) for name, default in (("scale", 1), ("bias", 0))
    )
    if use != "normal":
        return scale, bias
    if given.get("scale") is None and given.get("bias") is None:
        return np.ones(4), np.zeros(4)
    return scale / 2, (bias + 1) / 2


def _is_baked(given: dict[str, Any], use: Use, most: float | None) -> bool:
    """Return whether scale and bias are applied to the texels, since they are not a factor of at most `most`."""
    scale, bias = _mapping(given, use)
    return bool(use == "normal" or bias.any() or (scale < 0).any() or (most is not None and (scale > most).any()))


def _factor(given: dict[str, Any], use: Use, most: float | None) -> list[float]:
    """Return the factor of each channel."""
    return [1.0] * 4 if _is_baked(given, use, most) else _mapping(given, use)[0].tolist()


def _mapped(
    texels: NDArray[np.uint8], decode: bool, encode: bool, scale: NDArray[np.float64], bias: NDArray[np.float64]
) -> NDArray[np.uint8]:
    """Return texels decoded from sRGB, scaled and biased, and encoded."""
    steps = (np.arange(256) / 255).astype(np.float32)
    result = texels.copy()
    for channel in range(4):
        is_color = channel < 3
        values = linear_from_srgb(steps) if decode and is_color else steps
        values = (values * scale[channel] + bias[channel]).clip(0, 1).astype(np.float32)
        values = srgb_from_linear(values) if encode and is_color else values
        result[..., channel] = np.rint(values * 255).astype(np.uint8)[texels[..., channel]]
    return result


def _ior(ior: float) -> float:
    """Return the ior within the limits of a material; one below 1 reflects as its inverse."""
    if not np.isfinite(ior) or ior <= 0:
        return MOST_IOR
    return min(max(ior, 1 / ior), MOST_IOR)


def _scaled(color: Rgb | Texture, factor: float) -> Rgb | Texture:
    if isinstance(color, Texture):
        assert isinstance(color.factor, tuple)
        red, green, blue = (factor * value for value in color.factor)
        return replace(color, factor=(red, green, blue))
    red, green, blue = (factor * value for value in color)
    return red, green, blue
