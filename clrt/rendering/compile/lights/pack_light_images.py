"""Packing of lights' images: the texels of all in one buffer, and a record for each image (kernels/light/image.cl)."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from ....scene.light_images import LightImage
from ....scene.materials.textures import Wrap
from ..records import LIGHT_IMAGE, LIGHT_TEXEL, TextureNumber


class PackedLightImages:
    """Images of one scene's lights, numbered in the order of their first use."""

    def __init__(self) -> None:
        self._numbers: dict[LightImage, int] = {}

    def number(self, image: LightImage) -> TextureNumber:
        """Return its index in the buffer of images."""
        return TextureNumber(self._numbers.setdefault(image, len(self._numbers)))

    def buffers(self) -> dict[str, tuple[str, NDArray[Any]]]:
        """Return the buffers light_images and light_texels; none if there are no images. Images that share pixels share
        their texels."""
        if not self._numbers:
            return {}
        records = np.zeros(len(self._numbers), LIGHT_IMAGE)
        pixels = {id(image.pixels): image.pixels for image in self._numbers}
        starts = np.cumsum([0, *(len(each) * each.shape[1] for each in pixels.values())])
        first = dict(zip(pixels, starts.tolist()))
        texels = np.zeros(starts[-1], LIGHT_TEXEL)
        for key, each in pixels.items():
            texels["value"][first[key] : first[key] + len(each) * each.shape[1]] = each.reshape(-1, 3)
        for record, image in zip(records, self._numbers):
            record["u_row"], record["v_row"] = image.to_picture
            record["height"], record["width"] = image.pixels.shape[:2]
            record["first"] = first[id(image.pixels)]
            record["wrap_u"], record["wrap_v"] = (get_args(Wrap).index(wrap) for wrap in image.wrap or ())
            record["nearest"] = image.filter == "nearest"
        return {"light_images": ("LightImage", records), "light_texels": ("LightTexel", texels)}
