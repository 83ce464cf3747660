"""Material of a glTF primitive: metallic-roughness, textured if the primitive has texture coordinates."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...scene.materials.material import MOST_IOR
from ...scene.materials.material_types import Diffuse, Material, MetallicRoughness
from ...scene.materials.textures import Channel, Texture
from . import material_schema as looks, schema as gltf
from .accessors import GltfData
from .solid_glass import glass, solid_faces, tinted
from .specular_glossiness import converted, rough_picture
from .textures import Textures

#: Value of a base color texture that cannot be read.
GREY = 0.8


class MaterialPart(NamedTuple):
    """A material, the triangles of a primitive that it is on, (m, 3), and their vertex colors, with alpha if that
    counts."""

    material: Material
    faces: NDArray[np.int32]
    colors: NDArray[np.float32] | None


class Materials:
    """Materials of one file. sources, textures: if they are animated, the materials at a time, and the textures that
    were read."""

    def __init__(
        self,
        data: GltfData,
        variant: int | None = None,
        sources: Sequence[looks.Material] | None = None,
        textures: Textures | None = None,
    ) -> None:
        self._variant, self._sources = variant, data.document.materials if sources is None else sources
        self._names = gltf.unique_names("material", [material.name for material in data.document.materials])
        self.textures = textures or Textures(data)
        self._texture, self._bend = self.textures.texture, self.textures.normal_map
        #: Features that had an effect in the file, but are not rendered, by the material's name.
        self.unused: dict[str, list[str]] = {}

    def name(self, primitive: gltf.Primitive) -> str:
        """Return the name of the primitive's material, empty if it has none."""
        index = self._index(primitive)
        return "" if index is None or index >= len(self._names) else self._names[index]

    def _index(self, primitive: gltf.Primitive) -> int | None:
        """Return the index of the primitive's material, in the chosen variant."""
        for mapping in primitive.extensions.KHR_materials_variants.mappings:
            if self._variant in mapping.variants:
                return mapping.material
        return primitive.material

    def materials(
        self,
        primitive: gltf.Primitive,
        user: str,
        uv: list[NDArray[np.float32] | None],
        faces: NDArray[np.int32],
        colors: NDArray[np.float32] | None,
    ) -> list[MaterialPart]:
        """Return the primitive's material with all values clamped to their limits, or the specification's default if it
        has none; triangles of solid glass have one of their own. uv, faces, colors: the primitive's texture
        coordinates, both sets, triangles and vertex colors.

        A texture is replaced by white if the primitive has no coordinates for it or if it cannot be read; a base color
        texture by grey, an emission texture by black.
        """
        index = self._index(primitive)
        opaque = colors if colors is None or colors.shape[1] == 3 else colors[:, :3]
        if index is None:
            return [MaterialPart(MetallicRoughness(color=(1.0, 1.0, 1.0), metallic=1.0, roughness=1.0), faces, opaque)]
        source = converted(gltf.entry(self._sources, index, "material", user))
        pbr, extensions = source.pbrMetallicRoughness, source.extensions
        base = self._texture(pbr.baseColorTexture, primitive, user)
        coverage = _coverage(source, base)
        colors = colors if coverage else opaque
        color = _colored(_cut(pbr.baseColorFactor[:3]), base, pbr.baseColorTexture, GREY)
        if extensions.KHR_materials_unlit is not None:
            self._note(
                index,
                {"the variation of vertex colors": colors is not None and bool(np.ptp(colors[:, :3], axis=0).any())},
            )
            return [MaterialPart(_unlit(color, colors, coverage), faces, colors)]
        made = MetallicRoughness(
            color=color,
            emission=self._emission(source, primitive, user),
            double_sided=source.doubleSided,
            **self._gloss(source, primitive, user),
            **self._layers(extensions, primitive, user),
            **self._diffuse_transmission(extensions.KHR_materials_diffuse_transmission, primitive, user),
            **self._thin_film(extensions.KHR_materials_iridescence, primitive, user),
            **self._anisotropy(index, extensions.KHR_materials_anisotropy, primitive, user),
        )
        made = replace(made, normal_map=self._bend(source.normalTexture, primitive, user))
        solid = solid_faces(extensions, made, uv, faces)
        parts: list[MaterialPart] = []
        if not solid.all():
            parts.append(MaterialPart(replace(tinted(extensions, made), **coverage), faces[~solid], colors))
            volume = extensions.KHR_materials_volume.thicknessFactor > 0
            transmits = made.transmission != 0 or made.diffuse_transmission != 0
            self._note(index, {"volume": volume and transmits and made.metallic != 1})
        if solid.any():
            parts.append(MaterialPart(glass(extensions, made), faces[solid], opaque))
            layers = {
                layer.lower(): layer in made.features()
                for layer in ("CLEARCOAT", "SHEEN", "SPECULAR", "ANISOTROPY", "IRIDESCENCE")
            }
            faded = coverage.get("opacity", 1.0) != 1 or colors is not opaque
            dispersion = extensions.KHR_materials_dispersion.dispersion > 0 and made.roughness != 0
            self._note(index, {"alphaMode": faded, **layers, "dispersion of rough glass": dispersion})
        return parts

    def _note(self, index: int, lost: Mapping[str, bool]) -> None:
        """Note which features of a material are not rendered."""
        names = [name for name, is_lost in lost.items() if is_lost]
        if names:
            noted = self.unused.setdefault(self._names[index], [])
            noted += [name for name in names if name not in noted]

    def _gloss(self, source: looks.Material, primitive: gltf.Primitive, user: str) -> dict[str, Any]:
        """Return metallic and roughness."""
        pbr, old = source.pbrMetallicRoughness, source.extensions.KHR_materials_pbrSpecularGlossiness
        if old is not None:
            gloss = self._texture(old.specularGlossinessTexture, primitive, user)
            if gloss is None:
                return {"metallic": 0.0, "roughness": pbr.roughnessFactor}
            picture = self.textures.derived(gloss.picture, old.glossinessFactor, rough_picture)
            return {"metallic": 0.0, "roughness": replace(gloss, picture=picture, channel="green")}
        texture = self._texture(pbr.metallicRoughnessTexture, primitive, user)
        return {
            "metallic": _numbered(_unit(pbr.metallicFactor), texture, "blue"),
            "roughness": _numbered(_unit(pbr.roughnessFactor), texture, "green"),
        }

    def _layers(self, extensions: looks.MaterialExtensions, primitive: gltf.Primitive, user: str) -> dict[str, Any]:
        """Return the fields for the extensions in use."""
        coat, sheen = extensions.KHR_materials_clearcoat, extensions.KHR_materials_sheen
        specular, transmission = extensions.KHR_materials_specular, extensions.KHR_materials_transmission
        ior, beyond = _ior(extensions.KHR_materials_ior.ior)
        red, green, blue = (beyond * value for value in _positive(specular.specularColorFactor))

        def number(factor: float, info: looks.TextureInfo | None, channel: Channel) -> float | Texture:
            return _numbered(_unit(factor), self._texture(info, primitive, user) if factor > 0 else None, channel)

        def color(factor: tuple[float, float, float], info: looks.TextureInfo | None) -> Any:
            return _colored(factor, self._texture(info, primitive, user) if max(factor) > 0 else None, info, 1.0)

        return {
            "ior": ior,
            "clearcoat": number(coat.clearcoatFactor, coat.clearcoatTexture, "red"),
            "clearcoat_roughness": number(coat.clearcoatRoughnessFactor, coat.clearcoatRoughnessTexture, "green"),
            "clearcoat_normal_map": self._bend(
                coat.clearcoatNormalTexture if coat.clearcoatFactor > 0 else None, primitive, user
            ),
            "sheen_color": color(_cut(sheen.sheenColorFactor), sheen.sheenColorTexture),
            "sheen_roughness": number(sheen.sheenRoughnessFactor, sheen.sheenRoughnessTexture, "alpha"),
            "specular": number(specular.specularFactor, specular.specularTexture, "alpha"),
            "specular_color": color((red, green, blue), specular.specularColorTexture),
            "transmission": number(transmission.transmissionFactor, transmission.transmissionTexture, "red"),
        }

    def _diffuse_transmission(
        self, source: looks.DiffuseTransmission, primitive: gltf.Primitive, user: str
    ) -> dict[str, Any]:
        """Return the fields of diffuse transmission."""
        part = _unit(source.diffuseTransmissionFactor)
        if part == 0:
            return {}
        info = source.diffuseTransmissionColorTexture
        color = _cut(source.diffuseTransmissionColorFactor)
        return {
            "diffuse_transmission": _numbered(
                part, self._texture(source.diffuseTransmissionTexture, primitive, user), "alpha"
            ),
            "diffuse_transmission_color": _colored(color, self._texture(info, primitive, user), info, 1.0),
        }

    def _thin_film(self, source: looks.Iridescence, primitive: gltf.Primitive, user: str) -> dict[str, Any]:
        """Return the fields of iridescence."""
        strength = _unit(source.iridescenceFactor)
        if strength == 0:
            return {}
        thickness = self._texture(source.iridescenceThicknessTexture, primitive, user)
        return {
            "iridescence": _numbered(strength, self._texture(source.iridescenceTexture, primitive, user), "red"),
            "iridescence_ior": float(np.clip(source.iridescenceIor, 1, MOST_IOR)),
            "iridescence_thickness": max(source.iridescenceThicknessMaximum, 0.0),
            "iridescence_thickness_minimum": max(source.iridescenceThicknessMinimum, 0.0),
            "iridescence_thickness_map": _numbered(1.0, thickness, "green"),
        }

    def _anisotropy(self, index: int, source: looks.Anisotropy, primitive: gltf.Primitive, user: str) -> dict[str, Any]:
        """Return the fields of anisotropy, which needs tangents or texture coordinates."""
        strength = _unit(source.anisotropyStrength)
        if strength == 0:
            return {}
        if not {"TANGENT", "TEXCOORD_0", "TEXCOORD_1"} & set(primitive.attributes):
            self._note(index, {"anisotropy": True})
            return {}
        directions = self._texture(source.anisotropyTexture, primitive, user)
        return {
            "anisotropy": _numbered(strength, directions, "blue"),
            "anisotropy_degrees": math.degrees(source.anisotropyRotation),
            "anisotropy_map": directions,
        }

    def _emission(
        self, source: looks.Material, primitive: gltf.Primitive, user: str
    ) -> tuple[float, float, float] | Texture:
        strength = max(source.extensions.KHR_materials_emissive_strength.emissiveStrength, 0.0)
        red, green, blue = (strength * max(value, 0.0) for value in source.emissiveFactor)
        glow = self._texture(source.emissiveTexture, primitive, user) if max(red, green, blue) else None
        return _colored((red, green, blue), glow, source.emissiveTexture, 0.0)


def _unlit(
    color: tuple[float, float, float] | Texture, colors: NDArray[np.float32] | None, coverage: Mapping[str, Any]
) -> Diffuse:
    """Return a surface that emits the color from both sides and reflects nothing; colors: vertex colors (n, k)."""
    if colors is not None:
        factor = np.array(color.factor if isinstance(color, Texture) else color)
        red, green, blue = (factor * colors[:, :3].mean(axis=0, dtype=np.float64)).tolist()
        color = replace(color, factor=(red, green, blue)) if isinstance(color, Texture) else (red, green, blue)
    return Diffuse(color=(0.0, 0.0, 0.0), emission=color, double_sided=True, **coverage)


def _coverage(source: looks.Material, base: Texture | None) -> dict[str, Any]:
    """Return opacity and alpha_cutoff of the material's alpha mode, none if it is opaque."""
    if source.alphaMode == "OPAQUE":
        return {}
    opacity = _numbered(_unit(source.pbrMetallicRoughness.baseColorFactor[3]), base, "alpha")
    if source.alphaMode == "BLEND":
        return {"opacity": opacity}
    if source.alphaCutoff > 1:  # no alpha reaches it (specification 3.9.4)
        return {"opacity": 0.0}
    return {"opacity": opacity, "alpha_cutoff": _unit(source.alphaCutoff)}


def _colored(
    factor: tuple[float, float, float], texture: Texture | None, info: looks.TextureInfo | None, missing: float
) -> tuple[float, float, float] | Texture:
    """Return a color times its texture, or times `missing` if the texture is unavailable."""
    if texture is not None:
        return replace(texture, factor=factor)
    red, green, blue = (value * (1.0 if info is None else missing) for value in factor)
    return red, green, blue


def _numbered(factor: float, texture: Texture | None, channel: Channel) -> float | Texture:
    return factor if texture is None else replace(texture, factor=factor, channel=channel)


def _ior(ior: float) -> tuple[float, float]:
    """Return the ior within the limits of a material, and by how much its reflectance is too small then. glTF's 0 means
    infinity."""
    if 0 < ior <= MOST_IOR:
        return max(ior, 1.0), 1.0
    return MOST_IOR, _reflectance(ior) / _reflectance(MOST_IOR)


def _reflectance(ior: float) -> float:
    """Return the reflectance at normal incidence; 1 for glTF's 0."""
    return ((ior - 1) / (ior + 1)) ** 2


def _positive(color: tuple[float, float, float]) -> tuple[float, float, float]:
    red, green, blue = (max(value, 0.0) for value in color)
    return red, green, blue


def _unit(value: float) -> float:
    return float(np.clip(value, 0, 1))


def _cut(color: tuple[float, ...]) -> tuple[float, float, float]:
    red, green, blue = map(_unit, color)
    return red, green, blue
