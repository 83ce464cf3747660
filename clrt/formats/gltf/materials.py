"""Material of a glTF primitive: metallic-roughness, textured if the primitive has texture coordinates."""

from __future__ import annotations

import logging
import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...scene.materials.material import BELOW_ONE
from ...scene.materials.material_types import Material, MetallicRoughness
from ...scene.materials.textures import Channel, Picture, Texture, Wrap
from ..images.image_reader import read_texels
from . import material_schema as looks, schema as gltf
from .accessors import GltfData
from .solid_glass import glass

log = logging.getLogger(__name__)

WRAPS: dict[int, Wrap] = {10497: "repeat", 33648: "mirror", 33071: "clamp"}
NEAREST = 9728
#: Upper limit of a material's ior.
MOST_IOR = 4.0
#: Value of a base color texture that cannot be read.
GREY = 0.8


class Materials:
    """Materials of one file; each image is read once."""

    def __init__(self, data: GltfData) -> None:
        self._data = data
        self.names = gltf.material_names(data.document)
        self._pictures: dict[int, Picture | None] = {}
        #: Features that had an effect in the file, but are not rendered, by the material's name.
        self.unused: dict[str, list[str]] = {}

    def material(
        self, primitive: gltf.Primitive, user: str, uv: list[NDArray[np.float32] | None], faces: NDArray[np.int32]
    ) -> Material:
        """Return the primitive's material with all values clamped to their limits, or the specification's default if it
        has none. uv, faces: its texture coordinates, both sets, and triangles.

        A texture is replaced by white if the primitive has no coordinates for it or if it cannot be read; a base color
        texture by grey, an emission texture by black.
        """
        if primitive.material is None:
            return MetallicRoughness(color=(1.0, 1.0, 1.0), metallic=1.0, roughness=1.0)
        source = gltf.entry(self._data.document.materials, primitive.material, "material", user)
        pbr = source.pbrMetallicRoughness
        base = self._texture(pbr.baseColorTexture, primitive, user)
        gloss = self._texture(pbr.metallicRoughnessTexture, primitive, user)
        made = MetallicRoughness(
            color=_colored(_cut(pbr.baseColorFactor[:3]), base, pbr.baseColorTexture, GREY),
            metallic=_numbered(_unit(pbr.metallicFactor), gloss, "blue"),
            roughness=_numbered(_unit(pbr.roughnessFactor), gloss, "green"),
            emission=self._emission(source, primitive, user),
            double_sided=source.doubleSided,
            **self._layers(source.extensions, primitive, user),
        )
        made = replace(made, normal_map=self._bend(source.normalTexture, primitive, user))
        coverage = _coverage(source, base, "COLOR_0" in primitive.attributes)
        solid = glass(source.extensions, made, uv, faces)
        lost = {
            "alphaMode": coverage.get("opacity", 1.0) != 1,
            **{layer.lower(): layer in made.features() for layer in ("CLEARCOAT", "SHEEN", "SPECULAR")},
        }
        if solid is None:
            volume = source.extensions.KHR_materials_volume.thicknessFactor > 0
            lost = {"volume": volume and made.transmission != 0 and made.metallic != 1}
        if any(lost.values()):
            self.unused[self.names[primitive.material]] = [name for name, is_lost in lost.items() if is_lost]
        return replace(made, **coverage) if solid is None else solid

    def _layers(self, extensions: looks.MaterialExtensions, primitive: gltf.Primitive, user: str) -> dict[str, Any]:
        """Return the fields for the extensions in use."""
        coat, sheen = extensions.KHR_materials_clearcoat, extensions.KHR_materials_sheen
        specular, transmission = extensions.KHR_materials_specular, extensions.KHR_materials_transmission
        ior, beyond = _ior(extensions.KHR_materials_ior.ior)
        red, green, blue = (beyond * value for value in _positive(specular.specularColorFactor))

        def number(factor: float, info: looks.TextureInfo | None, channel: Channel) -> float | Texture:
            return _numbered(_unit(factor), self._texture(info, primitive, user) if factor > 0 else None, channel)

        def color(factor: tuple[float, float, float], info: looks.TextureInfo | None) -> Any:
            return _colored(factor, self._texture(info, primitive, user) if max(factor) > 0 else None, info, 1.0)

        return {
            "ior": ior,
            "clearcoat": number(coat.clearcoatFactor, coat.clearcoatTexture, "red"),
            "clearcoat_roughness": number(coat.clearcoatRoughnessFactor, coat.clearcoatRoughnessTexture, "green"),
            "clearcoat_normal_map": self._bend(
                coat.clearcoatNormalTexture if coat.clearcoatFactor > 0 else None, primitive, user
            ),
            "sheen_color": color(_cut(sheen.sheenColorFactor), sheen.sheenColorTexture),
            "sheen_roughness": number(sheen.sheenRoughnessFactor, sheen.sheenRoughnessTexture, "alpha"),
            "specular": number(specular.specularFactor, specular.specularTexture, "alpha"),
            "specular_color": color((red, green, blue), specular.specularColorTexture),
            "transmission": number(transmission.transmissionFactor, transmission.transmissionTexture, "red"),
        }

    def _bend(self, info: looks.NormalTextureInfo | None, primitive: gltf.Primitive, user: str) -> Texture | None:
        texture = self._texture(info, primitive, user)
        return None if texture is None or info is None else replace(texture, factor=max(info.scale, 0.0))

    def _emission(
        self, source: looks.Material, primitive: gltf.Primitive, user: str
    ) -> tuple[float, float, float] | Texture:
        strength = max(source.extensions.KHR_materials_emissive_strength.emissiveStrength, 0.0)
        red, green, blue = (strength * max(value, 0.0) for value in source.emissiveFactor)
        glow = self._texture(source.emissiveTexture, primitive, user) if max(red, green, blue) else None
        return _colored((red, green, blue), glow, source.emissiveTexture, 0.0)

    def _texture(self, info: looks.TextureInfo | None, primitive: gltf.Primitive, user: str) -> Texture | None:
        """Return a texture; None if there is none, if its coordinates are missing, or if its image cannot be read."""
        if info is None:
            return None
        texture = gltf.entry(self._data.document.textures, info.index, "texture", user)
        placed = info.extensions.KHR_texture_transform
        uv_set = info.texCoord if placed.texCoord is None else placed.texCoord
        if uv_set > 1 or f"TEXCOORD_{uv_set}" not in primitive.attributes:
            log.warning("%s: %s has no texture coordinates %d; its texture is left out", self._data.path, user, uv_set)
            return None
        webp = texture.extensions.EXT_texture_webp
        source = texture.source if webp is None else webp.source
        picture = None if source is None else self._picture(source, f"texture {info.index}")
        if picture is None:
            return None
        sampler = looks.Sampler()
        if texture.sampler is not None:
            sampler = gltf.entry(self._data.document.samplers, texture.sampler, "sampler", f"texture {info.index}")
        wrap = WRAPS[sampler.wrapS], WRAPS[sampler.wrapT]
        return Texture(
            picture=picture,
            uv_set=uv_set,
            offset=placed.offset,
            scale=placed.scale,
            wrap=wrap,
            rotation_degrees=math.degrees(placed.rotation),
            filter="nearest" if sampler.magFilter == NEAREST else "linear",
        )

    def _picture(self, index: int, user: str) -> Picture | None:
        """Return an image; None, with a warning, if it cannot be read."""
        if index not in self._pictures:
            image = gltf.entry(self._data.document.images, index, "image", user)
            try:
                content = (
                    self._data.resource(image.uri or "", user)
                    if image.bufferView is None
                    else self._data.view(image.bufferView, user).tobytes()
                )
                self._pictures[index] = Picture(read_texels(content, f"image {index}"), image.name or f"image {index}")
            except SceneError as error:
                log.warning("%s: a texture is left out: %s", self._data.path, error)
                self._pictures[index] = None
        return self._pictures[index]


def _coverage(source: looks.Material, base: Texture | None, vertex_colors: bool) -> dict[str, Any]:
    """Return opacity and alpha_cutoff of the material's alpha mode."""
    if source.alphaMode == "OPAQUE":
        return {}
    opacity = _numbered(_unit(source.pbrMetallicRoughness.baseColorFactor[3]), base, "alpha")
    most = BELOW_ONE if opacity == 1 and vertex_colors else 1.0
    opacity = most if opacity == 1 else opacity
    if source.alphaMode == "BLEND":
        return {"opacity": opacity}
    if source.alphaCutoff > 1:  # no alpha reaches it (specification 3.9.4)
        return {"opacity": 0.0}
    return {"opacity": opacity, "alpha_cutoff": most * _unit(source.alphaCutoff)}


def _colored(
    factor: tuple[float, float, float], texture: Texture | None, info: looks.TextureInfo | None, missing: float
) -> tuple[float, float, float] | Texture:
    """Return a color times its texture, or times `missing` if the texture is unavailable."""
    if texture is not None:
        return replace(texture, factor=factor)
    red, green, blue = (value * (1.0 if info is None else missing) for value in factor)
    return red, green, blue


def _numbered(factor: float, texture: Texture | None, channel: Channel) -> float | Texture:
    return factor if texture is None else replace(texture, factor=factor, channel=channel)


def _ior(ior: float) -> tuple[float, float]:
    """Return the ior within the limits of a material, and by how much its reflectance is too small then. glTF's 0 means
    infinity."""
    if 0 < ior <= MOST_IOR:
        return max(ior, 1.0), 1.0
    return MOST_IOR, _reflectance(ior) / _reflectance(MOST_IOR)


def _reflectance(ior: float) -> float:
    """Return the reflectance at normal incidence; 1 for glTF's 0."""
    return ((ior - 1) / (ior + 1)) ** 2


def _positive(color: tuple[float, float, float]) -> tuple[float, float, float]:
    red, green, blue = (max(value, 0.0) for value in color)
    return red, green, blue


def _unit(value: float) -> float:
    return float(np.clip(value, 0, 1))


def _cut(color: tuple[float, ...]) -> tuple[float, float, float]:
    red, green, blue = map(_unit, color)
    return red, green, blue
