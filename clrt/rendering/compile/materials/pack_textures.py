"""Packing of textures: the texels of all images in one buffer, and a record for each texture
(kernels/surface/texture.cl)."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from ....formats.images.image_reader import linear_from_srgb
from ....scene.materials.textures import Channel, Picture, Texture, Wrap
from ..records import LINEAR, TEXEL, TEXTURE


class PackedTextures:
    """Textures of one scene, numbered in the order of their first use."""

    def __init__(self) -> None:
        self._numbers: dict[Texture, int] = {}
        self._first: dict[Picture, int] = {}
        self._texels: list[NDArray[Any]] = []
        self._count = 0

    def number(self, texture: Texture) -> int:
        """Return its index in the buffer of textures."""
        if texture.picture not in self._first:
            texels = np.ascontiguousarray(texture.picture.texels).view("<u4").ravel()
            self._first[texture.picture] = self._count
            self._texels.append(texels)
            self._count += len(texels)
        return self._numbers.setdefault(texture, len(self._numbers))

    @property
    def uv_sets(self) -> int:
        """Number of UV sets that the textures use."""
        return max((texture.uv_set + 1 for texture in self._numbers), default=0)

    def buffers(self) -> dict[str, tuple[str, NDArray[Any]]]:
        """Return the buffers textures, texels, and the sRGB decoding table; none if there are no textures."""
        if not self._numbers:
            return {}
        records = np.zeros(len(self._numbers), TEXTURE)
        for record, texture in zip(records, self._numbers):
            record["u_row"], record["v_row"] = texture.to_picture
            record["height"], record["width"] = texture.picture.texels.shape[:2]
            record["first"] = self._first[texture.picture]
            record["wrap_u"], record["wrap_v"] = (get_args(Wrap).index(wrap) for wrap in texture.wrap)
            record["nearest"], record["uv_set"] = texture.filter == "nearest", texture.uv_set
            record["shift"] = 8 * get_args(Channel).index(texture.channel)
        table = linear_from_srgb(np.arange(256, dtype=np.float32) / np.float32(255))
        return {
            "textures": ("Texture", records),
            "texels": ("Texel", np.concatenate(self._texels).view(TEXEL)),
            "srgb": ("Linear", table.view(LINEAR)),
        }
