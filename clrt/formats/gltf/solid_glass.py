"""glTF materials that become a solid Dielectric: transmissive, not metallic, with a volume."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...scene.materials.material_types import Dielectric, MetallicRoughness
from ...scene.materials.textures import Picture, Texture, Wrap
from .material_schema import MaterialExtensions

#: JPEG artifacts raise black texels up to about this value.
NOISE = 0.05


def glass(
    extensions: MaterialExtensions,
    made: MetallicRoughness,
    uv: list[NDArray[np.float32] | None],
    faces: NDArray[np.int32],
) -> Dielectric | None:
    """Return the material as a solid, or None unless it has a volume, transmits fully and is not metallic anywhere on
    these faces, (m, 3); `uv`: the two sets of texture coordinates, (n, 2). Only the faces' texels count, since a
    texture is often an atlas of several materials."""
    volume = extensions.KHR_materials_volume
    if volume.thicknessFactor <= 0 or made.transmission != 1 or _largest(made.metallic, uv, faces) > NOISE:
        return None
    distance = volume.attenuationDistance
    red, green, blue = (float(np.clip(value, 0, 1)) for value in volume.attenuationColor)
    return Dielectric(
        color=made.color,
        ior=made.ior,
        roughness=made.roughness,
        emission=made.emission,
        normal_map=made.normal_map,
        double_sided=made.double_sided,
        attenuation_color=(red, green, blue),
        attenuation_distance=distance if distance is not None and distance > 0 else None,
    )


def _largest(value: float | Texture, uv: list[NDArray[np.float32] | None], faces: NDArray[np.int32]) -> float:
    """Return the largest value of a parameter at the faces' centroids."""
    if not isinstance(value, Texture):
        return value
    coordinates = uv[value.uv_set]
    if coordinates is None or not isinstance(value.factor, (int, float)):
        return 1.0
    middles = coordinates[faces].astype(np.float64).mean(axis=1)
    placed = np.column_stack([middles, np.ones(len(middles))]) @ value.to_picture.T
    texels = value.picture.texels[
        _rows(placed[:, 1], value.wrap[1], value.picture, 0), _rows(placed[:, 0], value.wrap[0], value.picture, 1)
    ]
    channel = ("red", "green", "blue", "alpha").index(value.channel)
    return float(value.factor * texels[:, channel].max(initial=0) / 255)


def _rows(at: NDArray[np.float64], wrap: Wrap, picture: Picture, axis: int) -> NDArray[np.int64]:
    """Return the row indices, or column indices for axis 1, of the texels at these coordinates."""
    size = picture.texels.shape[axis]
    if wrap == "clamp":
        inside = np.clip(at, 0, 1)
    else:
        inside = np.mod(at, 1) if wrap == "repeat" else 1 - np.abs(np.mod(at, 2) - 1)
    return np.asarray(np.minimum(np.nan_to_num(inside) * size, size - 1), np.int64)
