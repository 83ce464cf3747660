"""Scene description: plain dataclasses, numpy only. Lengths in scene units, right-handed, +Y up, linear Rec. 709."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from .animation import Animation, ModelAnimation, SceneAnimation
from .axes_and_units import Axis, LightUnit, Unit
from .cameras import Camera as Camera
from .fields.field_types import show
from .fields.group_name import GroupName
from .fields.limits import Ge, Gt, Le
from .fields.pixels import image_faults
from .fields.validated import Editable, KnownFields, Validated
from .geometry.mesh_faults import CORNERS, mesh_faults
from .geometry.transform_faults import are_mirrored, placement_faults
from .lights import Light
from .materials.material_types import Diffuse, Material
from .materials.textures import NonNegative
from .render_settings import RenderSettings as RenderSettings

Vector = tuple[float, float, float]
FloatArray = NDArray[np.float32]
IntArray = NDArray[np.int32]
Positive = Annotated[float, Gt(0)]
Fraction = Annotated[float, Ge(0), Le(1)]
#: View transforms without a config of their own, see output/view_transform.py.
ViewName = Literal["srgb", "agx", "pbr_neutral", "reinhard", "aces", "raw"]


@dataclass(eq=False)
class Mesh(Editable):
    """Triangle mesh with one material.

    - vertices: (n, 3) float32; faces: (m, 3) int32, counter-clockwise seen from the front.
    - normals: (n, 3) float32, interpolated over each face, or None for flat shading.
    - uv, uv1: (n, 2) float32, the two sets of texture coordinates (see `Texture`).
    - colors: (n, 3) or (n, 4) float32, linear, from 0 to 1; they multiply the material's color, and the fourth
      component its opacity.
    - tangents: (n, 4) float32, for normal maps, w the sign of the bitangent as in glTF; computed if missing.
    - material_name: the material's name in the model file.

    Lists and arrays of other dtypes are converted. The arrays are read-only views of those that are given, which are
    not copied unless they are converted: do not change them any more. Raises SceneError for other shapes, indices out
    of range, values that are not finite, normals of length 0, and textures in the material without texture coordinates.
    """

    remedy: ClassVar[str] = "write a clrt.Mesh"
    vertices: FloatArray
    faces: IntArray
    material: Material = field(default_factory=Diffuse)
    normals: FloatArray | None = None
    name: str = "mesh"
    uv: FloatArray | None = None
    uv1: FloatArray | None = None
    colors: FloatArray | None = None
    tangents: FloatArray | None = None
    material_name: str = ""

    @property
    def title(self) -> str:
        return f"mesh {show(self.name)}"

    def faults(self) -> list[str]:
        corners = {name: array for name in CORNERS if (array := getattr(self, name)) is not None}
        arrays = mesh_faults(self.vertices, self.faces, corners)
        return [f": {fault}" for fault in arrays] + (super().faults() or self.missing_uv(self.material))

    def missing_uv(self, material: Material) -> list[str]:
        """Return problems of a material's textures for which the mesh has no texture coordinates."""
        return [
            f": its material reads the texture {show(texture.picture.name)} at uv{texture.uv_set or ''}, but the mesh "
            "has none; add texture coordinates, or use another material"
            for texture in material.textures()
            if (self.uv1 if texture.uv_set else self.uv) is None
        ]

    @property
    def has_alpha(self) -> bool:
        """Whether the alpha of its vertex colors is less than 1 somewhere."""
        return self.colors is not None and self.colors.shape[1] == 4 and bool((self.colors[:, 3] < 1).any())


#: Matrices of an instance.
MATRICES = ("to_world", "to_world_end", "pivot")


@dataclass(eq=False)
class Instance(Editable):
    """An instance, which shares its mesh's memory. The mesh itself is rendered only if the scene's `meshes` contain it.

    to_world: (3, 4), or (4, 4) with the last row 0, 0, 0, 1: an affine matrix that acts on column vectors and takes the
    mesh's points to the world; it may mirror, but must not be singular. material: replaces the mesh's own. The matrix
    is read-only, as the arrays of `Mesh`; raises SceneError likewise.

    to_world_end: the same at the end of the camera's exposure, if it moves. pivot: likewise, takes the mesh's points to
    the frame whose origin moves in a straight line and whose axes turn at a constant rate; None for the mesh's own.
    """

    mesh: Mesh
    to_world: NDArray[np.float64] = field(default_factory=lambda: np.eye(3, 4))
    material: Material | None = None
    name: str = "instance"
    to_world_end: NDArray[np.float64] | None = None
    pivot: NDArray[np.float64] | None = None

    def __setattr__(self, name: str, value: Any) -> None:
        """Convert the numbers of matrices to float64 and four rows to three."""
        super().__setattr__(name, _three_rows(value) if name in MATRICES and value is not None else value)

    @property
    def title(self) -> str:
        return f"instance {show(self.name)}"

    def faults(self) -> list[str]:
        if faults := super().faults():
            return faults
        for name in MATRICES:
            matrix = getattr(self, name)
            if matrix is None and name != "to_world":
                continue
            if not isinstance(matrix, np.ndarray) or matrix.shape != (3, 4):
                shape = f"has shape {matrix.shape}" if isinstance(matrix, np.ndarray) else f"is {show(matrix)}"
                return [
                    f": {name} {shape}; write a numpy array of shape (3, 4), or (4, 4) with the last row 0, 0, 0, 1"
                ]
            if faults := placement_faults(matrix, self.mesh.vertices):
                rows = show(tuple(tuple(row) for row in matrix.tolist()))
                return [f": {name} {rows} {fault}; repair it" for fault in faults]
        if self.to_world_end is not None and are_mirrored(self.to_world, self.to_world_end):
            return [
                ": one of to_world and to_world_end mirrors the mesh, which would be flat in between; mirror both or "
                "neither"
            ]
        return [] if self.material is None else self.mesh.missing_uv(self.material)


def _three_rows(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    with suppress(ValueError, TypeError, OverflowError):
        numbers = np.asarray(matrix, np.float64)
        affine = numbers.shape == (4, 4) and np.array_equal(numbers[3], (0.0, 0.0, 0.0, 1.0))
        return numbers[:3] if affine else numbers
    return matrix


@dataclass(eq=False, kw_only=True)
class Model:
    """Content of a model file: meshes or instances, at least one, cameras by name in file order, and lights.

    - emitters: lights with a surface, which are not part of the model itself
    - environment: the light from all around, if the file has one
    - animation: the file's first one, or the one that was chosen
    - contents: names of all that can be chosen, by kind: scenes, animations, variants; supported extensions that are
      used; left_out: what is not rendered, and why
    - up, unit: which of the file's axes points up, and the unit of its lengths
    - converted_from: the unit of the lights in the file, if it was guessed and they were converted
    - center: the model's origin in the file, of one that is far from the file's origin; else (0, 0, 0)
    """

    meshes: list[Mesh]
    instances: list[Instance] = field(default_factory=list)
    cameras: dict[str, Camera] = field(default_factory=dict)
    lights: list[Light] = field(default_factory=list)
    emitters: list[Mesh] = field(default_factory=list)
    environment: Environment | None = None
    animation: ModelAnimation | None = None
    contents: Mapping[str, Sequence[str]] = field(default_factory=dict)
    up: Axis = "y"
    unit: Unit = "m"
    converted_from: LightUnit | None = None
    center: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class Sphere(Validated):
    """Sphere seen from outside (or from inside, which is its back side)."""

    center: Vector = (0.0, 0.0, 0.0)
    radius: Positive = 1.0
    material: Material = field(default_factory=Diffuse)
    name: str = "sphere"


@dataclass(eq=False, kw_only=True)
class Environment(Editable):
    """Environment light: a constant `color`, or an environment map, `image` (h, w, 3) float32, equirectangular.

    Direction to texel: u = atan2(x, −z)/2π mod 1, v = acos(y)/π, row 0 on top; `rotation_degrees` rotates the
    environment about +Y, counter-clockwise seen from above. Radiance = strength · (color or texel). camera_visible:
    whether the camera sees it and the discs of the suns behind the scene; if not, it sees black there. light_group: the
    name of the layer that its light is stored in (docs/light-groups.md), "" for the rest. The image is read-only, as
    the arrays of `Mesh`.
    """

    color: tuple[NonNegative, NonNegative, NonNegative] = (0.0, 0.0, 0.0)
    image: FloatArray | None = None
    strength: NonNegative = 1.0
    rotation_degrees: float = 0.0
    camera_visible: bool = True
    light_group: GroupName = ""

    def conflicts(self) -> list[str]:
        return image_faults(self.image, self.color)


@dataclass(eq=False, kw_only=True)
class Backdrop(Editable):
    """Backdrop, seen by the camera behind the scene instead of the environment; it emits no light.

    A constant `color`, or an `image` (h, w, 3) float32, linear Rec. 709, which fills the rendered image and is cropped
    to its shape.
    """

    color: tuple[NonNegative, NonNegative, NonNegative] = (0.0, 0.0, 0.0)
    image: FloatArray | None = None

    def conflicts(self) -> list[str]:
        return image_faults(self.image, self.color)


@dataclass(frozen=True, kw_only=True)
class Ground(Validated):
    """Diffuse square floor that catches the shadow of the scene, in images of light (see on_ground.on_ground).

    height: its y; center: x and z of its middle; radius: half its side; color: its albedo.
    """

    height: float = 0.0
    center: tuple[float, float] = (0.0, 0.0)
    radius: Positive = 1.0
    color: tuple[Fraction, Fraction, Fraction] = (0.5, 0.5, 0.5)


@dataclass(frozen=True, kw_only=True)
class Display(Validated):
    """How images of the scene are shown. view: their view transform, unless another is chosen (docs/colour.md)."""

    view: ViewName = "srgb"


@dataclass(eq=False)
class Origin:
    """A [[mesh]] or [[instance]] table, with the file's absolute path. parts: what it showed; own: the materials of
    these without the table's."""

    table: Mapping[str, Any]
    parts: Sequence[Mesh | Instance]
    own: Sequence[Material | None]


@dataclass(eq=False)
class Framing:
    """The camera that frames a bare model, and what it frames, without the model's emitters."""

    camera: Camera
    meshes: list[Mesh]
    instances: list[Instance]


@dataclass(eq=False)
class Source:
    """Sources of a scene. meshes, instances: tables in their order. files: textures' pictures and environment maps,
    each with its file. cameras: those of model files. contents: see `Model`. framing: of a bare model without a camera.
    """

    meshes: list[Origin] = field(default_factory=list)
    instances: list[Origin] = field(default_factory=list)
    files: list[tuple[object, Path]] = field(default_factory=list)
    cameras: dict[str, Camera] = field(default_factory=dict)
    contents: Mapping[str, Sequence[str]] = field(default_factory=dict)
    framing: Framing | None = None

    @property
    def paths(self) -> list[Path]:
        """Return the files of meshes, textures and environment maps."""
        return [
            *(origin.table["file"] for origin in self.meshes if "file" in origin.table),
            *(path for _, path in self.files),
        ]

    def file_of(self, content: object) -> Path | None:
        """Return the file that this very picture or image object was read from."""
        return next((path for each, path in self.files if each is content), None)


#: Conversions of other libraries' meshes and scenes, which return None for anything else (formats.trimesh_models).
CONVERSIONS: list[Callable[[object], Model | None]] = []


@dataclass(eq=False, kw_only=True)
class Scene(KnownFields):
    """Everything needed to render an image.

    - meshes: also meshes and scenes of trimesh, which are converted, with the materials that they have in glTF.

    - camera: the one to render; cameras: others by name, including those of model files.
    - backdrop: what the camera sees behind the scene, if not the environment.
    - ground: what the scene stands on, in images of light only; display: how these are shown.
    - animation: how the camera and models move.
    - materials: the scene file's named ones; meshes and spheres refer to these objects.
    - source: the files that its parts were read from, if any.

    Raises SceneError with all problems of its parts, and of what does not go together. Its lists and fields may be
    changed; a scene is validated again before it is rendered.
    """

    remedy: ClassVar[str] = 'write a clrt.Scene, or clrt.load("FILE")'
    meshes: list[Mesh] = field(default_factory=list)
    instances: list[Instance] = field(default_factory=list)
    spheres: list[Sphere] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    camera: Camera = field(default_factory=Camera)
    environment: Environment = field(default_factory=Environment)
    render: RenderSettings = field(default_factory=RenderSettings)
    name: str = "scene"
    cameras: dict[str, Camera] = field(default_factory=dict)
    animation: Animation | ModelAnimation | SceneAnimation | None = None
    materials: dict[str, Material] = field(default_factory=dict)
    source: Source | None = None
    backdrop: Backdrop | None = None
    ground: Ground | None = None
    display: Display = field(default_factory=Display)

    def __post_init__(self) -> None:
        from .validation.validate import validate  # which knows all parts of a scene

        if isinstance(self.meshes, list | tuple) and not all(isinstance(each, Mesh) for each in self.meshes):
            self._convert()
        validate(self)

    def _convert(self) -> None:
        """Replace other libraries' meshes and scenes by what they show."""
        models = [_converted(each, f"meshes[{i}]") for i, each in enumerate(self.meshes)]
        self.meshes = [
            mesh
            for each, model in zip(self.meshes, models)
            for mesh in ([each] if model is None else [*model.meshes, *model.emitters])
        ]
        self.instances = [*self.instances, *(each for model in models if model for each in model.instances)]


def _converted(mesh: object, where: str) -> Model | None:
    """Return the content of another library's mesh or scene, if it is one. Raises SceneError, which names its place."""
    try:
        return next(filter(None, (convert(mesh) for convert in CONVERSIONS)), None)
    except SceneError as error:
        raise SceneError([f"{where}: {problem}" for problem in error.problems]) from error
