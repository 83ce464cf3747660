"""Conversion of pbrt-v4's materials to clrt's that are the same model, or nearly so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...scene.materials.material import MOST_IOR
from ...scene.materials.material_types import Conductor, Dielectric, Diffuse, Material, MetallicRoughness
from ...scene.materials.textures import Texture
from ..scene_parts.coats import coat
from ..scene_parts.texture_images import mean_of
from .entities import Entity
from .materials import MaterialReader
from .named_spectra import METALS, Triple
from .tokens import Doubles

#: Parameters of layered materials that affect how pbrt traces light between the layers.
WALK = ("thickness", "nsamples", "maxdepth", "g")
#: Largest reflectance of a conductor given by it.
MOST_REFLECTED = 0.9999


def diffuse(reader: MaterialReader, entity: Entity) -> Material:
    return Diffuse(color=reader.textures.color(entity, "reflectance", 0.5))


def interface(reader: MaterialReader, entity: Entity) -> None:
    """A surface that light passes."""


def coated_diffuse(reader: MaterialReader, entity: Entity) -> Material:
    """A diffuse base below a dielectric coat, between which light is reflected."""
    ior = index(reader, entity, "eta", least=1.0)[0]
    roughness = reader.roughness(entity, 0.0)
    clear(reader, entity)
    color = reader.textures.color(entity, "reflectance", 0.5)
    reader.notes.differ(
        entity, "a coat with Schlick's Fresnel term over a diffuse base; pbrt traces light between the two"
    )
    return coated(reader, color, ior, roughness)


def coated(reader: MaterialReader, color: Triple | Texture, ior: float, roughness: float | Texture) -> Material:
    """Return a diffuse base below a coat."""
    inside, scale = coat(ior, mean_of(roughness) ** 2, "ggx", True)

    def seen(base: Doubles) -> Doubles:
        return np.minimum(base * scale / (1 - base * inside), 1)

    if isinstance(color, Texture):
        color = reader.textures.images.baked(color, "color", seen)
    else:
        red, green, blue = seen(np.array(color)).tolist()
        color = red, green, blue
    return MetallicRoughness(color=color, ior=ior, roughness=roughness, coupling="albedo", multiple_scattering=False)


def clear(reader: MaterialReader, entity: Entity) -> None:
    """Require that a coat does not scatter."""
    if entity.is_textured("albedo") or any(reader.textures.spectra.reflectance(entity, "albedo", 0.0)):
        what, remedy = "its coat scatters light", "write albedo 0"
        reader.notes.instead(entity, what, remedy, "it is clear", f"{entity.kind}, albedo")
    entity.ignore([*WALK, "albedo"])


def conductor(reader: MaterialReader, entity: Entity) -> Material:
    roughness = reader.roughness(entity, 0.0)
    if roughness == 0.0:
        reader.notes.differ(entity, "smooth metal has alpha 0.0001, and reflects point-like lights")
    if entity.is_textured("reflectance"):
        reader.notes.differ(entity, "a metal of textured reflectance has Schlick's Fresnel term")
        color = reader.textures.color(entity, "reflectance", 1.0)
        return MetallicRoughness(color=color, metallic=1.0, roughness=roughness, multiple_scattering=False)
    eta, k = indices(reader, entity)
    return Conductor(eta=eta, k=k, roughness=roughness)


def indices(reader: MaterialReader, entity: Entity, prefix: str = "", outside: float = 1.0) -> tuple[Triple, Triple]:
    """Return eta and k of a metal, relative to the index outside."""
    for name in (f"{prefix}eta", f"{prefix}k"):
        if entity.is_textured(name):
            what, remedy = f"{name} is a texture", "write its values"
            reader.notes.instead(entity, what, remedy, "copper's is used", f"{entity.kind}, textured {name}")
    if "reflectance" in entity.parameters:
        color = np.minimum(reader.textures.spectra.reflectance(entity, "reflectance", 1.0), MOST_REFLECTED)
        eta, k = np.ones(3), 2 * np.sqrt(color / (1 - color))
    else:
        found = []
        for name, default in zip((f"{prefix}eta", f"{prefix}k"), METALS["Cu"]):
            is_image = entity.is_textured(name)
            found.append(np.array(default if is_image else reader.textures.spectra.metal(entity, name, default)))
            entity.ignore([name])
        eta, k = found
    first, second = (np.clip(each / outside, least, 100).tolist() for each, least in ((eta, 0.01), (k, 0.0)))
    return (first[0], first[1], first[2]), (second[0], second[1], second[2])


def coated_conductor(reader: MaterialReader, entity: Entity) -> Material:
    """A metal below a coat, which glTF's clearcoat approximates."""
    ior = index(reader, entity, "interface.eta", least=1.0)[0]
    coat_roughness = reader.roughness(entity, 0.0, "interface.")
    roughness = reader.roughness(entity, 0.0, "conductor.")
    clear(reader, entity)
    if abs(ior - 1.5) > 0.01:
        what, remedy = f"its coat has the index {ior:g}", "write 1.5"
        reader.notes.instead(entity, what, remedy, "1.5 is used", "coatedconductor, interface.eta")
    reader.notes.differ(entity, "a clearcoat over metal with Schlick's Fresnel term; pbrt traces light between the two")
    if entity.is_textured("reflectance"):
        color = reader.textures.color(entity, "reflectance", 1.0)
    else:
        eta, k = (np.array(each) for each in indices(reader, entity, "conductor.", ior))
        red, green, blue = (((eta - 1) ** 2 + k**2) / ((eta + 1) ** 2 + k**2)).tolist()
        color = red, green, blue
    return MetallicRoughness(
        color=color,
        metallic=1.0,
        roughness=roughness,
        clearcoat=1.0,
        clearcoat_roughness=coat_roughness,
        multiple_scattering=False,
    )


def dielectric(reader: MaterialReader, entity: Entity) -> Material:
    ior, abbe = index(reader, entity, "eta", least=1 / MOST_IOR)
    roughness = reader.roughness(entity, 0.0)
    is_smooth = roughness == 0.0
    return Dielectric(
        ior=ior,
        roughness=roughness,
        multiple_scattering=is_smooth,
        dispersion=20 / abbe if abbe and is_smooth else 0.0,
    )


def thin_dielectric(reader: MaterialReader, entity: Entity) -> Material:
    return Dielectric(ior=index(reader, entity, "eta", least=1 / MOST_IOR)[0], thin=True)


def index(reader: MaterialReader, entity: Entity, name: str, least: float) -> tuple[float, float | None]:
    """Return an index of refraction within what clrt renders, and the Abbe number of a named glass."""
    if entity.is_textured(name):
        what, remedy = f"{name} is a texture", "write a number"
        reader.notes.instead(entity, what, remedy, "1.5 is used", f"{entity.kind}, textured {name}")
        entity.ignore([name])
        return 1.5, None
    ior, abbe = reader.textures.spectra.index(entity, name, 1.5)
    if not least <= ior <= MOST_IOR:
        what, remedy = f"{name} is {ior:g}", f"write {least:g} to {MOST_IOR:g}"
        reader.notes.instead(entity, what, remedy, "the nearest of these is used", f"{entity.kind}, {name}")
    return min(max(ior, least), MOST_IOR), abbe


def diffuse_transmission(reader: MaterialReader, entity: Entity) -> Material:
    scale = entity.number("scale", 1.0)
    colors = [reader.textures.color(entity, name, 0.25) for name in ("reflectance", "transmittance")]
    return translucent_of(reader, entity, colors[0], colors[1], scale)


def translucent_of(
    reader: MaterialReader, entity: Entity, reflected: Triple | Texture, transmitted: Triple | Texture, scale: float
) -> Material:
    """Return a diffuse surface that reflects and transmits colors times `scale`."""
    most = [scale * _largest(each) for each in (reflected, transmitted)]
    share = most[1] / sum(most) if sum(most) else 0.0
    if sum(most) > 1 and (isinstance(reflected, Texture) or isinstance(transmitted, Texture)):
        reader.notes.differ(entity, "textures that reflect and transmit more than all light together are clamped")
    return MetallicRoughness(
        color=_divided(reader, reflected, scale, 1 - share),
        specular=0.0,
        ior=1.0,
        diffuse_transmission=share,
        diffuse_transmission_color=_divided(reader, transmitted, scale, share),
    )


def _largest(color: Triple | Texture) -> float:
    """Return an upper bound of a color's components."""
    if not isinstance(color, Texture):
        return max(color)
    return float(np.max(color.factor)) * float(color.picture.texels[..., :3].max()) / 255


def _divided(reader: MaterialReader, color: Triple | Texture, scale: float, share: float) -> Triple | Texture:
    """Return a color times `scale`, divided by the share of light that it is a color of."""
    factor = scale / share if share else 0.0

    def scaled(values: Doubles) -> Doubles:
        return np.minimum(values * factor, 1)

    if isinstance(color, Texture):
        return reader.textures.images.baked(color, "color", scaled)
    red, green, blue = scaled(np.array(color)).tolist()
    return red, green, blue


def mix(reader: MaterialReader, entity: Entity) -> Material | None:
    """Mix two materials; `amount` is the share of the second, in v3 of the first."""
    names = entity.get("materials", "string")
    is_old = names is None
    pair = [entity.string(f"namedmaterial{i}", "") for i in (1, 2)] if names is None else [*map(str, names.values)]
    if len(pair) != 2:
        raise entity.fault("materials", f"names {len(pair)} materials", "name two")
    first, second = (reader.named(name, entity) for name in pair)
    if is_old:
        first, second = second, first
    amount = reader.textures.number(entity, "amount", 0.5) if _is_number(entity) else _mean_amount(reader, entity)
    return mixed(reader, entity, first, second, amount)


def _is_number(entity: Entity) -> bool:
    parameter = entity.parameters.get("amount")
    return parameter is None or parameter.type in ("float", "integer", "texture")


def _mean_amount(reader: MaterialReader, entity: Entity) -> float:
    return float(np.mean(reader.textures.spectra.reflectance(entity, "amount", 0.5)))


def mixed(
    reader: MaterialReader, entity: Entity, first: Material | None, second: Material | None, amount: float | Texture
) -> Material | None:
    """Return a mixture of two materials; `amount`: the share of the second."""
    images = reader.textures.images
    if isinstance(amount, float) and amount in (0.0, 1.0):
        return second if amount else first
    if first is None or second is None:
        if first is second:
            return None
        if second is None:
            amount = (
                images.baked(amount, "number", lambda each: 1 - each) if isinstance(amount, Texture) else 1 - amount
            )
        solid = first or second
        assert solid is not None
        return replace(solid, opacity=amount)
    if isinstance(first, Diffuse) and isinstance(second, Diffuse) and replace(first, color=second.color) == second:
        one, other = first.color, second.color
        if not isinstance(one, Texture) and not isinstance(other, Texture):
            if isinstance(amount, Texture):
                return replace(first, color=images.blended(amount, one, other, "color"))
            red, green, blue = ((1 - amount) * np.array(one) + amount * np.array(other)).tolist()
            return replace(first, color=(red, green, blue))
    what = "mixes anything but two untextured diffuse materials, or one with interface"
    reader.notes.instead(entity, what, "write one material", "the one with the larger share is used", "mix")
    return second if mean_of(amount) > 0.5 else first
