"""Mean emission of triangles with an emission texture, which determines how they are sampled as lights."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ....formats.images.image_reader import linear_from_srgb
from ....scene.materials.textures import Texture, Wrap
from ....scene.model import Mesh

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
    size = np.array(linear.shape[1::-1])
    placed = (uv @ texture.to_picture[:, :2].T + texture.to_picture[:, 2]) * size
    boxes = [_texels(placed[..., axis], int(size[axis]), texture.wrap[axis]) for axis in range(2)]
    low, high = (np.column_stack(ends) for ends in zip(*boxes))
    sums = np.zeros((size[1] + 1, size[0] + 1, 3))
    sums[1:, 1:] = linear.cumsum(axis=0).cumsum(axis=1)
    (left, top), (right, bottom) = low.T, high.T
    inside = sums[bottom, right] - sums[top, right] - sums[bottom, left] + sums[top, left]
    # Differences of long sums may deviate from 0 by rounding; one level of one texel is 3e-4.
    mean = inside / ((right - left) * (bottom - top))[:, None]
    return np.asarray(np.where(inside > 1e-5, mean, 0.0))


def _texels(at: Doubles, size: int, wrap: Wrap) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the first and end (m,) of the columns or rows that triangles read; all if their box leaves the image.

    at: (m, corners), unwrapped coordinates in texels.
    """
    if wrap == "clamp":
        at = np.clip(at, 0, size)
    else:  # by whole images, so that the first corner lies inside, or in the mirrored one after it
        period = size if wrap == "repeat" else 2 * size
        at = at - np.floor(at[:, :1] / period) * period
        at = np.where(at[:, :1] >= size, 2 * size - at, at)
    low, high = np.floor(at.min(axis=1) - 1).astype(np.int64), np.ceil(at.max(axis=1) + 1).astype(np.int64)
    if wrap == "clamp":  # beyond the edge are its own texels
        low, high = np.maximum(low, 0), np.minimum(high, size)
    outside = (low < 0) | (high > size)
    return np.where(outside, 0, low), np.where(outside, size, high)
