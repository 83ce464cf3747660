"""Mean emission of triangles with an emission texture, which determines how they are sampled as lights."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene.model import Mesh
from ..scene.pictures import linear_from_srgb
from ..scene.textures import Texture

Doubles = NDArray[np.float64]


def mean_emission(mesh: Mesh) -> Doubles:
    """Return (m, 3), for each triangle the mean, in [0, 1], of its emission texels over the bounding box of its UVs.

    The box is one texel wider on each side, as filtering reads these; if it leaves the image, the mean is that of the
    whole image. It is 0 only if nothing is emitted, and 1 without a texture.
    """
    texture = mesh.material.emission
    uv = mesh.uv1 if isinstance(texture, Texture) and texture.uv_set else mesh.uv
    if not isinstance(texture, Texture) or uv is None:
        return np.ones((len(mesh.faces), 3))
    return mean_texels(texture, uv[mesh.faces].astype(np.float64))


def mean_texels(texture: Texture, uv: Doubles) -> Doubles:
    """Return (m, 3), the same for texture coordinates (m, corners, 2)."""
    encoded = texture.picture.texels[..., :3].astype(np.float32) / np.float32(255)
    linear = linear_from_srgb(encoded).astype(np.float64)
    clamped = np.array([wrap == "clamp" for wrap in texture.wrap])
    placed = (uv @ texture.to_picture[:, :2].T + texture.to_picture[:, 2]) * linear.shape[1::-1]
    for axis, wrap in zip((1, 0), texture.wrap):
        if wrap == "mirror":    # the same as repeating the picture and its mirror image
            linear = np.concatenate([linear, np.flip(linear, axis)], axis)
    size = np.array(linear.shape[1::-1])
    # By whole periods, so that the first corner lies inside; beyond a picture that is clamped are its outermost texels.
    placed -= np.where(clamped, 0, np.floor(placed[:, :1] / size) * size)
    low, high = np.floor(placed.min(axis=1) - 1), np.ceil(placed.max(axis=1) + 1)
    outside = ((low < 0) | (high > size)) & ~clamped
    low = np.where(outside, 0, np.clip(low, 0, size - 1)).astype(np.int64)
    high = np.where(outside, size, np.clip(high, 1, size)).astype(np.int64)
    sums = np.zeros((size[1] + 1, size[0] + 1, 3))
    sums[1:, 1:] = linear.cumsum(axis=0).cumsum(axis=1)
    (left, top), (right, bottom) = low.T, high.T
    inside = sums[bottom, right] - sums[top, right] - sums[bottom, left] + sums[top, left]
    # Differences of long sums may deviate from 0 by rounding; one level of one texel is 3e-4.
    mean = inside / ((right - left) * (bottom - top))[:, None]
    return np.asarray(np.where(inside > 1e-5, mean, 0.0))
