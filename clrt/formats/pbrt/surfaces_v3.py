"""Conversion of pbrt-v3's materials, which clrt has similar models of."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt

import numpy as np

from ...scene.materials.material import ALPHA_MIN, MOST_IOR
from ...scene.materials.material_types import Conductor, Dielectric, Diffuse, Material, MetallicRoughness, Mirror
from ...scene.materials.microfacets import albedos
from ...scene.materials.textures import Texture
from ..scene_parts.texture_images import LUMINANCE, mean_of
from .entities import Entity
from .materials import MaterialReader
from .named_spectra import Triple
from .surfaces import index, indices, translucent_of
from .tokens import Doubles

#: F0 of an index of 1.5, of which `specular_color` is a multiple.
F0 = 0.04
#: What `substrate`'s diffuse lobe reflects of diffuse light, over its color (Ashikhmin and Shirley 2000).
SUBSTRATE = 0.8214286


def matte(reader: MaterialReader, entity: Entity) -> Material:
    if reader.textures.number(entity, "sigma", 0.0) != 0.0:
        reader.notes.differ(entity, "Lambert's model instead of Oren and Nayar's")
    return Diffuse(color=reader.textures.color(entity, "Kd", 0.5))


def plastic(reader: MaterialReader, entity: Entity) -> Material:
    return _glossy(reader, entity, 0.25)


def _glossy(reader: MaterialReader, entity: Entity, default: float) -> Material:
    """Return a diffuse and a microfacet lobe of index 1.5, which are added."""
    reader.notes.differ(entity, "Schlick's Fresnel term, and a diffuse lobe that the glossy one attenuates")
    specular = _constant(reader, entity, "Ks", 0.25)
    roughness = reader.roughness(entity, 0.1)
    taken = 1 - _mean_albedo(F0 * specular, specular, roughness)
    return MetallicRoughness(
        color=_over(reader, reader.textures.color(entity, "Kd", default), taken),
        roughness=roughness,
        specular=float(np.clip(specular.max(), 0, 1)),
        specular_color=_triple(specular / max(specular.max(), 1e-9)),
        coupling="albedo",
        multiple_scattering=False,
    )


def substrate(reader: MaterialReader, entity: Entity) -> Material:
    """Ashikhmin and Shirley's model: Ks at normal incidence, and all light at grazing angles."""
    reader.notes.differ(entity, "GGX over a diffuse lobe that it attenuates, instead of Ashikhmin and Shirley's lobes")
    specular = _constant(reader, entity, "Ks", 0.5)
    roughness = reader.roughness(entity, 0.1)
    taken = 1 - _mean_albedo(specular, np.ones(3), roughness)
    factor = SUBSTRATE * (1 - specular) / taken
    return MetallicRoughness(
        color=_over(reader, reader.textures.color(entity, "Kd", 0.5), 1 / np.maximum(factor, 1e-9)),
        roughness=roughness,
        specular_color=_triple(specular / F0),
        coupling="albedo",
        multiple_scattering=False,
    )


def metal(reader: MaterialReader, entity: Entity) -> Material:
    eta, k = indices(reader, entity)
    return Conductor(eta=eta, k=k, roughness=reader.roughness(entity, 0.01))


def mirror(reader: MaterialReader, entity: Entity) -> Material:
    return Mirror(color=reader.textures.color(entity, "Kr", 0.9))


def glass(reader: MaterialReader, entity: Entity) -> Material:
    name = "index" if "index" in entity.parameters else "eta"
    ior, abbe = index(reader, entity, name, least=1 / MOST_IOR)
    color = reader.textures.color(entity, "Kt", 1.0)
    reflected = reader.textures.color(entity, "Kr", 1.0)
    if reflected == (0.0, 0.0, 0.0) and color != (0.0, 0.0, 0.0):
        reader.notes.instead(entity, "Kr is 0", "leave it out", "1 is used", "glass, Kr")
    elif reflected != (1.0, 1.0, 1.0):
        reader.notes.differ(entity, "Kr is taken for 1")
    roughness = 0.0 if not _is_rough(entity) else reader.roughness(entity, 0.0)
    entity.ignore(("uroughness", "vroughness", "roughness", "remaproughness"))
    return Dielectric(ior=ior, color=color, roughness=roughness, multiple_scattering=roughness == 0.0)


def _is_rough(entity: Entity) -> bool:
    """Return whether glass has a roughness; without one it is smooth."""
    names = ("roughness", "uroughness", "vroughness")
    return any(entity.is_textured(name) or entity.number(name, 0.0) > 0 for name in names)


def uber(reader: MaterialReader, entity: Entity) -> Material:
    for name in ("Kr", "Kt"):
        if entity.is_textured(name) or any(reader.textures.spectra.reflectance(entity, name, 0.0)):
            what, remedy = f"{name} is not 0", "use mirror or glass"
            reader.notes.instead(entity, what, remedy, "it is left out", f"uber, {name}")
        entity.ignore([name])
    entity.ignore(("index", "eta"))
    opacity = reader.textures.number(entity, "opacity", 1.0) if _textured(entity, "opacity") else _grey(reader, entity)
    return replace(_glossy(reader, entity, 0.25), opacity=opacity)


def _textured(entity: Entity, name: str) -> bool:
    return entity.is_textured(name)


def _grey(reader: MaterialReader, entity: Entity) -> float:
    return float(np.clip(LUMINANCE @ reader.textures.spectra.reflectance(entity, "opacity", 1.0), 0, 1))


def translucent(reader: MaterialReader, entity: Entity) -> Material:
    reader.notes.differ(entity, "the glossy lobes of translucent surfaces are left out")
    entity.ignore(("Ks", "roughness", "remaproughness"))
    kd = reader.textures.color(entity, "Kd", 0.25)
    shares = [
        float(np.mean(reader.textures.spectra.reflectance(entity, name, 0.5))) for name in ("reflect", "transmit")
    ]
    images = reader.textures.images

    def part(share: float) -> Triple | Texture:
        def scaled(values: Doubles) -> Doubles:
            return values * share

        return images.baked(kd, "color", scaled) if isinstance(kd, Texture) else _triple(np.array(kd) * share)

    return translucent_of(reader, entity, part(shares[0]), part(shares[1]), 1.0)


def disney(reader: MaterialReader, entity: Entity) -> Material:
    """Replace Disney's BSDF by glTF's."""
    reader.notes.instead(
        entity,
        'material "disney" is not supported',
        "use plastic, metal or glass",
        "metallic_roughness is used, without sheen, anisotropy and transmission",
    )
    color = reader.textures.color(entity, "color", 0.5)
    gloss = mean_of(reader.textures.number(entity, "clearcoatgloss", 1.0))
    found = MetallicRoughness(
        color=color,
        metallic=reader.textures.number(entity, "metallic", 0.0),
        roughness=reader.textures.number(entity, "roughness", 0.5),
        ior=index(reader, entity, "eta", least=1.0)[0],
        clearcoat=reader.textures.number(entity, "clearcoat", 0.0),
        clearcoat_roughness=sqrt(0.1 - 0.099 * min(max(gloss, 0.0), 1.0)),
    )
    entity.ignore()
    return found


def _constant(reader: MaterialReader, entity: Entity, name: str, default: float) -> Doubles:
    """Return a color, the mean of a texture."""
    found = reader.textures.color(entity, name, default)
    if not isinstance(found, Texture):
        return np.array(found)
    reader.notes.differ(entity, f"the mean of the texture of {name}")
    levels = reader.textures.images.baked(found, "color", lambda values: values)
    return np.asarray((levels.picture.texels[..., :3].reshape(-1, 3) / 255.0).mean(0) ** 2.2)


def _mean_albedo(f0: Doubles, f90: Doubles, roughness: float | Texture) -> Doubles:
    """Return what a microfacet lobe reflects of diffuse light."""
    node, weight = np.polynomial.legendre.leggauss(32)
    mu, weight = (node + 1) / 2, weight * (node + 1) / 2
    first, grazing = albedos(mu, max(mean_of(roughness) ** 2, ALPHA_MIN), "height_correlated")
    return np.asarray(f0 * (weight @ (first - grazing)) + f90 * (weight @ grazing))


def _over(reader: MaterialReader, color: Triple | Texture, factor: Doubles) -> Triple | Texture:
    """Return a color divided by a factor, at most 1."""

    def divided(values: Doubles) -> Doubles:
        return np.clip(values / factor, 0, 1)

    if isinstance(color, Texture):
        return reader.textures.images.baked(color, "color", divided)
    return _triple(divided(np.array(color)))


def _triple(values: Doubles) -> Triple:
    red, green, blue = values.tolist()
    return red, green, blue
