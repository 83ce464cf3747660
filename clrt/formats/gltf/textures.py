"""Textures of glTF primitives: the images of a file, with their samplers and transforms."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from dataclasses import replace

from ...errors import SceneError
from ...scene.materials.textures import Picture, Texture, Wrap
from ..images.image_reader import read_texels
from . import material_schema as looks, schema as gltf
from .accessors import GltfData

log = logging.getLogger(__name__)

WRAPS: dict[int, Wrap] = {10497: "repeat", 33648: "mirror", 33071: "clamp"}
NEAREST = 9728


class Textures:
    """Textures of one file; each image is read once. unread: those that could not be read, and why; a warning was
    logged for each."""

    def __init__(self, data: GltfData) -> None:
        self._data = data
        self._pictures: dict[int, Picture] = {}
        self._chosen: dict[tuple[int, ...], Picture | None] = {}
        self._derived: dict[tuple[int, float], Picture] = {}
        self.unread: list[str] = []

    def texture(self, info: looks.TextureInfo | None, primitive: gltf.Primitive, user: str) -> Texture | None:
        """Return a texture; None if there is none, if its coordinates are missing, or if its image cannot be read."""
        if info is None:
            return None
        texture = gltf.entry(self._data.document.textures, info.index, "texture", user)
        placed = info.extensions.KHR_texture_transform
        uv_set = info.texCoord if placed.texCoord is None else placed.texCoord
        if uv_set > 1 or f"TEXCOORD_{uv_set}" not in primitive.attributes:
            log.warning("%s: %s has no texture coordinates %d; its texture is left out", self._data.path, user, uv_set)
            return None
        picture = self._first_picture(texture.sources, f"texture {info.index}")
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

    def normal_map(self, info: looks.NormalTextureInfo | None, primitive: gltf.Primitive, user: str) -> Texture | None:
        """Return a normal map; a negative scale tilts to the other side."""
        texture = self.texture(info, primitive, user)
        if texture is None or info is None:
            return None
        turned = self.derived(texture.picture, info.scale, _turned) if info.scale < 0 else texture.picture
        return replace(texture, picture=turned, factor=abs(info.scale))

    def derived(self, picture: Picture, factor: float, make: Callable[[Picture, float], Picture]) -> Picture:
        """Return an image made of another one, the same for the same factor."""
        key = id(picture), factor
        if key not in self._derived:
            self._derived[key] = make(picture, factor)
        return self._derived[key]

    def _first_picture(self, sources: tuple[int, ...], user: str) -> Picture | None:
        """Return the first of these images that can be read; None, with a warning, if none can."""
        if not sources or sources in self._chosen:
            return self._chosen.get(sources)
        faults = list[str]()
        self._chosen[sources] = None
        for index in sources:
            try:
                self._chosen[sources] = self._picture(index, user)
                return self._chosen[sources]
            except SceneError as error:
                faults.append(str(error))
        self.unread.append(f"a texture: {'; '.join(faults)}")
        log.warning("%s: a texture is left out: %s", self._data.path, "; ".join(faults))
        return None

    def _picture(self, index: int, user: str) -> Picture:
        if index not in self._pictures:
            image = gltf.entry(self._data.document.images, index, "image", user)
            content = (
                self._data.resource(image.uri or "", user)
                if image.bufferView is None
                else self._data.view(image.bufferView, user).tobytes()
            )
            self._pictures[index] = Picture(read_texels(content, f"image {index}"), image.name or f"image {index}")
        return self._pictures[index]


def _turned(picture: Picture, scale: float) -> Picture:
    """Return a normal map whose x and y are negated."""
    texels = picture.texels.copy()
    texels[..., :2] = 255 - texels[..., :2]
    return Picture(texels, picture.name)
