"""Conversion of materials to Mitsuba 3: its own plugins where they are equivalent, wrapped in `height_correlated`
where their Smith term differs, and plugins for what it lacks (mitsuba_plugins/).

To add a material, write its conversion in BSDFS.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import UsageError
from ...formats.images.image_reader import linear_from_srgb
from ...scene.materials.material import ALPHA_MIN, as_color
from ...scene.materials.material_types import (
    BlinnPhong,
    Conductor,
    Dielectric,
    Diffuse,
    Material,
    MetallicRoughness,
    Mirror,
    Phong,
    Plastic,
    Principled,
)
from ...scene.materials.textures import Texture, Wrap, untextured
from ...scene.model import Mesh, Sphere

Plugin = dict[str, Any]
Floats = NDArray[np.float32]

#: Largest alpha for which the separable Smith term loses less than 4e-4 of the height-correlated albedo.
NEARLY_SMOOTH = 0.09
#: Cut-outs are upsampled by this factor in each dimension before thresholding.
CUTS = 4
#: Parameters for the color of a material.
PAINTED = ("reflectance", "color", "base_color", "specular_reflectance", "specular_transmittance")
CHANNELS = ("red", "green", "blue", "alpha")


def bsdf(owner: Mesh | Sphere) -> Plugin:
    """Return the plugin of the owner's material, with vertex colors. Raises UsageError for an unsupported feature."""
    material = owner.material
    if type(material) not in BSDFS:
        raise UsageError(f"{owner.name}: {material.kernel} is not exported to Mitsuba yet")
    try:
        plugin = BSDFS[type(material)](material)
        if isinstance(owner, Mesh) and owner.colors is not None:
            plugin = _painted(plugin, material)
        if material.normal_map is not None:
            # Mitsuba's bump shadowing (Estevez et al. 2019) affects specular lobes, too, ours does not; nor do we flip
            # normals.
            if plugin["type"] == "gltf":
                plugin |= {"bumps": True}
            plugin = {
                "type": "normalmap",
                "normalmap": _bend(material.normal_map),
                "bsdf": plugin,
                "use_shadowing_function": isinstance(material, Diffuse),
                "flip_invalid_normals": False,
            }
        plugin = plugin if "TRANSMISSION" in material.features() else {"type": "twosided", "front": plugin}
        if material.one_sided:
            raise ValueError("one-sided surfaces")
        if isinstance(owner, Mesh) and owner.has_alpha:
            plugin = {"type": "mask", "opacity": _vertex_opacity(material), "bsdf": plugin}
        elif material.opacity != 1:
            plugin = {"type": "mask", "opacity": _opacity(material), "bsdf": plugin}
    except ValueError as error:
        raise UsageError(f"{owner.name}: Mitsuba does not support {error}") from None
    return plugin


def rgb(values: Any) -> Plugin:
    return {"type": "rgb", "value": [float(value) for value in values]}


def color(value: Any) -> Plugin:
    """Return a color; a texture becomes a bitmap that is already linear."""
    if not isinstance(value, Texture):
        return rgb(value)
    return _bitmap(value, linear_from_srgb(_channels(value, "red", "green", "blue")) * np.array(as_color(value.factor)))


def number(value: Any) -> Any:
    """Return a number; a texture becomes a bitmap."""
    if not isinstance(value, Texture):
        return float(value)
    return _bitmap(value, _channels(value, *[value.channel] * 3) * np.max(value.factor))


def medium(material: Dielectric) -> Plugin | None:
    """Return the interior medium if the material absorbs."""
    if material.attenuation_distance is None:
        return None
    rates = np.array(material.parameters()["absorption"])
    most = float(max(rates.max(), 1e-30))
    return {"type": "homogeneous", "albedo": 0.0, "sigma_t": rgb(rates / most), "scale": most}


def _channels(texture: Texture, *names: str) -> Floats:
    """Return the named channels, (h, w, names), in [0, 1]."""
    return np.asarray(texture.picture.texels[..., [CHANNELS.index(name) for name in names]] / 255, np.float32)


def _opacity(material: Material) -> Any:
    """Return the opacity. A cut-out is thresholded at a higher resolution, since Mitsuba would filter the result.

    (In Mitsuba, passing a cut-out counts towards the path depth.)
    """
    texture, cutoff = material.opacity, material.alpha_cutoff
    if cutoff is None or not isinstance(texture, Texture):
        return number(texture if cutoff is None or isinstance(texture, Texture) else float(texture >= cutoff))
    fine = finer(_channels(texture, *[texture.channel] * 3) * np.max(texture.factor), texture.wrap, CUTS)
    return _bitmap(replace(texture, filter="nearest"), fine >= cutoff)


def finer(texels: Any, wrap: tuple[Wrap, Wrap], times: int) -> Any:
    """Upsample (h, w, channels) by linear interpolation to (times·h, times·w, channels)."""
    for axis in (0, 1):
        size = texels.shape[axis]
        at = (np.arange(times * size) + 0.5) / times - 0.5
        low = np.floor(at).astype(int)
        share = np.expand_dims(at - low, [1, 2] if axis == 0 else [0, 2])
        ends = [each % size if wrap[axis] == "repeat" else each.clip(0, size - 1) for each in (low, low + 1)]
        texels = np.take(texels, ends[0], axis) * (1 - share) + np.take(texels, ends[1], axis) * share
    return texels


def _bend(texture: Texture) -> Plugin:
    """Return a linear normal map that includes the factor, in the frame of u and v."""
    axes = texture.image_axes  # Mitsuba bends along u and v, however to_uv turns the image
    if np.abs(np.abs(axes) - 0.5).max() < 0.499:
        raise ValueError(f"the normal map {texture.picture.name}, which is not rotated by a multiple of 90 degrees")
    xyz = _channels(texture, "red", "green", "blue")
    xyz[..., :2] = 0.5 + (xyz[..., :2] - 0.5) @ axes * np.max(texture.factor)
    return _bitmap(texture, xyz)


def _vertex_opacity(material: Material) -> Plugin:
    """Return the opacity of vertex colors, which `mitsuba_scene` multiplies by the material's."""
    if isinstance(material.opacity, Texture) or material.alpha_cutoff is not None:
        raise ValueError("vertex colors with alpha and a texture or a cutoff")
    return {"type": "mesh_attribute", "name": "vertex_opacity"}


def _bitmap(texture: Texture, texels: Any) -> Plugin:
    if texture.wrap[0] != texture.wrap[1]:
        raise ValueError("a texture with two wrap modes")
    to_picture = np.eye(4)
    to_picture[:2][:, [0, 1, 3]] = texture.to_picture
    return {
        "type": "bitmap",
        "bitmap": np.asarray(texels, np.float32),
        "raw": True,
        "to_uv": to_picture,
        "wrap_mode": texture.wrap[0],
        "filter_type": "bilinear" if texture.filter == "linear" else "nearest",
    }


def _painted(plugin: Plugin, material: Material) -> Plugin:
    """Replace a constant color by vertex colors, which `mitsuba_scene` multiplies by it."""
    name = next((name for name in PAINTED if name in plugin), None)
    if name is None or isinstance(getattr(material, "color", None), Texture):
        raise ValueError("vertex colors with a texture: it has no product of both")
    return plugin | {name: {"type": "mesh_attribute", "name": "vertex_color"}}


def _diffuse(material: Diffuse) -> Plugin:
    return {"type": "diffuse", "reflectance": color(material.color)}


def _mirror(material: Mirror) -> Plugin:
    return {"type": "conductor", "material": "none", "specular_reflectance": color(material.color)}


def _metallic_roughness(material: MetallicRoughness) -> Plugin:
    """Return `principled`, exactly GGX, Schlick's Fresnel and separable Smith for pure metals; otherwise `gltf`."""
    values, has = material.parameters(), material.features()
    if unsupported := has & {"ANISOTROPY", "IRIDESCENCE", "DIFFUSE_THROUGH"}:
        raise ValueError(" and ".join(sorted(unsupported)).lower())
    if (
        material.smith == "separable"
        and values["metallic"] == 1
        and not material.textures()
        and not has & {"MULTIPLE_SCATTERING", "LAYERS"}
    ):
        lobes = material.lobes
        return {"type": "principled", "metallic": 1.0, "roughness": sqrt(lobes.alpha), "base_color": rgb(lobes.f0)}
    plugin = {
        "type": "gltf",
        "color": color(values["color"]),
        "metallic": number(values["metallic"]),
        "roughness": number(material.roughness),
        "f0": color(_f0(material)),
        "specular": number(material.specular),
        "transmission": number(material.transmission),
        "clearcoat": number(material.clearcoat),
        "sheen_color": color(material.sheen_color),
        "smith": material.smith,
        "coupling": material.coupled_by,
        "multiple": "MULTIPLE_SCATTERING" in has,
        "transmits": "THROUGH" in has,
        "layered": "LAYER_ENERGY" in has,
    }
    if "LAYER_ENERGY" in has:
        if material.clearcoat != 0 and material.bent_by is not None:
            raise ValueError("a clearcoat with a normal map: its wrapper bends all layers alike")
        plugin |= {
            name: number(untextured(getattr(material, name)))
            for name in ("roughness", "clearcoat_roughness", "sheen_roughness")
        }
    return plugin


def _f0(material: MetallicRoughness) -> Any:
    """Return F0 of the dielectric part without `specular`."""
    f0, tint = np.array(material.parameters()["f0"]), material.specular_color
    if isinstance(tint, Texture):
        return replace(tint, factor=tuple((f0 * as_color(tint.factor)).tolist()))
    return np.minimum(f0 * tint, 1)


def _phong(material: Phong) -> Plugin:
    shininess = untextured(material.shininess)
    return {
        "type": "phong",
        "color": color(material.color),
        "specular": color(material.specular),
        "shininess": shininess,
        "half_vector": isinstance(material, BlinnPhong),
    }


def _dielectric(material: Dielectric) -> Plugin:
    if material.dispersion:
        raise ValueError("dispersion")
    if material.thin and (material.rough or untextured(material.color) != (1.0, 1.0, 1.0)):
        if material.features() & {"TINTED_DIELECTRIC", "BECKMANN_DIELECTRIC", "SEPARABLE_DIELECTRIC"}:
            raise ValueError("a thin sheet with reflectance, distribution or smith")
        return {
            "type": "sheet",
            "ior": material.ior,
            "color": color(material.color),
            "alpha": _alpha(material.roughness) if material.rough else 0.0,
            "multiple": material.scatters_again,
        }
    plugin = {
        "type": "thindielectric" if material.thin else "dielectric",
        "int_ior": material.ior,
        "ext_ior": 1.0,
        "specular_transmittance": color(material.color),
        "specular_reflectance": color(material.reflectance),
    }
    if material.is_specular:
        return plugin
    single = _rough(plugin | {"type": "roughdielectric"}, material)
    return (
        {
            "type": "all_bounces",
            "ior": material.ior,
            "alpha": _alpha(material.roughness),
            "color": color(material.color),
            "bsdf": single,
        }
        if material.scatters_again
        else single
    )


def _conductor(material: Conductor) -> Plugin:
    values = material.parameters()
    plugin = {"type": "roughconductor", "eta": rgb(values["eta"]), "k": rgb(values["k"])}
    plugin |= {"specular_reflectance": color(material.reflectance)} if "reflectance" in values else {}
    if material.roughness_across is not None:
        raise ValueError("anisotropic metal, whose directions follow texture coordinates")
    return _rough(plugin, material)


def _plastic(material: Plastic) -> Plugin:
    """Return roughplastic, also for a smooth coat, which in clrt has the smallest alpha."""
    return {
        "type": "roughplastic",
        "distribution": material.distribution,
        "alpha": _alpha(material.roughness),
        "int_ior": material.ior,
        "ext_ior": 1.0,
        "diffuse_reflectance": color(material.color),
        "specular_reflectance": color(material.specular),
        "nonlinear": material.nonlinear,
    }


def _principled(material: Principled) -> Plugin:
    if material.anisotropic != 0:
        raise ValueError("anisotropic surfaces, whose directions follow texture coordinates")
    names = ["metallic", "roughness", "spec_tint", "sheen", "sheen_tint", "flatness", "clearcoat", "clearcoat_gloss"]
    names += ["spec_trans"] if material.spec_trans != 0 else []
    numbers = {name: number(getattr(material, name)) for name in names}
    return {"type": "principled", "base_color": color(material.color), "eta": material.ior} | numbers


def _rough(plugin: Plugin, material: Conductor | Dielectric) -> Plugin:
    """Add the microfacets to a plugin. Raises ValueError if Mitsuba lacks their Smith term."""
    alpha = _alpha(material.roughness)
    plugin = plugin | {"distribution": material.distribution, "alpha": alpha}
    if material.smith == "separable" or alpha <= NEARLY_SMOOTH:
        return plugin
    if material.distribution == "beckmann":
        raise ValueError(f"Beckmann's distribution with alpha above {NEARLY_SMOOTH} and height-correlated masking")
    return {"type": "height_correlated", "alpha": alpha, "bsdf": plugin}


def _alpha(roughness: float | Texture) -> float:
    return max(untextured(roughness) ** 2, ALPHA_MIN)


BSDFS: dict[type[Material], Callable[[Any], Plugin]] = {
    Diffuse: _diffuse,
    Mirror: _mirror,
    MetallicRoughness: _metallic_roughness,
    Dielectric: _dielectric,
    Conductor: _conductor,
    Phong: _phong,
    BlinnPhong: _phong,
    Plastic: _plastic,
    Principled: _principled,
}
