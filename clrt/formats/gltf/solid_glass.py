"""glTF materials that become a solid Dielectric: transmissive, not metallic, with a volume."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...scene.materials.material_types import Dielectric, MetallicRoughness
from ...scene.materials.textures import Picture, Texture, Wrap
from .material_schema import MaterialExtensions

#: JPEG artifacts raise black texels up to about this value.
NOISE = 0.05


def glass(extensions: MaterialExtensions, made: MetallicRoughness) -> Dielectric:
    """Return the material as a solid."""
    volume = extensions.KHR_materials_volume
    distance = volume.attenuationDistance
    return Dielectric(
        color=made.color,
        ior=made.ior,
        roughness=made.roughness,
        emission=made.emission,
        normal_map=made.normal_map,
        double_sided=made.double_sided,
        dispersion=max(extensions.KHR_materials_dispersion.dispersion, 0.0) if made.roughness == 0 else 0.0,
        attenuation_color=_attenuation(extensions),
        attenuation_distance=distance if distance is not None and distance > 0 else None,
    )


def solid_faces(
    extensions: MaterialExtensions,
    made: MetallicRoughness,
    uv: list[NDArray[np.float32] | None],
    faces: NDArray[np.int32],
) -> NDArray[np.bool_]:
    """Return which faces (m, 3) are solid glass: those of a volume that transmit fully and are not metallic at their
    centroid. uv: the two sets of texture coordinates, (n, 2)."""
    if extensions.KHR_materials_volume.thicknessFactor <= 0:
        return np.zeros(len(faces), np.bool_)
    metallic, transmission = (_at_faces(value, uv, faces) for value in (made.metallic, made.transmission))
    return (metallic <= NOISE) & (transmission >= (1 - NOISE if isinstance(made.transmission, Texture) else 1))


def tinted(extensions: MaterialExtensions, made: MetallicRoughness) -> MetallicRoughness:
    """Return a sheet in the color that its volume has after its thickness."""
    volume = extensions.KHR_materials_volume
    distance = volume.attenuationDistance
    if made.transmission == 0 or made.metallic == 1 or volume.thicknessFactor <= 0 or not distance or distance < 0:
        return made
    tint = np.power(_attenuation(extensions), volume.thicknessFactor / distance)
    factor = made.color.factor if isinstance(made.color, Texture) else made.color
    red, green, blue = (np.array(factor) * tint).tolist()
    color = (red, green, blue)
    return replace(made, color=replace(made.color, factor=color) if isinstance(made.color, Texture) else color)


def _attenuation(extensions: MaterialExtensions) -> tuple[float, float, float]:
    red, green, blue = (float(np.clip(value, 0, 1)) for value in extensions.KHR_materials_volume.attenuationColor)
    return red, green, blue


def _at_faces(
    value: float | Texture, uv: list[NDArray[np.float32] | None], faces: NDArray[np.int32]
) -> NDArray[np.float64]:
    """Return a parameter at the faces' centroids, (m,)."""
    if not isinstance(value, Texture):
        return np.full(len(faces), float(value))
    coordinates = uv[value.uv_set]
    if coordinates is None or not isinstance(value.factor, (int, float)):
        return np.ones(len(faces))
    middles = coordinates[faces].astype(np.float64).mean(axis=1)
    placed = np.column_stack([middles, np.ones(len(middles))]) @ value.to_picture.T
    texels = value.picture.texels[
        _rows(placed[:, 1], value.wrap[1], value.picture, 0), _rows(placed[:, 0], value.wrap[0], value.picture, 1)
    ]
    channel = ("red", "green", "blue", "alpha").index(value.channel)
    return np.asarray(value.factor * texels[:, channel] / 255)


def _rows(at: NDArray[np.float64], wrap: Wrap, picture: Picture, axis: int) -> NDArray[np.int64]:
    """Return the row indices, or column indices for axis 1, of the texels at these coordinates."""
    size = picture.texels.shape[axis]
    if wrap == "clamp":
        inside = np.clip(at, 0, 1)
    else:
        inside = np.mod(at, 1) if wrap == "repeat" else 1 - np.abs(np.mod(at, 2) - 1)
    return np.asarray(np.minimum(np.nan_to_num(inside) * size, size - 1), np.int64)
