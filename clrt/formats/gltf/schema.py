"""Schema of the parts of a glTF 2.0 document that are read, with the specification's names (Khronos 2021, section 5).

Imported only when a glTF file is read, since it needs pydantic. Unknown properties are ignored.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from typing import Annotated, Literal, TypeVar

from pydantic import Field, ValidationError

from ...errors import SceneError
from ...scene.editing import free_name
from .material_schema import Image, Index, Material, Part, Sampler, Texture, Vec3, Vec4

Item = TypeVar("Item")
Count = Annotated[int, Field(ge=1)]
NonNegative = Annotated[float, Field(ge=0)]
ComponentType = Literal[5120, 5121, 5122, 5123, 5125, 5126]

#: Byte order mark, which some exporters write before the JSON text.
BOM = b"\xef\xbb\xbf"
#: Supported extensions.
EXTENSIONS = frozenset(
    f"KHR_materials_{name}"
    for name in (
        "anisotropy",
        "clearcoat",
        "diffuse_transmission",
        "dispersion",
        "emissive_strength",
        "ior",
        "iridescence",
        "pbrSpecularGlossiness",
        "sheen",
        "specular",
        "transmission",
        "unlit",
        "variants",
        "volume",
    )
) | frozenset(
    {
        "EXT_mesh_gpu_instancing",
        "EXT_meshopt_compression",
        "EXT_texture_avif",
        "EXT_texture_webp",
        "KHR_animation_pointer",
        "KHR_draco_mesh_compression",
        "KHR_lights_punctual",
        "KHR_mesh_quantization",
        "KHR_meshopt_compression",
        "KHR_node_visibility",
        "KHR_texture_basisu",
        "KHR_texture_transform",
    }
)
#: Extensions that change only how surfaces look or move: files that require them are read without.
OPTIONAL = re.compile(
    r"[A-Z0-9]+_(materials|texture|lights|animation|audio|interactivity|xmp|node_hoverability|node_selectability|"
    r"physics|collision|\w*metadata|\w*features)"
)


class Asset(Part):
    version: str
    generator: object = None
    minVersion: str | None = None


class Buffer(Part):
    byteLength: Count
    uri: str | None = None


class Meshopt(Part):
    buffer: Index
    byteLength: Count
    byteStride: Count
    count: Count
    mode: Literal["ATTRIBUTES", "TRIANGLES", "INDICES"]
    byteOffset: Index = 0
    filter: Literal["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"] = "NONE"


class BufferViewExtensions(Part):
    EXT_meshopt_compression: Meshopt | None = None
    KHR_meshopt_compression: Meshopt | None = None

    @property
    def meshopt(self) -> Meshopt | None:
        return self.KHR_meshopt_compression or self.EXT_meshopt_compression


class BufferView(Part):
    buffer: Index
    byteLength: Count
    byteOffset: Index = 0
    byteStride: Annotated[int, Field(ge=4, le=252)] | None = None
    extensions: BufferViewExtensions = BufferViewExtensions()


class SparseIndices(Part):
    bufferView: Index
    byteOffset: Index = 0
    componentType: Literal[5121, 5123, 5125]


class SparseValues(Part):
    bufferView: Index
    byteOffset: Index = 0


class Sparse(Part):
    count: Count
    indices: SparseIndices
    values: SparseValues


class Accessor(Part):
    componentType: ComponentType
    count: Count
    type: Literal["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"]
    bufferView: Index | None = None
    byteOffset: Index = 0
    normalized: bool = False
    sparse: Sparse | None = None


class Draco(Part):
    bufferView: Index
    attributes: dict[str, Index]


class VariantMapping(Part):
    material: Index
    variants: list[Index]


class VariantMappings(Part):
    mappings: list[VariantMapping] = []


class PrimitiveExtensions(Part):
    KHR_draco_mesh_compression: Draco | None = None
    KHR_materials_variants: VariantMappings = VariantMappings()


class Primitive(Part):
    attributes: dict[str, Index]
    indices: Index | None = None
    material: Index | None = None
    mode: Annotated[int, Field(ge=0, le=6)] = 4
    targets: list[dict[str, Index]] = []
    extensions: PrimitiveExtensions = PrimitiveExtensions()


class Mesh(Part):
    primitives: list[Primitive]
    weights: list[float] = []
    name: str | None = None


class Perspective(Part):
    yfov: Annotated[float, Field(gt=0, lt=3.14159)]


class Orthographic(Part):
    ymag: float


class Camera(Part):
    perspective: Perspective | None = None
    orthographic: Orthographic | None = None
    name: str | None = None


class Spot(Part):
    innerConeAngle: Annotated[float, Field(ge=0)] = 0.0
    outerConeAngle: Annotated[float, Field(gt=0, le=1.5708)] = 0.7853981633974483


class Light(Part):
    type: Literal["directional", "point", "spot"]
    color: tuple[NonNegative, NonNegative, NonNegative] = (1.0, 1.0, 1.0)
    intensity: NonNegative = 1.0
    range: float | None = None
    spot: Spot = Spot()


class Lights(Part):
    lights: list[Light] = []


class UsedLight(Part):
    light: Index


class Instancing(Part):
    attributes: dict[str, Index]


class Visibility(Part):
    visible: bool = True


class NodeExtensions(Part):
    EXT_mesh_gpu_instancing: Instancing | None = None
    KHR_lights_punctual: UsedLight | None = None
    KHR_node_visibility: Visibility = Visibility()


class Variant(Part):
    name: str | None = None


class Variants(Part):
    variants: list[Variant] = []


class DocumentExtensions(Part):
    KHR_lights_punctual: Lights = Lights()
    KHR_materials_variants: Variants = Variants()


class Node(Part):
    children: list[Index] = []
    mesh: Index | None = None
    camera: Index | None = None
    skin: Index | None = None
    weights: list[float] = []
    matrix: Annotated[list[float], Field(min_length=16, max_length=16)] | None = None
    translation: Vec3 = (0.0, 0.0, 0.0)
    rotation: Vec4 = (0.0, 0.0, 0.0, 1.0)
    scale: Vec3 = (1.0, 1.0, 1.0)
    name: str | None = None
    extensions: NodeExtensions = NodeExtensions()


class Skin(Part):
    joints: Annotated[list[Index], Field(min_length=1)]
    inverseBindMatrices: Index | None = None


class AnimationPointer(Part):
    pointer: str


class TargetExtensions(Part):
    KHR_animation_pointer: AnimationPointer | None = None


class AnimationTarget(Part):
    path: str
    node: Index | None = None
    extensions: TargetExtensions = TargetExtensions()


class AnimationChannel(Part):
    sampler: Index
    target: AnimationTarget


class AnimationSampler(Part):
    input: Index
    output: Index
    interpolation: str | int = "LINEAR"


class Animation(Part):
    channels: list[AnimationChannel]
    samplers: list[AnimationSampler]


class Scene(Part):
    nodes: list[Index] = []
    name: str | None = None


class Document(Part):
    """A whole glTF document."""

    asset: Asset
    extensionsRequired: list[str] = []
    extensionsUsed: list[str] = []
    accessors: list[Accessor] = []
    #: As stored; see `parse_animation`.
    animations: list[dict[str, object]] = []
    buffers: list[Buffer] = []
    bufferViews: list[BufferView] = []
    cameras: list[Camera] = []
    images: list[Image] = []
    materials: list[Material] = []
    meshes: list[Mesh] = []
    nodes: list[Node] = []
    scene: Index | None = None
    samplers: list[Sampler] = []
    scenes: list[Scene] = []
    skins: list[Skin] = []
    textures: list[Texture] = []
    extensions: DocumentExtensions = DocumentExtensions()


def parse_document(text: bytes, ignored: Collection[str] = ()) -> Document:
    """Parse a JSON text. Raises SceneError with every property that the specification does not allow, for a version
    other than 2, and for a required extension that is in neither EXTENSIONS nor OPTIONAL nor `ignored`."""
    try:
        document = Document.model_validate_json(text.removeprefix(BOM))
    except ValidationError as error:
        raise SceneError(_problems(error)) from None
    if not document.asset.version.startswith("2."):
        raise SceneError(f'asset.version is "{document.asset.version}"; only glTF 2 is supported, export it as 2.0')
    unknown = sorted(set(document.extensionsRequired) - EXTENSIONS - set(ignored))
    missing = [name for name in unknown if not OPTIONAL.match(name)]
    if missing:
        options = " ".join(f"--ignore-extension {name}" for name in missing)
        raise SceneError(
            f"needs the extension {', '.join(missing)}, which is not supported; export without it, or read what is "
            f"supported ({options}; in a scene file ignore_extensions)"
        )
    return document


def parse_animation(document: Document, index: int) -> Animation:
    """Parse an animation, which a still does not need. Raises SceneError with its faults, as `parse_document` does."""
    try:
        return Animation.model_validate(document.animations[index])
    except ValidationError as error:
        raise SceneError(_problems(error, ("animations", index))) from None


def entry(items: Sequence[Item], index: int, name: str, user: str) -> Item:
    """Return items[index]; raises SceneError if it does not exist. `name`: the kind of item, such as "accessor"."""
    if index >= len(items):
        raise SceneError(f"{user} uses {name} {index}, but the file has {len(items)}; export the file again")
    return items[index]


def unique_names(kind: str, names: Sequence[str | None]) -> list[str]:
    """Return the names, "KIND N" where there is none, with a number appended to those in use."""
    unique: dict[str, None] = {}
    numbers: dict[str, int] = {}
    for index, name in enumerate(names):
        unique[free_name(name or f"{kind} {index}", unique, numbers)] = None
    return list(unique)


def _problems(error: ValidationError, parent: tuple[int | str, ...] = ()) -> list[str]:
    """Return messages for the first faults of what is stored at `parent` in the document."""
    details = error.errors(include_url=False)
    return [f"{_path((*parent, *detail['loc']))}: {detail['msg']}; export the file again" for detail in details[:12]]


def _path(location: tuple[int | str, ...]) -> str:
    """Format a location in the document, such as accessors[3].count."""
    words = [f"[{part}]" if isinstance(part, int) else f".{part}" for part in location]
    return "".join(words).removeprefix(".") or "the document"
