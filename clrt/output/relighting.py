"""Relighting: mixing of an image's light groups, without rendering it again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..aov_types import OF_GROUP
from ..errors import SceneError, UsageError, did_you_mean
from ..file_names import StrPath
from ..float_errors import with_default_errors
from ..formats.images.image_reader import read_layers, read_named_layers
from ..scene.fields.field_types import FLOAT32_MAX
from ..scene.fields.keywords import with_known_keywords
from .image import Image

FloatArray = NDArray[np.float32]
Factor = float | Sequence[float]


@with_known_keywords
@with_default_errors
def relight(image: Image | StrPath, factors: Mapping[str, Factor]) -> Image:
    """Return the image as if the light of each group in `factors` were so many times as bright.

    image: rendered with the AOV light_groups (docs/light-groups.md), or the path of an .exr with its layers. A factor
    is a number, or three for red, green and blue, each at least 0. Without factors it is the same image, bit for bit;
    of a denoised image, the raw one. Raises UsageError for other factors and for groups that the image does not have,
    SceneError if it has none or cannot be read.
    """
    if isinstance(image, Image):
        groups, name = image.light_groups, "the image"
        alpha = image.alpha if image.backdrop is None else None
    else:
        groups, name = read_named_layers(image, OF_GROUP), str(image)
        alpha = read_layers(image)[1]
    if not groups:
        raise SceneError(f"{name}: has no layers of light groups; render it with the AOV light_groups")
    scales = {group: _scale(group, factor, groups) for group, factor in factors.items()}
    pixels = np.zeros_like(next(iter(groups.values())), np.float64)
    for group, layer in groups.items():
        pixels += scales.get(group, 1.0) * layer
    if pixels.max(initial=0) > FLOAT32_MAX:
        raise UsageError("the light groups' factors make pixels brighter than float32 can store; give smaller ones")
    return Image(pixels.astype(np.float32), alpha=alpha)


def _scale(group: str, factor: Factor, groups: Mapping[str, FloatArray]) -> NDArray[np.float64]:
    """Return a factor as an array that multiplies a layer."""
    if group not in groups:
        meant = did_you_mean(group, groups)
        raise UsageError(f"light group {group!r} is unknown; choose from {', '.join(groups)}{meant}")
    try:
        scale = np.asarray(factor, np.float64)
    except (TypeError, ValueError):
        scale = np.empty(0)
    if scale.size not in (1, 3) or not (np.isfinite(scale) & (scale >= 0)).all():
        given = ",".join(map(str, scale.reshape(-1).tolist())) or repr(factor)
        raise UsageError(f"light group {group!r}: {given} is not a factor; give a number of at least 0, or three")
    return scale.reshape(-1)
