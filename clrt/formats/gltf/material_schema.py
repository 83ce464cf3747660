"""Material schema of glTF 2.0, with the specification's names (section 5)."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

Index = Annotated[int, Field(ge=0)]
Vec2 = tuple[float, float]
Vec3 = tuple[float, float, float]
Vec4 = tuple[float, float, float, float]


class Part(BaseModel):
    """Base class of the document's objects; numbers must be finite."""

    model_config = ConfigDict(frozen=True, allow_inf_nan=False)


class Image(Part):
    name: str | None = None
    uri: str | None = None
    bufferView: Index | None = None


class Sampler(Part):
    magFilter: int | None = None
    wrapS: Literal[10497, 33648, 33071] = 10497
    wrapT: Literal[10497, 33648, 33071] = 10497


class TextureSource(Part):
    source: Index


class TextureExtensions(Part):
    EXT_texture_avif: TextureSource | None = None
    EXT_texture_webp: TextureSource | None = None
    KHR_texture_basisu: TextureSource | None = None


class Texture(Part):
    source: Index | None = None
    sampler: Index | None = None
    extensions: TextureExtensions = TextureExtensions()

    @property
    def sources(self) -> tuple[int, ...]:
        """The images to choose from, the one to prefer first: Basis Universal loses most, and needs a decoder."""
        more, own = self.extensions, None if self.source is None else TextureSource(source=self.source)
        found = (more.EXT_texture_webp, more.EXT_texture_avif, own, more.KHR_texture_basisu)
        return tuple(each.source for each in found if each is not None)


class TextureTransform(Part):
    offset: Vec2 = (0.0, 0.0)
    rotation: float = 0.0
    scale: Vec2 = (1.0, 1.0)
    texCoord: Index | None = None


class TextureInfoExtensions(Part):
    KHR_texture_transform: TextureTransform = TextureTransform()


class TextureInfo(Part):
    index: Index
    texCoord: Index = 0
    extensions: TextureInfoExtensions = TextureInfoExtensions()


class NormalTextureInfo(TextureInfo):
    scale: float = 1.0


class Pbr(Part):
    baseColorFactor: Vec4 = (1.0, 1.0, 1.0, 1.0)
    metallicFactor: float = 1.0
    roughnessFactor: float = 1.0
    baseColorTexture: TextureInfo | None = None
    metallicRoughnessTexture: TextureInfo | None = None


class EmissiveStrength(Part):
    emissiveStrength: float = 1.0


class Anisotropy(Part):
    anisotropyStrength: float = 0.0
    anisotropyRotation: float = 0.0
    anisotropyTexture: TextureInfo | None = None


class Clearcoat(Part):
    clearcoatFactor: float = 0.0
    clearcoatTexture: TextureInfo | None = None
    clearcoatRoughnessFactor: float = 0.0
    clearcoatRoughnessTexture: TextureInfo | None = None
    clearcoatNormalTexture: NormalTextureInfo | None = None


class DiffuseTransmission(Part):
    diffuseTransmissionFactor: float = 0.0
    diffuseTransmissionTexture: TextureInfo | None = None
    diffuseTransmissionColorFactor: Vec3 = (1.0, 1.0, 1.0)
    diffuseTransmissionColorTexture: TextureInfo | None = None


class Dispersion(Part):
    dispersion: float = 0.0


class Ior(Part):
    ior: float = 1.5


class Iridescence(Part):
    iridescenceFactor: float = 0.0
    iridescenceTexture: TextureInfo | None = None
    iridescenceIor: float = 1.3
    iridescenceThicknessMinimum: float = 100.0
    iridescenceThicknessMaximum: float = 400.0
    iridescenceThicknessTexture: TextureInfo | None = None


class Sheen(Part):
    sheenColorFactor: Vec3 = (0.0, 0.0, 0.0)
    sheenColorTexture: TextureInfo | None = None
    sheenRoughnessFactor: float = 0.0
    sheenRoughnessTexture: TextureInfo | None = None


class Specular(Part):
    specularFactor: float = 1.0
    specularTexture: TextureInfo | None = None
    specularColorFactor: Vec3 = (1.0, 1.0, 1.0)
    specularColorTexture: TextureInfo | None = None


class Transmission(Part):
    transmissionFactor: float = 0.0
    transmissionTexture: TextureInfo | None = None


class Volume(Part):
    thicknessFactor: float = 0.0
    attenuationDistance: float | None = None
    attenuationColor: Vec3 = (1.0, 1.0, 1.0)


class SpecularGlossiness(Part):
    diffuseFactor: Vec4 = (1.0, 1.0, 1.0, 1.0)
    diffuseTexture: TextureInfo | None = None
    specularFactor: Vec3 = (1.0, 1.0, 1.0)
    glossinessFactor: float = 1.0
    specularGlossinessTexture: TextureInfo | None = None


class Unlit(Part):
    pass


class MaterialExtensions(Part):
    KHR_materials_anisotropy: Anisotropy = Anisotropy()
    KHR_materials_clearcoat: Clearcoat = Clearcoat()
    KHR_materials_diffuse_transmission: DiffuseTransmission = DiffuseTransmission()
    KHR_materials_dispersion: Dispersion = Dispersion()
    KHR_materials_emissive_strength: EmissiveStrength = EmissiveStrength()
    KHR_materials_ior: Ior = Ior()
    KHR_materials_iridescence: Iridescence = Iridescence()
    KHR_materials_pbrSpecularGlossiness: SpecularGlossiness | None = None
    KHR_materials_sheen: Sheen = Sheen()
    KHR_materials_specular: Specular = Specular()
    KHR_materials_transmission: Transmission = Transmission()
    KHR_materials_unlit: Unlit | None = None
    KHR_materials_volume: Volume = Volume()


class Material(Part):
    name: str | None = None
    pbrMetallicRoughness: Pbr = Pbr()
    emissiveFactor: Vec3 = (0.0, 0.0, 0.0)
    emissiveTexture: TextureInfo | None = None
    normalTexture: NormalTextureInfo | None = None
    alphaMode: Literal["OPAQUE", "MASK", "BLEND"] = "OPAQUE"
    alphaCutoff: float = 0.5
    doubleSided: bool = False
    extensions: MaterialExtensions = MaterialExtensions()
