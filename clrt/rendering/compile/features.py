"""Compile-time features, preamble and files of a packed scene: a program contains only what its scene needs."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from ...accel.layouts import NO_RAYS
from ...accel.traversal_kernels import tree_defines, tree_features, tree_files
from ...device.programs.preamble import defines, scene_struct, type_list, typedefs
from ...scene.exposure import motion_features
from ...scene.materials.material_types import MATERIALS, Material
from ...scene.materials.textures import Texture
from ...scene.model import Camera, RenderSettings, Scene
from ...scene.ray_list import RayList
from ..film.tiles import TILE
from .camera_kernel import camera_defines, camera_file, launch_of
from .choices import OFFSETS, Choices, ResolvedChoices
from .film_record import launch_type, pixel_record
from .lights.light_types import SURFACES, TYPES
from .pack_scene import PackedScene
from .pixel_filters import filter_reach
from .records import COUNTS, GUIDE, OUTLINE

#: Path-tracing integrators, and the kernel files of the integrators that compute light; others show first hits
#: (kernels/integrator/first_surface.cl).
WITH_LIGHT = ("path", "direct")
INTEGRATORS = {
    "path": "integrator/path.cl",
    "direct": "integrator/path.cl",
    "local": "integrator/local.cl",
    "raster": "integrator/local.cl",
}


def biased_by(settings: RenderSettings) -> list[str]:
    """Return the names of the settings that darken the image however many samples it has."""
    clamps = ("clamp_direct", "clamp_indirect") if settings.integrator in WITH_LIGHT else ()
    return [name for name in clamps if getattr(settings, name)]


def features_of(packed: PackedScene, choices: Choices, loop_limit: bool) -> set[str]:
    """Return the macros that are defined for compilation: features of the scene and of the materials that it uses.

    loop_limit: whether the device limits loop iterations (see device.loops).
    """
    scene, emitters, materials = packed.scene, packed.emitters, packed.materials
    local = scene.render.integrator in ("local", "raster")
    features = {f"MATERIAL_{kind.kernel.upper()}" for kind in materials.used}
    features |= {f"LIGHT_{kind.upper()}" for kind in emitters.types}
    features |= set().union(emitters.features, *(material.features() for material in packed.shapes.users))
    features |= packed.film | motion_features(scene)
    has = {
        "TIME": bool(motion_features(scene)),
        **tree_features(bool(scene.meshes), bool(scene.spheres), packed.shapes.lone, packed.tree is not NO_RAYS),
        "SPHERES": bool(scene.spheres),
        "INSTANCES": bool(scene.instances),
        "SMOOTH_NORMALS": any(mesh.normals is not None for mesh in scene.meshes),
        "VERTEX_COLORS": any(mesh.colors is not None for mesh in scene.meshes),
        "TEXTURES": packed.uv_sets > 0,
        "NORMAL_MAPS": materials.normal_maps,
        "EMISSION_TEXTURES": any(isinstance(user.emission, Texture) for user in packed.shapes.users),
        "OPACITY": "opaque" in packed.buffers,
        "NEXT_HIT": "opaque" in packed.buffers,
        "SKY": packed.sky.kernel is not None,
        "LIGHTS": emitters.count > 0,
        "LIGHT_TREE": emitters.choice.tree,
        "EMITTERS": any(t in SURFACES for t in emitters.types),
        "DOUBLE_SIDED_LIGHTS": any(user.double_sided and any(user.radiance) for user in packed.shapes.users),
        "LOCAL": local,
        "NO_SHADOWS": local and not scene.render.shadows,
        "RASTER": scene.render.integrator == "raster",
        "PIXEL_MIDDLE": scene.render.integrator == "depth",
        "CAMERA_CULLING": (
            scene.render.back_face_culling == "camera" and any(user.is_culled for user in packed.shapes.users)
        ),
        "CAMERA_HIDDEN": any(not user.camera_visible for user in packed.shapes.users),
        "CLAMP": bool(biased_by(scene.render)),
        "LOOP_LIMIT": loop_limit,
        "GUIDING": "quarters" in packed.buffers,
    }
    has["CLEAR_GLASS"] = scene.render.transparent_glass and {"ALPHA", "TRANSMISSION"} <= features
    has["HORIZON"] = has["SMOOTH_NORMALS"] or has["NORMAL_MAPS"]
    # Shading hits by material, and misses apart, pays where microfacet materials are evaluated (measurements/gpu.md).
    has["SORT_HITS"] = choices.paths == "queues" and any(feature.startswith("SMITH_") for feature in features)
    return features | {name for name, present in has.items() if present}


def launch_typedef(camera: Camera, features: Collection[str]) -> str:
    """Return the line of the preamble that declares the launch record."""
    return typedefs({"Launch": launch_of(camera, launch_type(features))})


def preamble_of(packed: PackedScene, choices: ResolvedChoices, features: set[str], part_bytes: int | None) -> str:
    """Return the definitions that precede all kernel files. part_bytes: see CompiledScene."""
    emitters, materials = packed.emitters, packed.materials
    # Only programs that use lengths in scene units depend on the unit: all others are shared between units.
    lengths = choices.offset != "bound" or packed.scene.render.integrator == "depth"
    unit = {"SCENE_UNIT": packed.frame.unit} if lengths else {}
    surfaces = [t for t in emitters.types if t in SURFACES]
    rasterised = [typedefs({"Outline": OUTLINE}), defines({"FILTER_REACH": filter_reach(packed.scene.render.filter)})]
    others = ["int bare"] if "CATCHER" in features else []
    others += [f"float{choices.lanes if choices.lanes > 1 else ''} time"] if "TIME" in features else []
    catching = [type_list("CATCHER_TYPES", _numbered(materials.with_value("catcher")))]
    return "\n".join(
        [
            defines({"LANES": choices.lanes, "TILE": TILE, **tree_defines(packed.tree), **unit}),
            defines({"CHOICES": emitters.choice.choices, "INFINITE_LIGHTS": emitters.choice.infinite}),
            defines({**{feature: 1 for feature in sorted(features)}, **camera_defines(packed.scene.camera)}),
            typedefs({"Counts": COUNTS, "Pixel": pixel_record(features, len(packed.groups)), "Guide": GUIDE}),
            launch_typedef(packed.scene.camera, features),
            scene_struct(packed.buffers, part_bytes, others),
            type_list("MATERIAL_TYPES", _numbered(materials.used)),
            type_list("OPACITY_TYPES", _numbered(materials.with_value("opacity"))),
            type_list("NORMAL_MAPPED_TYPES", _numbered(materials.mapped("normal_map"))),
            type_list("COAT_MAPPED_TYPES", _numbered(materials.mapped("clearcoat_normal_map"))),
            type_list("COATED_TYPES", _numbered(materials.featured("COAT_NORMALS"))),
            type_list("SPREADING_TYPES", _numbered(materials.featured("TRANSMISSION_LOBES"))),
            type_list("ABSORBING_TYPES", _numbered(materials.featured("ATTENUATION"))),
            defines({"UV_SETS": packed.uv_sets}),
            *(f"#define READ_{name} {'TEXTURED' if reads else 'CONSTANT'}" for name, reads in materials.reads.items()),
            type_list("LIGHT_TYPES", [(t, TYPES.index(t)) for t in emitters.types]),
            type_list("EMITTER_TYPES", [(t, TYPES.index(t)) for t in surfaces]),
            *([defines({"GROUPS": len(packed.groups)})] if packed.groups else []),
            *(rasterised if "RASTER" in features else []),
            *(catching if "CATCHER" in features else []),
        ]
    )


def files_for(packed: PackedScene, choices: Choices, features: set[str]) -> dict[str, list[str]]:
    """Return the files that each `#include NAME` in the kernels is replaced by."""
    scene, emitters, sky = packed.scene, packed.emitters, packed.sky
    integrator, lights = scene.render.integrator, [f"light/{t}.cl" for t in emitters.types if t != "sky"]
    parts = sorted({part for kind in packed.materials.used for part in kind.parts})
    return {
        **tree_files(
            packed.tree.name,
            choices.tests,
            bool(scene.meshes),
            bool(scene.spheres),
            packed.shapes.lone,
            bool(scene.instances),
            "MOTION" in features,
        ),
        **{f"{part}_FILE": [f"bsdf/{part.lower()}.cl"] if part in features else [] for part in parts},
        "PLACEMENT_FILE": ["surface/instance_transform.cl"] if scene.instances else [],
        "OFFSET": [OFFSETS[choices.offset]],
        "MATERIAL_FILES": [f"bsdf/{kind.kernel}.cl" for kind in packed.materials.used],
        "LIGHT_CHOICE": emitters.choice.files,
        "MIS_WEIGHTS": ["integrator/mis.cl"],
        "LIGHT_GROUPS_FILE": ["light/groups.cl"] if packed.groups else [],
        "LIGHT_TREE_FILE": ["light/tree.cl"] if emitters.choice.tree else [],
        "LIGHT_FILES": lights + ([sky.kernel] if sky.kernel else []),
        "VISIBILITY": ["visibility/layers.cl" if "OPACITY" in features else "visibility/opaque.cl"],
        "OPACITY_FILE": ["surface/opacity.cl"] if "OPACITY" in features else [],
        "CATCHER_FILE": ["surface/catcher.cl"] if "CATCHER" in features else [],
        "TEXTURE_FILES": ["surface/texture.cl"] if packed.uv_sets else [],
        "NORMAL_MAPS_FILE": ["surface/normal_maps.cl"] if packed.materials.normal_maps else [],
        "HORIZON_FILE": ["surface/horizon.cl"] if "HORIZON" in features else [],
        "SAMPLER": [f"sampler/{scene.render.sampler}.cl"],
        "CAMERA": [camera_file(scene.camera, integrator)],
        "SHUTTER_FILE": ["integrator/shutter.cl"] if "TIME" in features else [],
        "CAMERA_MOTION_FILE": ["camera/moving.cl"] if "CAMERA_MOTION" in features else [],
        "GUIDING_FILE": ["guiding/mixture.cl"] if "GUIDING" in features else [],
        "FILTER": ["film/box_filter.cl" if scene.render.filter == "box" else "film/table_filter.cl"],
        "INTEGRATOR": [_integrator_file(scene)],
        "HIT_ORDER": [f"integrator/queue_{'sorted' if 'SORT_HITS' in features else 'unsorted'}.cl"],
        "PICTURE": [f"integrator/first_surface_{integrator}.cl"],
    }


def _integrator_file(scene: Scene) -> str:
    if isinstance(scene.camera, RayList) and scene.camera.on_surfaces:
        return f"integrator/{scene.camera.measures}.cl"
    return INTEGRATORS.get(scene.render.integrator, "integrator/first_surface.cl")


def _numbered(kinds: Iterable[type[Material]]) -> list[tuple[str, int]]:
    return [(kind.kernel, MATERIALS.index(kind)) for kind in kinds]
