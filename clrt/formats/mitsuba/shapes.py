"""Conversion of Mitsuba's shapes to meshes, spheres and instances."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...errors import SceneError
from ...scene.geometry.normals import smooth_normals
from ...scene.geometry.transform import transform_mesh, unit
from ...scene.materials.material import Material
from ...scene.materials.material_types import Diffuse
from ...scene.model import FloatArray, Instance, Mesh, Sphere
from ..models import read_model
from ..ply.mesh_attributes import Attributes, mesh_with_attributes
from ..referenced_files import check_file
from ..scene_parts.notes import Notes, UnsupportedError
from ..scene_parts.spheres import inside_out, sphere_at
from ..toml.instance_table import placed
from .bsdfs import absorbing
from .bumps import sizes_over
from .materials import MaterialReader, ShapeMaterial
from .primitives import cube, cylinder, disk, rectangle, sphere
from .serialized import read_serialized
from .textures import Attribute, TextureReader
from .values import Doubles
from .xml import Plugin

PRIMITIVES: dict[str, Callable[[], Mesh]] = {
    "rectangle": rectangle,
    "cube": cube,
    "disk": disk,
    "cylinder": cylinder,
    "sphere": sphere,
}
FILES = ("obj", "ply", "serialized")
#: Maximum number of spheres and disks that become triangles, of 2 MB each.
MOST_ROUND = 256
Part = Mesh | Sphere


class ShapeReader:
    """Reader for the shapes of one scene.

    stand_in: a material for shapes whose own is not supported; without one these are rejected. missing: the unsupported
    features of these, by the name of the mesh or sphere.
    """

    def __init__(
        self, textures: TextureReader, materials: MaterialReader, notes: Notes, stand_in: Material | None
    ) -> None:
        self._textures = textures
        self._materials = materials
        self._notes = notes
        self._stand_in = stand_in
        self._round = 0
        self.missing: dict[str, list[str]] = {}
        self._groups: dict[Plugin, list[Part]] = {}

    def parts(self, plugin: Plugin) -> Iterator[Part | Instance]:
        """Yield what a <shape> renders; nothing for a group, which its instances render."""
        if plugin.kind == "instance":
            yield from self._instances(plugin)
        elif plugin.kind != "shapegroup":
            yield from self._shape(plugin)

    def _shape(self, plugin: Plugin) -> Iterator[Part]:
        if plugin.kind not in (*PRIMITIVES, *FILES):
            known = ", ".join((*PRIMITIVES, *FILES, "shapegroup", "instance"))
            what = f'shape type "{plugin.kind}" is not supported'
            plugin.ignore()
            self._notes.instead(plugin, what, f"use {known}", "it is left out")
            return
        if _is_invisible(plugin):
            return
        to_world = plugin.transform("to_world")
        look = self._lit(plugin, self._look(plugin))
        flips = plugin.value("flip_normals", bool, False)
        mirrored = bool(np.linalg.det(to_world[:3, :3]) < 0)
        if plugin.kind == "sphere":
            to_world = to_world @ _ball(plugin)
            flips ^= mirrored
            inwards = flips and (any(look.material.radiance) or "TRANSMISSION" in look.material.features())
            if not (inwards or look.bump) and (ball := sphere_at(to_world, look.material, plugin.where)):
                yield ball
                return
        elif plugin.kind == "cylinder":
            to_world = to_world @ _between(plugin)
        if plugin.kind in PRIMITIVES:
            self._round += plugin.kind in ("sphere", "disk")
            if self._round > MOST_ROUND:
                raise SceneError(f"scene: more than {MOST_ROUND} spheres and disks are tessellated; write .ply files")
            pieces: list[tuple[Mesh, Attributes]] = [(PRIMITIVES[plugin.kind](), {})]
        else:
            pieces = list(_from_file(plugin, mirrored))
        for mesh, attributes in pieces:
            placed = transform_mesh(inside_out(mesh) if flips else mesh, to_world)
            yield _dressed(placed, self._bumped(placed, look, plugin), attributes, plugin)

    def _bumped(self, mesh: Mesh, look: ShapeMaterial, plugin: Plugin) -> ShapeMaterial:
        """Return the look with the normal map that its bump map is on this mesh."""
        if look.bump is None or mesh.uv is None:
            return look
        sizes = sizes_over(mesh, look.bump.heights)
        if not sizes.even and sizes.texels is None:
            self._notes.instead(
                look.bump.plugin,
                "is repeated on a shape in different sizes",
                "write a normalmap",
                "its size is the median over each shape",
                "bumpmap, uneven texture coordinates",
            )
        return look._replace(material=replace(look.material, normal_map=self._textures.bumped(look.bump, sizes)))

    def _look(self, plugin: Plugin) -> ShapeMaterial:
        """Return the material of the shape's BSDF and interior medium; or `stand_in` if it is not supported."""
        try:
            return self._own_look(plugin)
        except UnsupportedError as error:
            if self._stand_in is None:
                raise
            self.missing[plugin.where] = error.features
            plugin.ignore()
            return ShapeMaterial(self._stand_in)

    def _own_look(self, plugin: Plugin) -> ShapeMaterial:
        bsdfs = plugin.all("bsdf")
        grey = 0.0 if plugin.all("emitter") else 0.5  # Mitsuba's default for a shape without a BSDF
        look = self._materials.look(bsdfs[-1]) if bsdfs else ShapeMaterial(Diffuse(color=(grey, grey, grey)))
        plugin.all("medium")
        for name, medium in plugin.children:
            if medium.tag == "medium":
                look = look._replace(material=self._filled(look.material, medium, name))
        return look

    def _filled(self, material: Material, medium: Plugin, name: str) -> Material:
        """Return the material with a medium inside, which only glass may have, and only one that absorbs."""
        if name != "exterior" and (clear := absorbing(material, medium)):
            return clear
        what = f"is a {medium.kind} medium that scatters, or is not inside glass"
        medium.ignore()
        self._notes.instead(medium, what, "leave it out", "it is left out", f"{medium.kind} medium")
        return material

    def _lit(self, plugin: Plugin, look: ShapeMaterial) -> ShapeMaterial:
        """Return the look with the emission of the shape's area emitter."""
        for emitter in plugin.all("emitter"):
            emitter.used.add("sampling_weight")
            if emitter.kind != "area":
                what = f'emitter type "{emitter.kind}" of a shape is not supported'
                emitter.ignore()
                self._notes.instead(emitter, what, "use area", "it is left out")
                continue
            radiance = self._textures.color(emitter, "radiance", 1.0, emitted=True)
            if isinstance(radiance, Attribute):
                emitter.refuse("radiance is an attribute", "write a color or a bitmap", "radiance by an attribute")
            look = look._replace(material=replace(look.material, emission=radiance))
        return look

    def _instances(self, plugin: Plugin) -> Iterator[Instance | Sphere]:
        groups = plugin.all("shape")
        if len(groups) != 1 or groups[0].kind != "shapegroup":
            raise SceneError(f"{plugin.at}: does not refer to a shapegroup; write one <ref> to one")
        to_world = plugin.transform("to_world")
        if groups[0] not in self._groups:
            self._groups[groups[0]] = [part for shape in groups[0].all("shape") for part in self._shape(shape)]
        for part in self._groups[groups[0]]:
            if isinstance(part, Mesh):
                yield Instance(part, to_world, name=plugin.where)
                continue
            place = np.eye(4)
            place[:3, :3] *= part.radius
            place[:3, 3] = part.center
            moved = sphere_at(to_world @ place, part.material, plugin.where)
            if moved is None:
                plugin.refuse("stretches a sphere", "scale uniformly", "stretched sphere")
            yield moved


def _is_invisible(plugin: Plugin) -> bool:
    """Return whether light passes the shape, which only bounds a medium."""
    if [each.kind for each in plugin.all("bsdf")] != ["null"] or plugin.all("emitter") or plugin.all("medium"):
        return False
    plugin.ignore()
    return True


def _ball(plugin: Plugin) -> Doubles:
    """Return the matrix that gives a sphere of radius 1 the plugin's radius and center."""
    matrix = np.eye(4)
    matrix[:3, :3] *= plugin.value("radius", float, 1.0)
    matrix[:3, 3] = plugin.point("center") or (0.0, 0.0, 0.0)
    return matrix


def _between(plugin: Plugin) -> Doubles:
    """Return the matrix that takes a cylinder along z to the axis from p0 to p1; rotated about it by the basis of Duff
    et al. 2017 ("Building an Orthonormal Basis, Revisited")."""
    start, end = np.array(plugin.point("p0") or (0, 0, 0)), np.array(plugin.point("p1") or (0, 0, 1))
    radius, along = plugin.value("radius", float, 1.0), end - start
    x, y, z = unit(along).tolist()
    if not along.any():
        raise SceneError(f"{plugin.at}: p0 and p1 are the same point; move one")
    sign = 1.0 if z >= 0 else -1.0
    a = -1 / (sign + z)
    frame = np.eye(4)
    frame[:3] = np.column_stack(
        [(1 + sign * x * x * a, sign * x * y * a, -sign * x), (x * y * a, sign + y * y * a, -y), (x, y, z), start]
    )
    return frame @ np.diag([radius, radius, float(np.linalg.norm(along)), 1.0])


def _from_file(plugin: Plugin, mirrored: bool) -> Iterator[tuple[Mesh, Attributes]]:
    """Yield the meshes of a file, with smooth normals if it has none, as in Mitsuba.

    Those follow the winding in world space, which a mirroring transform inverts; a file's own normals keep their side.
    """
    path = Path(plugin.value("filename", str, ""))
    flat = plugin.value("face_normals", bool, False)
    downward = plugin.value("flip_tex_coords", bool, plugin.kind == "obj")
    if plugin.kind == "ply":
        check_file(path, "model")
    own = mesh_with_attributes(path) if plugin.kind == "ply" else None
    if plugin.kind == "serialized":
        mesh, flat_itself = read_serialized(path, plugin.value("shape_index", int, 0))
        own, flat = (mesh, {}), flat or flat_itself
    for mesh, attributes in [own] if own else [(mesh, {}) for mesh in _in_file(path)]:
        if mesh.uv is not None and downward != (own is None):
            mesh.uv = np.column_stack([mesh.uv[:, 0], 1 - mesh.uv[:, 1]])
        mesh.colors, mesh.tangents = None, None
        if flat:
            mesh.normals = None
        if mirrored and mesh.normals is None:
            mesh = inside_out(mesh)
        if not flat:
            mesh.normals = _whole_normals(mesh)
        yield mesh, attributes


def _in_file(path: Path) -> list[Mesh]:
    """Return a model's meshes in the file's coordinates."""
    return placed(read_model(path), np.eye(4), None, {}).meshes


def _whole_normals(mesh: Mesh) -> FloatArray:
    """Return the mesh's normals, smooth ones where it has none or zeros."""
    own = np.zeros_like(mesh.vertices) if mesh.normals is None else mesh.normals
    given = np.any(own, axis=1, keepdims=True)
    return own if given.all() else np.where(given, own, smooth_normals(mesh.vertices, mesh.faces))


def _dressed(mesh: Mesh, look: ShapeMaterial, attributes: Attributes, plugin: Plugin) -> Mesh:
    """Return the mesh with its material, and the colors of an attribute; a face attribute splits shared vertices."""
    mesh = replace(mesh, material=look.material, name=plugin.where)
    if mesh.uv is None and (look.material.textures() or look.material.bent_by or look.bump):
        raise SceneError(
            f"{plugin.at}: has a texture, or alpha_u and alpha_v, but no texture coordinates; add them to the file"
        )
    if look.attribute is None:
        return mesh
    name, low, high = look.attribute
    if name not in attributes:
        raise SceneError(
            f'{plugin.at}: has no attribute "{name}"; the file has {", ".join(sorted(attributes)) or "none"}'
        )
    colors = (np.array(low) + attributes[name] * np.subtract(high, low)).clip(0, 1).astype(np.float32)
    if name.startswith("vertex_"):
        return replace(mesh, colors=colors)
    corners = mesh.faces.ravel()
    normals, uv = (None if array is None else array[corners] for array in (mesh.normals, mesh.uv))
    return replace(
        mesh,
        vertices=mesh.vertices[corners],
        faces=np.arange(len(corners), dtype=np.int32).reshape(-1, 3),
        colors=np.repeat(colors, 3, axis=0),
        normals=normals,
        uv=uv,
    )
