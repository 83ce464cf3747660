"""What is drawn: plain dataclasses, numpy only. Lengths in scene units, right-handed, +Y up, linear Rec. 709."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import ClrtError
from .animation import Animation
from .lights import Light
from .limits import Ge, Gt, Le, Lt
from .material import Culling, tuples_for_lists
from .materials import Diffuse, Material
from .numbers import real_array, whole_array
from .textures import NonNegative

if TYPE_CHECKING:
    from .source import Source

Vector = tuple[float, float, float]
FloatArray = NDArray[np.float32]
IntArray = NDArray[np.int32]
Positive = Annotated[float, Gt(0)]
Pixels = Annotated[int, Ge(1), Le(65536)]
Projection = Literal["perspective", "orthographic", "equirectangular"]
Integrator = Literal["path", "direct", "local", "raster", "normals", "albedo", "depth"]
Sampler = Literal["sobol", "stratified", "independent"]
Filter = Literal["box", "tent", "blackman_harris", "gaussian"]


@dataclass(frozen=True, kw_only=True)
class Camera:
    """What the picture shows; `look_at` is in its middle, and its right is cross(forward, up).

    perspective: through a pinhole, or a thin lens of `aperture_radius` that is sharp at `focus_distance` along the view
    (None: that of `look_at`); `fov_degrees`: vertical, full angle. orthographic: parallel rays, a picture `view_height`
    high (None: as high as the perspective is at `look_at`). equirectangular: all directions, laid out as Environment's
    for a view along +Z.
    """

    position: Vector = (0.0, 0.0, 5.0)
    look_at: Vector = (0.0, 0.0, 0.0)
    up: Vector = (0.0, 1.0, 0.0)
    fov_degrees: Annotated[float, Gt(0), Lt(180)] = 40.0
    aperture_radius: NonNegative = 0.0
    focus_distance: Positive | None = None
    projection: Projection = "perspective"
    view_height: Positive | None = None

    def __post_init__(self) -> None:
        tuples_for_lists(self)


@dataclass(eq=False)
class Mesh:
    """Triangles of one material.

    vertices: (n, 3) float32; faces: (m, 3) int32, counter-clockwise seen from the front; both become that from lists
    and arrays of other numbers. normals: (n, 3) float32, interpolated over each face, or None for flat shading.
    uv, uv1: (n, 2) float32, the two sets of texture coordinates (scene.textures). colors: (n, 3) or (n, 4) float32,
    linear, from 0 to 1, which multiply the material's color, and the fourth its opacity, if that is not 1.
    tangents: (n, 4) float32, for normal maps, w the sign of the bitangent as in glTF; computed where they are missing.
    material_name: what a model file calls the material.
    """

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

    def __post_init__(self) -> None:
        """Lists and arrays of other numbers become float32 and int32 where these hold them; what is wrong with an array
        is for `validate` to say."""
        with suppress(ClrtError), np.errstate(over="ignore", under="ignore"):
            self.vertices = real_array("vertices", self.vertices).astype(np.float32, copy=False)
        with suppress(ClrtError):
            faces = whole_array("faces", self.faces)
            narrow = faces.astype(np.int32, copy=False)
            self.faces = narrow if np.array_equal(faces, narrow) else faces


@dataclass(eq=False)
class Instance:
    """A mesh that stands in the world once more, in the memory of one. That mesh itself is drawn only where the scene's
    `meshes` hold it, too.

    to_world: (3, 4), or (4, 4) with the last row 0, 0, 0, 1: an affine matrix that acts on column vectors and takes the
    mesh's points to the world; it may mirror, but must not flatten. material: instead of the mesh's own.
    """

    mesh: Mesh
    to_world: NDArray[np.float64] = field(default_factory=lambda: np.eye(3, 4))
    material: Material | None = None
    name: str = "instance"

    def __post_init__(self) -> None:
        """Numbers become float64, four rows three; what is wrong with them is for `validate` to say."""
        with suppress(ValueError, TypeError, OverflowError):
            matrix = np.asarray(self.to_world, np.float64)
            affine = matrix.shape == (4, 4) and np.array_equal(matrix[3], (0.0, 0.0, 0.0, 1.0))
            self.to_world = matrix[:3] if affine else matrix


@dataclass(eq=False, kw_only=True)
class Model:
    """What a model file holds: meshes or instances, at least one, its cameras by name, the first one first, and its
    lights."""

    meshes: list[Mesh]
    instances: list[Instance] = field(default_factory=list)
    cameras: dict[str, Camera] = field(default_factory=dict)
    lights: list[Light] = field(default_factory=list)


@dataclass(frozen=True, kw_only=True)
class Sphere:
    """A sphere seen from outside (or from inside, which is its back side)."""

    center: Vector = (0.0, 0.0, 0.0)
    radius: Positive = 1.0
    material: Material = field(default_factory=Diffuse)
    name: str = "sphere"

    def __post_init__(self) -> None:
        tuples_for_lists(self)


@dataclass(eq=False, kw_only=True)
class Environment:
    """Light from infinitely far away: a constant `color`, or an `image` (h, w, 3) float32 in latitude–longitude form.

    Direction to texel: u = atan2(x, −z)/2π mod 1, v = acos(y)/π, row 0 on top; `rotation_degrees` turns the
    environment about +Y, counter-clockwise seen from above. Radiance = strength · (color or texel).
    """

    color: tuple[NonNegative, NonNegative, NonNegative] = (0.0, 0.0, 0.0)
    image: FloatArray | None = None
    strength: NonNegative = 1.0
    rotation_degrees: float = 0.0


@dataclass(frozen=True, kw_only=True)
class RenderSettings:
    """How to render unless told otherwise. `size`: (width, height). `max_depth` counts path edges:
    1 = only what glows, 2 = + direct light, 3 = + one bounce. shadows: whether they are cast, where the integrator is
    local or raster. back_face_culling: which rays pass through the back faces of materials that are not double_sided:
    "none", those of the "camera", or "all". clamp_direct, clamp_indirect: the largest value that any channel of one
    contribution to a sample may have, for paths of at most two edges and for longer ones, where the integrator is path
    or direct; 0 does not clamp."""

    size: tuple[Pixels, Pixels] = (512, 512)
    spp: Annotated[int, Ge(1)] = 64
    max_depth: Annotated[int, Ge(1), Le(1024)] = 8
    seed: Annotated[int, Ge(0), Lt(2**32)] = 0
    integrator: Integrator = "path"
    shadows: bool = True
    sampler: Sampler = "sobol"
    filter: Filter = "box"
    adaptive: bool = False
    back_face_culling: Culling = "none"
    clamp_direct: NonNegative = 0.0
    clamp_indirect: NonNegative = 0.0

    def __post_init__(self) -> None:
        tuples_for_lists(self)


@dataclass(eq=False, kw_only=True)
class Scene:
    """Everything that one picture needs. `camera` takes it; `cameras`: others by name, those of the model files, too;
    `animation`: how the camera moves (scene.animation).

    materials: those that the scene file names; its meshes and spheres refer to these objects. source: where its parts
    were read from, if they were.
    """

    meshes: list[Mesh] = field(default_factory=list)
    instances: list[Instance] = field(default_factory=list)
    spheres: list[Sphere] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    camera: Camera = field(default_factory=Camera)
    environment: Environment = field(default_factory=Environment)
    render: RenderSettings = field(default_factory=RenderSettings)
    name: str = "scene"
    cameras: dict[str, Camera] = field(default_factory=dict)
    animation: Animation | None = None
    materials: dict[str, Material] = field(default_factory=dict)
    source: Source | None = None
