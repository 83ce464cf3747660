"""Scene → buffers, features and program text. The only code that packs a scene for the device."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..accel.build import FEW_SPHERES, build_tree, fitting_layout
from ..accel.kernels import HitTests, tree_buffers, tree_defines, tree_features, tree_files
from ..accel.layouts import Layout, leaf_spheres
from ..device.loops import loop_turns
from ..device.memory import array_bytes, needed_parts
from ..device.open import Device
from ..device.preamble import Buffers, defines, scene_struct, type_list, typedefs
from ..device.program import compose, files_of
from ..errors import UsageError
from ..scene.instancing import arranged
from ..scene.materials import MATERIALS, Material
from ..scene.model import Camera, Scene
from ..scene.textures import Texture
from ..scene.scaling import Frame, frame_of, in_frame
from ..scene.validate import validate
from .camera import camera_file
from .corners import pack_corners
from .emitters import SURFACES, TYPES, Emitters, pack_emitters
from .environment import Sky, pack_sky
from .filters import filter_quantiles
from .geometry import corners_of, normal_records, sphere_records, triangle_records
from .materials import Materials, pack_materials
from .placements import Objects, Placements
from .records import COUNTS, GUIDE, LAUNCH, PIXEL, PIXEL_WITH_DIRECT
from .textures import Textures
from .tiles import TILE, TILE_PIXELS


#: Of a scene's unit, what float32 holds.
LARGEST_UNIT = 2.0**127
#: Where rays leave a surface.
OFFSETS = {"bound": "offset/bound.cl", "ulp": "offset/ulp.cl", "fixed": "offset/fixed.cl"}
#: How paths are followed, and with how many lanes in waves.
PATHS, WAVE_LANES = ("lanes", "waves"), 8
#: Integrators that follow paths.
WITH_LIGHT = ("path", "direct")
#: The kernel files of the integrators of light; others show what is seen first (kernels/picture.cl).
ENTRIES = {"path": "path.cl", "direct": "path.cl", "local": "whitted.cl"}


@dataclass(frozen=True)
class Choices:
    """What a device or a user chooses about the program. lanes: paths a work-item (1, 8 or 16); offset: see OFFSETS;
    direct_light: whether the film keeps it apart.

    paths: how they are followed: "lanes", each in its lane (kernels/path.cl), or "waves", many together edge by edge
    (kernels/wave.cl); None for waves where there are 8 lanes, as they need.
    layout: a name in LAYOUTS, or None for the one that fits the device and the scene.
    """

    lanes: int = 8
    layout: str | None = None
    builder: str | None = None
    tests: HitTests = HitTests()
    offset: str = "bound"
    direct_light: bool = False
    paths: str | None = None

    def __post_init__(self) -> None:
        if self.paths == "waves" and self.lanes != WAVE_LANES:
            raise UsageError(f"paths in waves need {WAVE_LANES} lanes, not {self.lanes}; leave out one of the choices")

    @property
    def waves(self) -> bool:
        """Whether paths are followed in waves."""
        return self.lanes == WAVE_LANES and self.paths != "lanes"

    @property
    def pixel(self) -> np.dtype[Any]:
        """The record of a pixel of the film."""
        return PIXEL_WITH_DIRECT if self.direct_light else PIXEL


@dataclass(frozen=True)
class CompiledScene:
    """What a device needs to render a scene. The buffers' order is the order of the kernel's arguments.

    All points, the camera's too, are those of the scene in `frame` (see scene.scaling). instances: how many are in the
    tree; others became meshes (see scene.instancing). part_bytes: the arrays are in parts of at most so many bytes, as
    the device has no larger buffers (kernels/arrays.cl).
    """

    buffers: Buffers
    counts: NDArray[Any]
    features: list[str]
    preamble: str
    chosen_files: dict[str, list[str]]
    entry: str
    tree: Layout
    choices: Choices
    camera: Camera
    frame: Frame
    instances: int
    objects: Objects
    part_bytes: int | None = None

    @cached_property
    def source(self) -> str:
        """The program's text."""
        return self.source_of(self.entry)

    def source_of(self, entry: str, *preamble: str, **files: list[str]) -> str:
        """The text of the same scene's program with another kernel file as its entry.

        preamble, files: what that needs besides, before it and for its own `#include NAME`.
        """
        return compose("\n".join([self.preamble, *preamble]), entry, {**self.chosen_files, **files})

    @property
    def kernel(self) -> str:
        """The name of the entry's kernel."""
        return self.entry.removesuffix(".cl")

    @property
    def pixels(self) -> int:
        """How many a work-item of the entry takes."""
        return TILE_PIXELS if self.entry == "wave.cl" else self.choices.lanes

    @property
    def files(self) -> list[str]:
        """The kernel files that the program is made of."""
        return files_of(self.source)

    @property
    def bytes(self) -> int:
        """Device memory of the scene."""
        return sum(array_bytes(array, self.part_bytes) for _, array in self.buffers.values())


def compile_scene(scene: Scene, choices: Choices, entry: str | None = None,
                  device: Device | None = None) -> CompiledScene:
    """Validates and packs `scene` for the kernel file `entry`; SceneError lists all that is wrong with it.

    entry: None for the scene's integrator; device: where large trees are built, if given.
    """
    validate(scene)
    scene, *of_objects = arranged(scene)
    frame = frame_of(scene)
    scene = in_frame(scene, frame)
    placements = Placements(scene.instances, rest=bool(scene.meshes or scene.spheres))
    objects = Objects([len(mesh.faces) for mesh in scene.meshes], len(scene.spheres), *of_objects)
    scene = replace(scene, meshes=placements.meshes + scene.meshes)
    triangles, normals = corners_of(scene.meshes)
    spheres = np.array([(*s.center, s.radius) for s in scene.spheres], np.float32).reshape(-1, 4)
    lone = 0 < len(spheres) <= FEW_SPHERES
    in_tree = spheres[:0] if lone else spheres
    layout = choices.layout or fitting_layout(device, len(triangles), len(in_tree), choices.tests.triangle,
                                              bool(scene.instances))
    with ThreadPoolExecutor(1) as beside:  # a sky takes as long as a tree, and neither needs all cores
        packing = beside.submit(pack_sky, scene.environment)
        builder = placements.tree if scene.instances else build_tree
        tree = builder(device, layout, choices.builder, triangles, in_tree, choices.tests.triangle)
        sky = packing.result()
    textures = Textures()
    emitters = pack_emitters(scene, triangles, sky, textures)
    users = [mesh.material for mesh in scene.meshes] + [sphere.material for sphere in scene.spheres]
    users += placements.materials
    materials = pack_materials(users, textures)
    of_meshes, of_spheres, of_instances = np.split(materials.codes,
                                                   np.cumsum([len(scene.meshes), len(scene.spheres)]))

    buffers = tree_buffers(tree)
    if lone:
        every = np.arange(len(spheres), dtype=np.int32)
        buffers["leaf_spheres"] = ("LeafSphere", leaf_spheres(spheres, every, len(triangles) - placements.before))
    if len(triangles):
        per_mesh = np.repeat(np.arange(len(scene.meshes)), [len(mesh.faces) for mesh in scene.meshes])
        buffers["triangles"] = ("Triangle", triangle_records(triangles, of_meshes[per_mesh], emitters.triangle,
                                                             normals))
    if len(normals):
        buffers["normals"] = ("Normals", normal_records(normals))
    if len(spheres):
        buffers["spheres"] = ("Sphere", sphere_records(spheres, of_spheres, emitters.sphere))
    if scene.instances:
        buffers["placements"] = ("Placement", placements.records(of_instances))
    buffers |= pack_corners(scene.meshes, textures.uv_sets, bool(materials.mapped("normal_map")))
    buffers |= materials.buffers | textures.buffers() | emitters.buffers | sky.buffers
    if scene.render.filter != "box":
        buffers["filter"] = ("Filter", filter_quantiles(scene.render.filter))
    counts = np.zeros(1, COUNTS)
    counts["triangles"], counts["spheres"], counts["lights"] = len(triangles), len(spheres), emitters.count
    for kind, count in emitters.counts.items():
        counts[f"{kind}_lights"] = count

    features = _features(scene, materials, textures.uv_sets, users, emitters, sky, lone)
    if device is not None and loop_turns(device) is not None:
        features.add("LOOP_LIMIT")
    if choices.direct_light:
        features.add("DIRECT_LIGHT")
    integrator = scene.render.integrator
    unit = frame.unit if choices.offset != "bound" or integrator == "depth" else None
    part_bytes = needed_parts((array for _, array in buffers.values()), device.info) if device else None
    preamble = _preamble(buffers, features, materials, textures.uv_sets, emitters, choices, tree, unit, part_bytes)
    # A depth is that of what is in focus: the ray through the middle of a lens.
    camera = replace(scene.camera, aperture_radius=0.0) if integrator == "depth" else scene.camera
    parts = {part for kind in materials.used for part in kind.parts}
    files = {**{f"{part}_FILE": [f"bsdf/{part.lower()}.cl"] if part in features else [] for part in sorted(parts)},
             **_files(materials.used, emitters, sky, choices, tree.name, len(triangles) > 0, len(spheres) > 0, lone,
                      bool(scene.instances)),
             "VISIBILITY": ["visibility/layers.cl" if "OPACITY" in features else "visibility/opaque.cl"],
             "OPACITY_FILE": ["opacity.cl"] if "OPACITY" in features else [],
             "TEXTURE_FILES": ["texture.cl"] if textures.uv_sets else [],
             "SAMPLER": [f"sampler/{scene.render.sampler}.cl"], "CAMERA": [camera_file(camera)],
             "PICTURE": [f"picture/{integrator}.cl"],
             "FILTER": ["filter/box.cl" if scene.render.filter == "box" else "filter/table.cl"]}
    entry = entry or ENTRIES.get(integrator, "picture.cl")
    if entry == "path.cl" and choices.waves and "LOOP_LIMIT" not in features:
        entry = "wave.cl"
    return CompiledScene(buffers, counts, sorted(features), preamble, files, entry, tree, choices, scene.camera, frame,
                         len(scene.instances), objects, part_bytes)


def compile_for_all(scene: Scene, choices: Sequence[Choices], devices: Sequence[Device]) -> list[CompiledScene]:
    """The scene for each device with its choices: once for those that agree, unless trees were built on a device."""
    compiled: list[CompiledScene] = []
    for choice, device in zip(choices, devices):
        alike = [done for done, other, chosen in zip(compiled, devices, choices) if chosen == choice
                 and (other.layout, other.info.max_alloc_bytes) == (device.layout, device.info.max_alloc_bytes)
                 and all(isinstance(array, np.ndarray) for _, array in done.buffers.values())]
        compiled.append(alike[0] if alike else compile_scene(scene, choice, device=device))
    return compiled


def _features(scene: Scene, materials: Materials, uv_sets: int, users: list[Material], emitters: Emitters, sky: Sky,
              lone: bool) -> set[str]:
    """The names that are defined while compiling: what the scene has, and the parts of materials that it uses."""
    features = {f"MATERIAL_{kind.kernel.upper()}" for kind in materials.used}
    features |= {f"LIGHT_{kind.upper()}" for kind in emitters.types}
    features |= set().union(*(material.features() for material in users))
    has = {**tree_features(bool(scene.meshes), bool(scene.spheres), lone), "SPHERES": bool(scene.spheres),
           "SKY": sky.kernel is not None, "LIGHTS": emitters.count > 0, "LIGHT_TREE": emitters.choice.tree,
           "EMITTERS": any(t in SURFACES for t in emitters.types),
           "TEXTURES": uv_sets > 0, "EMISSION_TEXTURES": any(isinstance(user.emission, Texture) for user in users),
           "OPACITY": bool(materials.with_value("opacity")), "NORMAL_MAPS": bool(materials.mapped("normal_map")),
           "LOCAL": scene.render.integrator == "local",
           "VERTEX_COLORS": any(mesh.colors is not None for mesh in scene.meshes),
           "INSTANCES": bool(scene.instances),
           "SMOOTH_NORMALS": any(mesh.normals is not None for mesh in scene.meshes)}
    return features | {name for name, present in has.items() if present}


def _preamble(buffers: Buffers, features: set[str], materials: Materials, uv_sets: int, emitters: Emitters,
              choices: Choices, tree: Layout, unit: float | None, part_bytes: int | None) -> str:
    # Only programs that know lengths of the scene's know its unit: others are shared whatever it is.
    lengths = {} if unit is None else {"SCENE_UNIT": min(unit, LARGEST_UNIT)}
    surfaces = [t for t in emitters.types if t in SURFACES]
    return "\n".join([
        defines({"LANES": choices.lanes, "TILE": TILE, **tree_defines(tree), **lengths}),
        defines({"CHOICES": emitters.choice.choices, "INFINITE_LIGHTS": emitters.choice.infinite}),
        defines({feature: 1 for feature in sorted(features)}),
        typedefs({"Counts": COUNTS, "Pixel": choices.pixel, "Guide": GUIDE, "Launch": LAUNCH}),
        scene_struct(buffers, part_bytes),
        type_list("MATERIAL_TYPES", _numbered(materials.used)),
        type_list("OPACITY_TYPES", _numbered(materials.with_value("opacity"))),
        type_list("NORMAL_MAPPED_TYPES", _numbered(materials.mapped("normal_map"))),
        type_list("SPREADING_TYPES", _numbered(materials.featured("TRANSMISSION_LOBES"))),
        type_list("ABSORBING_TYPES", _numbered(materials.featured("ATTENUATION"))),
        defines({"UV_SETS": uv_sets}),
        *(f"#define READ_{name} {'TEXTURED' if reads else 'CONSTANT'}" for name, reads in materials.reads.items()),
        type_list("LIGHT_TYPES", [(t, TYPES.index(t)) for t in emitters.types]),
        type_list("EMITTER_TYPES", [(t, TYPES.index(t)) for t in surfaces])])


def _numbered(kinds: Iterable[type[Material]]) -> list[tuple[str, int]]:
    return [(kind.kernel, MATERIALS.index(kind)) for kind in kinds]


def _files(used: list[type[Material]], emitters: Emitters, sky: Sky, choices: Choices, layout: str,
           triangles: bool, spheres: bool, lone: bool, instances: bool) -> dict[str, list[str]]:
    lights = [f"light/{t}.cl" for t in emitters.types if t != "sky"]
    return {**tree_files(layout, choices.tests, triangles, spheres, lone, instances),
            "PLACEMENT_FILE": ["placement.cl"] if instances else [], "OFFSET": [OFFSETS[choices.offset]],
            "MATERIAL_FILES": [f"bsdf/{kind.kernel}.cl" for kind in used],
            "LIGHT_CHOICE": emitters.choice.files, "LIGHT_TREE_FILE": ["light/tree.cl"] if emitters.choice.tree else [],
            "LIGHT_FILES": lights + ([sky.kernel] if sky.kernel else [])}
