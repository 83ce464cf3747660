"""Conversion of pbrt's shapes to meshes, spheres and instances."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import pi

import numpy as np

from ...errors import SceneError
from ...scene.geometry.transform import transform_mesh
from ...scene.materials.material_types import Dielectric, Diffuse, Material
from ...scene.materials.textures import Texture
from ...scene.model import Instance, Mesh, Sphere
from ..scene_parts.absorbing_glass import absorbing_glass
from ..scene_parts.notes import Notes
from ..scene_parts.spheres import inside_out, sphere_at
from .description import Description, Placed, ShapeUse
from .entities import Entity
from .materials import MaterialReader
from .meshes import facing, patches, ply, subdivision, triangles, with_coordinates
from .quadrics import cylinder, disk, is_whole_sphere, sphere
from .shutter import Shutter
from .textures import TextureReader
from .tokens import Doubles

QUADRICS: dict[str, Callable[[Entity], Mesh]] = {"sphere": sphere, "disk": disk, "cylinder": cylinder}
MESHES: dict[str, Callable[[Entity], Mesh]] = {
    "trianglemesh": triangles,
    "plymesh": ply,
    "bilinearmesh": patches,
    "loopsubdiv": subdivision,
}
#: Parameters of v3's shapes that affect how rays find them.
IGNORED = ("shadowalpha", "edgelength", "faceIndices")
#: Maximum number of spheres and disks that become triangles, of 2 MB each.
MOST_ROUND = 256
#: Maximum number of instances of shapes.
MOST_INSTANCES = 1 << 20
Part = Mesh | Sphere


class ShapeReader:
    """Reader for the shapes of one scene. mirror: (3, 3), from pbrt's world to clrt's; shutter: the camera's."""

    def __init__(
        self,
        description: Description,
        textures: TextureReader,
        materials: MaterialReader,
        notes: Notes,
        mirror: Doubles,
        shutter: Shutter,
    ) -> None:
        self._description = description
        self._textures = textures
        self._materials = materials
        self._notes = notes
        self._shutter = shutter
        self._mirror = np.eye(4)
        self._mirror[:3, :3] = mirror
        self._round = 0
        self._count = 0
        self._objects: dict[str, list[tuple[ShapeUse, Part]]] = {}

    def parts(self, use: ShapeUse) -> Iterator[Part | Instance]:
        """Yield what a shape renders."""
        shape = use.shape
        if shape.to_world_end is None:
            yield from self._placed(use, self._mirror)
            return
        start, end = self._shutter.poses(shape.to_world, shape.to_world_end)
        moved = use._replace(shape=replace(shape, to_world=start, to_world_end=end))
        for part in self._placed(moved, self._mirror):
            yield part if end is None else self._moving(part, start, end)

    def _moving(self, part: Part, start: Doubles, end: Doubles) -> Instance:
        """Return a mesh in the world, at the start, that moves with the transformation of its shape."""
        assert isinstance(part, Mesh)
        try:
            own = np.asarray(np.linalg.inv(self._mirror @ start), np.float64)
        except np.linalg.LinAlgError:
            raise SceneError(f"{part.name}: its transformation is singular and it moves; write another") from None
        return Instance(part, name=part.name, to_world_end=self._mirror @ end @ own, pivot=own)

    def object_parts(self, name: str) -> None:
        """Read the shapes of an object once, before its instances."""
        uses = self._description.objects[name]
        for use in uses:
            if use.shape.to_world_end is not None:
                what, stand_in = "motion inside an object is not supported", "it is left out"
                self._notes.instead(use.shape, what, "move the instance instead", stand_in)
                use.shape.to_world_end = None
        self._objects[name] = [(use, part) for use in uses for part in self._placed(use, np.eye(4))]

    def instances(self, placed: Placed) -> Iterator[Instance | Part]:
        """Yield what an instance renders. Raises SceneError for an undefined object."""
        if placed.name not in self._description.objects:
            raise SceneError(f'{placed.place}: ObjectInstance "{placed.name}": the object is not defined; define it')
        start, end = self._shutter.poses(placed.to_world, placed.to_world_end)
        to_world, last = self._mirror @ start, None if end is None else self._mirror @ end
        for use, part in self._objects.get(placed.name, []):
            self._count += 1
            if self._count > MOST_INSTANCES:
                raise SceneError(f"{placed.place}: the scene has more than {MOST_INSTANCES} instances; render fewer")
            if isinstance(part, Mesh):
                yield Instance(part, to_world, name=placed.name, to_world_end=last)
                continue
            if last is not None:
                mesh = self._tessellated(use, part.material)
                yield Instance(mesh, to_world, name=placed.name, to_world_end=last)
                continue
            place = np.eye(4)
            place[:3, :3] *= part.radius
            place[:3, 3] = part.center
            ball = sphere_at(to_world @ place, part.material, placed.name)
            if ball is not None:
                yield ball
            else:
                yield transform_mesh(self._tessellated(use, part.material), to_world)

    def _placed(self, use: ShapeUse, mirror: Doubles) -> Iterator[Part]:
        entity = use.shape
        entity.ignore(IGNORED)
        if entity.kind not in (*QUADRICS, *MESHES):
            known = ", ".join((*QUADRICS, *MESHES))
            entity.ignore()
            what = f'shape "{entity.kind}" is not supported'
            self._notes.instead(entity, what, f"use {known}", "it is left out")
            return
        material = self._material(use)
        if material is None:
            entity.ignore()
            return
        to_world = entity.to_world
        flips = use.reversed ^ (entity.kind in QUADRICS and bool(np.linalg.det(to_world[:3, :3]) < 0))
        if entity.kind == "sphere" and is_whole_sphere(entity) and entity.to_world_end is None:
            inwards = flips and (use.area is not None or "TRANSMISSION" in material.features())
            radius = abs(entity.number("radius", 1.0))
            place = mirror @ to_world @ np.diag([radius, radius, radius, 1])
            if not inwards and (ball := sphere_at(place, material, entity.where)):
                area = 4 * pi * ball.radius**2
                yield replace(ball, material=self._lit(use, material, area))
                return
        mesh = self._tessellated(use, material)
        mesh = transform_mesh(mesh, mirror)
        yield replace(mesh, material=self._lit(use, material, _area(mesh)))

    def _tessellated(self, use: ShapeUse, material: Material) -> Mesh:
        """Return the mesh of a shape in pbrt's world."""
        entity = use.shape
        if entity.kind in QUADRICS:
            self._round += entity.kind != "cylinder"
            if self._round > MOST_ROUND:
                raise SceneError(f"scene: more than {MOST_ROUND} spheres and disks are tessellated; write .ply files")
            mesh = QUADRICS[entity.kind](entity)
            flips = use.reversed ^ bool(np.linalg.det(entity.to_world[:3, :3]) < 0)
        else:
            mesh, flips = facing(MESHES[entity.kind](entity)), use.reversed
        if material.textures():
            mesh = with_coordinates(mesh)
        mesh = replace(inside_out(mesh) if flips else mesh, material=material, name=entity.where)
        return transform_mesh(mesh, entity.to_world)

    def _material(self, use: ShapeUse) -> Material | None:
        """Return the material of a shape with its medium and opacity; None if it has no surface."""
        material = self._own_material(use)
        for name in {use.outside, use.inside} - {""}:
            material = self._filled(material, name, use)
        if material is None:
            if use.area is None:
                return None
            self._notes.instead(
                use.shape,
                "emits light but has no surface",
                "use diffuse",
                "a black surface is used",
                "emissive interface",
            )
            material = Diffuse(color=(0.0, 0.0, 0.0))
        alpha = self._textures.number(use.shape, "alpha", 1.0)
        if isinstance(alpha, Texture):
            return replace(material, opacity=alpha)
        if use.area is not None and alpha == 0:
            what, remedy = "emits light but has alpha 0", "leave alpha out"
            self._notes.instead(use.shape, what, remedy, "1 is used", "emissive shape of alpha 0")
        elif alpha < 1:
            return replace(material, opacity=max(alpha, 0.0))
        return material

    def _own_material(self, use: ShapeUse) -> Material | None:
        given = use.material
        if isinstance(given, str) and self._description.old and given not in self._description.materials:
            self._notes.differ(use.shape, f'the material "{given}" is not defined; as in pbrt-v3 it is ignored')
            return Diffuse(color=(0.5, 0.5, 0.5))
        entity = self._description.material(given, use.shape) if isinstance(given, str) else given
        return None if entity is None else self._materials.material(entity)

    def _filled(self, material: Material | None, name: str, use: ShapeUse) -> Material | None:
        """Return the material with a medium inside, which only glass may have, and only one that absorbs."""
        medium = self._description.media.get(name)
        if medium is None:
            raise SceneError(f'{use.shape.at}: the medium "{name}" is not defined; define it')
        if name == use.inside and isinstance(material, Dielectric) and not material.thin:
            if (clear := self._absorbing(material, medium)) is not None:
                return clear
        what = "scatters, or is not inside glass"
        medium.ignore()
        self._notes.instead(medium, what, "leave it out", "it is left out", f"{medium.kind} medium")
        return material

    def _absorbing(self, material: Dielectric, medium: Entity) -> Material | None:
        """Return glass with a medium that absorbs and does not scatter; None for other media."""
        if medium.kind != "homogeneous" or not {"sigma_a", "sigma_s"} <= medium.parameters.keys():
            return None
        spectra = self._textures.spectra
        if any(spectra.unbounded(medium, "sigma_s", 1.0)) or any(spectra.unbounded(medium, "Le", 0.0)):
            return None
        medium.ignore(("g", "type", "Lescale"))
        rates = [rate * medium.number("scale", 1.0) for rate in spectra.unbounded(medium, "sigma_a", 1.0)]
        return absorbing_glass(material, rates, medium.at)

    def _lit(self, use: ShapeUse, material: Material, area: float) -> Material:
        """Return the material with the emission of a shape of this area."""
        entity = use.area
        if entity is None:
            return material
        if entity.kind not in ("diffuse", "area"):
            entity.ignore()
            what = f'area light "{entity.kind}" is not supported'
            self._notes.instead(entity, what, "use diffuse", "it is left out")
            return material
        entity.ignore(("samples", "nsamples"))
        both = entity.boolean("twosided", False)
        radiance = np.array(self._textures.spectra.emission(entity, "L"))
        if "filename" in entity.parameters:
            entity.ignore(["filename"])
            what = "its emission is an image"
            self._notes.instead(entity, what, "write L", "white is used", "emission by an image")
        power = entity.number("power", -1.0)
        if power > 0 and area > 0:
            radiance *= power / (area * pi * (2 if both else 1))
        red, green, blue = radiance.tolist()
        return replace(material, emission=(red, green, blue), double_sided=both)


def _area(mesh: Mesh) -> float:
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float(np.linalg.norm(cross, axis=1).sum() / 2)
