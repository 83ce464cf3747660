"""Which glTF materials are solids that light passes through: those with a volume and nothing but its surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .gltf_looks import MaterialExtensions
from .materials import Dielectric, MetallicRoughness
from .textures import Picture, Texture, Wrap

#: Texels that JPEG made of black are up to about this.
NOISE = 0.05


def glass(extensions: MaterialExtensions, made: MetallicRoughness, uv: list[NDArray[np.float32] | None],
          faces: NDArray[np.int32]) -> Dielectric | None:
    """The material as a solid, where it has a volume and is a metal nowhere on these faces, (m, 3), with the two sets
    of texture coordinates `uv`, (n, 2). One picture often holds the metals of several materials, each in its place."""
    volume = extensions.KHR_materials_volume
    if volume.thicknessFactor <= 0 or made.transmission != 1 or _largest(made.metallic, uv, faces) > NOISE:
        return None
    distance = volume.attenuationDistance
    red, green, blue = (float(np.clip(value, 0, 1)) for value in volume.attenuationColor)
    return Dielectric(color=made.color, ior=made.ior, roughness=made.roughness, emission=made.emission,
                      normal_map=made.normal_map, double_sided=made.double_sided, attenuation_color=(red, green, blue),
                      attenuation_distance=distance if distance is not None and distance > 0 else None)


def _largest(value: float | Texture, uv: list[NDArray[np.float32] | None], faces: NDArray[np.int32]) -> float:
    """Of a parameter in the middles of the faces."""
    if not isinstance(value, Texture):
        return value
    coordinates = uv[value.uv_set]
    if coordinates is None or not isinstance(value.factor, (int, float)):
        return 1.0
    middles = coordinates[faces].astype(np.float64).mean(axis=1)
    placed = np.column_stack([middles, np.ones(len(middles))]) @ value.to_picture.T
    texels = value.picture.texels[_rows(placed[:, 1], value.wrap[1], value.picture, 0),
                                  _rows(placed[:, 0], value.wrap[0], value.picture, 1)]
    channel = ("red", "green", "blue", "alpha").index(value.channel)
    return float(value.factor * texels[:, channel].max(initial=0) / 255)


def _rows(at: NDArray[np.float64], wrap: Wrap, picture: Picture, axis: int) -> NDArray[np.int64]:
    """The rows, or columns with axis 1, of the texels at these coordinates."""
    size = picture.texels.shape[axis]
    if wrap == "clamp":
        inside = np.clip(at, 0, 1)
    else:
        inside = np.mod(at, 1) if wrap == "repeat" else 1 - np.abs(np.mod(at, 2) - 1)
    return np.asarray(np.minimum(np.nan_to_num(inside) * size, size - 1), np.int64)
