"""Scene packing: from a scene to device buffers. All packing goes through this module."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...accel.build import FEW_SPHERES, fitting_layout
from ...accel.layouts import NO_RAYS, Layout, leaf_spheres
from ...accel.traversal_kernels import tree_buffers
from ...device.open import Device
from ...device.programs.preamble import Buffers
from ...scene.exposure import exposed
from ...scene.geometry.instancing import arranged
from ...scene.geometry.scaling import SceneFrame, frame_of, in_frame
from ...scene.materials.material_types import Material
from ...scene.model import Scene
from ...threads import beside
from .camera_kernel import camera_buffers
from .choices import Choices
from .film_record import film_features, film_groups
from .geometry.pack_geometry import TriangleCorners, normal_records, sphere_records, triangle_records
from .geometry.pack_instances import ObjectIds, PackedInstances
from .geometry.pack_opaque import opaque_records
from .geometry.vertex_attributes import pack_corners
from .guiding_field import UNTRAINED, check_guiding
from .lights.emitter_groups import pack_emitter_groups
from .lights.environment_map import EnvironmentMap
from .lights.pack_lights import PackedLights, pack_emitters
from .materials.pack_materials import MaterialTables, PackedMaterials, pack_materials
from .materials.pack_textures import PackedTextures
from .materials.vertex_alpha import with_vertex_alpha
from .pixel_filters import filter_quantiles
from .records import COUNTS
from .reuse_cache import ReuseCache


class Shapes:
    """The scene in its frame, starting with the meshes that only its instances show.

    triangles: of all meshes; spheres: (s, 4) float32, center and radius; lone: whether there are so few spheres that
    they are not in the BVH.
    """

    def __init__(self, scene: Scene) -> None:
        scene, *of_objects = arranged(with_vertex_alpha(exposed(scene)))
        self.frame = frame_of(scene)
        scene = in_frame(scene, self.frame)
        self.objects = ObjectIds([len(mesh.faces) for mesh in scene.meshes], len(scene.spheres), *of_objects)
        self.placements = PackedInstances(scene.instances, rest=bool(scene.meshes or scene.spheres))
        self.scene = replace(scene, meshes=self.placements.meshes + scene.meshes)
        self.triangles = TriangleCorners(self.scene.meshes)
        self.spheres = np.array([(*s.center, s.radius) for s in scene.spheres], np.float32).reshape(-1, 4)
        self.lone = 0 < len(self.spheres) <= FEW_SPHERES

    @cached_property
    def users(self) -> list[Material]:
        """Materials of meshes, spheres and instances."""
        return [
            *(mesh.material for mesh in self.scene.meshes),
            *(sphere.material for sphere in self.scene.spheres),
            *self.placements.materials,
        ]

    def _follows_rays(self, choices: Choices) -> bool:
        """Return whether rays are traced: `raster` traces only shadow rays and those of mirrors, glass and cut-outs."""
        render = self.scene.render
        return (
            render.integrator != "raster"
            or render.shadows
            or choices.first_hits
            or any(
                user.is_specular
                or "TRANSMISSION" in user.features()
                or "opacity" in user.surface_parameters(render.back_face_culling)
                for user in self.users
            )
        )

    def tree(self, choices: Choices, device: Device | None, carried: ReuseCache) -> Layout:
        """Return the BVH over everything but lone spheres; NO_RAYS if none is needed."""
        if not self._follows_rays(choices):
            return NO_RAYS
        in_tree, test = self.spheres[:0] if self.lone else self.spheres, choices.tests.triangle
        layout = choices.layout or fitting_layout(
            device, len(self.triangles), len(in_tree), test, bool(self.scene.instances), choices.tree
        )
        return carried.tree(
            device, layout, choices.builder, self.scene.meshes, self.triangles, in_tree, test, self.placements
        )

    def buffers(
        self, codes: NDArray[np.int32], emitters: PackedLights, normals: NDArray[Any], rays: bool
    ) -> dict[str, tuple[str, Any]]:
        """Return the buffers of the surfaces; codes: of the users' materials; rays: whether any are traced."""
        meshes, spheres = self.scene.meshes, self.spheres
        of_meshes, of_spheres, of_instances = np.split(codes, np.cumsum([len(meshes), len(spheres)]))
        buffers: dict[str, tuple[str, Any]] = {}
        if self.lone and rays:
            every = np.arange(len(spheres), dtype=np.int32)
            first = len(self.triangles) - self.placements.before
            buffers["leaf_spheres"] = ("LeafSphere", leaf_spheres(spheres, every, first))
        if len(self.triangles):
            buffers["triangles"] = ("Triangle", triangle_records(meshes, of_meshes, emitters.triangle))
        if any(mesh.normals is not None for mesh in meshes):
            buffers["normals"] = ("Normals", normals)
        if len(spheres):
            buffers["spheres"] = ("Sphere", sphere_records(spheres, of_spheres, emitters.sphere))
        if self.scene.instances:
            buffers["placements"] = ("Placement", self.placements.records(of_instances))
            buffers |= self.placements.motions()
        return buffers


@dataclass(frozen=True)
class PackedScene:
    """Packed scene, without its program. counts: a COUNTS record; uv_sets: number of UV sets that its textures use;
    film: what its film stores (see `film_features`); groups: the names of the light groups among that."""

    shapes: Shapes
    tree: Layout
    materials: PackedMaterials
    emitters: PackedLights
    sky: EnvironmentMap
    uv_sets: int
    buffers: Buffers
    counts: NDArray[Any]
    film: set[str]
    groups: tuple[str, ...]

    @property
    def scene(self) -> Scene:
        """The scene, see `Shapes`."""
        return self.shapes.scene

    @property
    def frame(self) -> SceneFrame:
        """The frame, see `Shapes`."""
        return self.shapes.frame


def pack_scene(scene: Scene, choices: Choices, device: Device | None, carried: ReuseCache) -> PackedScene:
    """Pack a valid scene; device: where large BVHs are built, if given; carried: cache from the previous scene."""
    shapes = Shapes(scene)
    packing = beside(lambda: carried.sky(scene.environment))  # takes as long as a BVH build; neither uses all cores
    try:
        tree = shapes.tree(choices, device, carried)
        normals = normal_records(shapes.scene.meshes)
    finally:  # else it could replace the next scene's environment
        sky = packing()
    textures, tables = PackedTextures(), MaterialTables()
    emitters = pack_emitters(shapes.scene, sky, textures, shapes.placements)
    materials = pack_materials(shapes.users, textures, tables, scene.render.back_face_culling)
    buffers = tree_buffers(tree) | shapes.buffers(materials.codes, emitters, normals, tree is not NO_RAYS)
    buffers |= pack_corners(shapes.scene.meshes, textures.uv_sets, materials.tangents)
    buffers |= materials.buffers | tables.buffers() | textures.buffers() | emitters.buffers | sky.buffers
    buffers |= camera_buffers(shapes.scene.camera)
    if scene.render.filter != "box":
        buffers["filter"] = ("Filter", filter_quantiles(scene.render.filter))
    counts = _counts(shapes, emitters)
    film, groups = film_features(scene, choices), film_groups(scene, choices)
    if materials.with_value("opacity") or "CATCHER" in film:
        lights = np.concatenate([emitters.triangle, emitters.sphere])
        buffers["opaque"] = ("Opaque", opaque_records(shapes.scene, shapes.users, shapes.placements, lights))
    if choices.guiding == "on":
        check_guiding(scene)
        buffers |= UNTRAINED if shapes.users else {}
    if groups:
        buffers |= pack_emitter_groups(shapes.scene, emitters, groups)
    return PackedScene(shapes, tree, materials, emitters, sky, textures.uv_sets, buffers, counts, film, groups)


def _counts(shapes: Shapes, emitters: PackedLights) -> NDArray[Any]:
    counts = np.zeros(1, COUNTS)
    counts["triangles"], counts["spheres"] = len(shapes.triangles), len(shapes.spheres)
    counts["lights"] = emitters.count
    for kind, count in emitters.counts.items():
        counts[f"{kind}_lights"] = count
    return counts
