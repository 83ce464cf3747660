"""A glTF primitive's material: the metallic-roughness factors, times the mean of each texture.

Until textures are drawn, a texture counts by the mean of the texels that the primitive's vertices address. For low-poly
models, whose texture is a palette, that is the primitive's true mean colour.
"""

from __future__ import annotations

import logging

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from . import gltf_document as gltf
from .gltf_data import GltfData
from .materials import Material, MetallicRoughness
from .pictures import linear_from_srgb, read_texels

log = logging.getLogger(__name__)

#: Stands for a base colour texture that cannot be read.
GREY = 0.8


class Materials:
    """The materials of one file; reads each picture once."""

    def __init__(self, data: GltfData) -> None:
        self._data = data
        self._pictures: dict[int, NDArray[np.uint8] | None] = {}

    def material(self, primitive: gltf.Primitive, user: str) -> Material:
        """The primitive's material with all values cut to their limits; the specification's default if it has none."""
        source = gltf.Material()
        if primitive.material is not None:
            source = gltf.entry(self._data.document.materials, primitive.material, "material", user)
        pbr = source.pbrMetallicRoughness
        color = np.array(pbr.baseColorFactor[:3]) * self._color(pbr.baseColorTexture, primitive, user, GREY)
        glow = np.array(source.emissiveFactor) * self._color(source.emissiveTexture, primitive, user, 0.0)
        glow *= source.extensions.KHR_materials_emissive_strength.emissiveStrength
        roughness, metallic = pbr.roughnessFactor, pbr.metallicFactor
        if pbr.metallicRoughnessTexture is not None:
            texels = self._texels(pbr.metallicRoughnessTexture, primitive, user)
            green, blue = (1.0, 0.0) if texels is None else texels.mean(axis=0, dtype=np.float64)[1:]
            roughness, metallic = roughness * green, metallic * blue
        red, green, blue = color.clip(0, 1).tolist()
        glow_red, glow_green, glow_blue = glow.clip(0).tolist()
        return MetallicRoughness(color=(red, green, blue), emission=(glow_red, glow_green, glow_blue),
                                 metallic=float(np.clip(metallic, 0, 1)), roughness=float(np.clip(roughness, 0, 1)))

    def _color(self, info: gltf.TextureInfo | None, primitive: gltf.Primitive, user: str, missing: float,
               ) -> NDArray[np.float64] | float:
        """The mean linear colour of a texture, 1 without one, `missing` for one that cannot be read."""
        if info is None:
            return 1.0
        texels = self._texels(info, primitive, user)
        return missing if texels is None else linear_from_srgb(texels).mean(axis=0, dtype=np.float64)

    def _texels(self, info: gltf.TextureInfo, primitive: gltf.Primitive, user: str) -> NDArray[np.float32] | None:
        """The texel, (n, 3) from 0 to 1 as stored, at each vertex's texture coordinates; None if there are none."""
        texture = gltf.entry(self._data.document.textures, info.index, "texture", user)
        coordinates = primitive.attributes.get(f"TEXCOORD_{info.texCoord}")
        if texture.source is None or coordinates is None:
            return None
        pixels = self._picture(texture.source, f"texture {info.index}")
        uv = self._data.array(coordinates, "VEC2", user).astype(np.float64)
        uv = uv[np.isfinite(uv).all(axis=1)]
        if pixels is None or len(uv) == 0:
            return None
        size = np.array(pixels.shape[1::-1])
        column, row = np.minimum(uv % 1.0 * size, size - 1).astype(np.int64).T
        return np.asarray(pixels[row, column] / 255, np.float32)

    def _picture(self, index: int, user: str) -> NDArray[np.uint8] | None:
        """The pixels of an image, (h, w, 3) as stored; None, with a warning, if it cannot be read."""
        if index not in self._pictures:
            image = gltf.entry(self._data.document.images, index, "image", user)
            try:
                content = (self._data.resource(image.uri or "", user) if image.bufferView is None
                           else self._data.view(image.bufferView, user).tobytes())
                self._pictures[index] = read_texels(content, f"image {index}")[..., :3]
            except SceneError as error:
                log.warning("%s: a texture is left out: %s", self._data.path, error)
                self._pictures[index] = None
        return self._pictures[index]
