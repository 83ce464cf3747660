"""Writing of a scene as an editable scene file that renders the same image, with the same names.

Parts read from files are referred to if they are unchanged (scene.source). What a scene file cannot hold, such as a
mesh or an environment map made in Python, or an image inside a model with a changed material, is written next to it.
"""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...scene.animation import Animation, SceneAnimation
from ...scene.cameras import CameraEnd
from ...scene.editing import free_name, materials_of
from ...scene.fields.field_types import plain_value
from ...scene.geometry.instancing import meshes_by_id
from ...scene.light_images import LightImage
from ...scene.materials.material import Material
from ...scene.materials.material_types import Diffuse
from ...scene.materials.textures import Picture, Texture
from ...scene.model import Backdrop, Display, Environment, Instance, Mesh, Origin, Scene, Source
from ...scene.provenance import material_of, shape_of
from ...scene.sky.sky import Sky, SkyEnvironment
from ..gltf.glb_writer import mesh_glb
from .built_in_environments import built_in_name
from .texture_table import LightImageTable, TextureTable
from .values import is_plain, toml_key, toml_value

log = logging.getLogger(__name__)
#: Fields that are written even at their default, since users change them first.
TELLING = {
    "position",
    "look_at",
    "fov_degrees",
    "size",
    "spp",
    "max_depth",
    "color",
    "metallic",
    "roughness",
    "center",
    "radius",
}
#: Keys of tables that are not copied, since they are written from the scene's current state.
ASSIGNED = ("material", "materials", "lights")
#: Name in the scene file of the one material of a file without material names.
UNNAMED = "model"


@dataclass
class SceneFiles:
    """A scene file's text, and the files next to it, by name: models, texels (h, w, 4) uint8 for .png and pixels
    (h, w, 3) float32 for .exr."""

    text: str = ""
    models: dict[str, bytes] = field(default_factory=dict)
    texels: dict[str, NDArray[np.uint8]] = field(default_factory=dict)
    pixels: dict[str, NDArray[np.float32]] = field(default_factory=dict)


def scene_files(scene: Scene, path: Path) -> SceneFiles:
    """Return the scene as a scene file to be written to `path`."""
    return _Writer(scene, path).files


def started(scene: Scene) -> Scene:
    """Return a bare model's scene with those of its materials named that a scene file can hold, for users to change.

    Materials with textures inside the model, and names that several materials share, remain the model's own.
    """
    named: dict[str, list[Material]] = {}
    for origin in scene.source.meshes if scene.source else ():
        for part in origin.parts:
            mesh = part.mesh if isinstance(part, Instance) else part
            named.setdefault(mesh.material_name, []).append(mesh.material)
    clear = {
        name or UNNAMED: same[0]
        for name, same in named.items()
        if len(set(same)) == 1 and _is_plain(same[0]) and not (name == UNNAMED and "" in named)
    }
    scene.materials = clear
    return scene


class _Writer:
    """Writer of one scene. Files next to the scene file are collected in `files`."""

    def __init__(self, scene: Scene, path: Path) -> None:
        self._scene, self._source = scene, scene.source or Source()
        self._folder, self._stem = Path(os.path.realpath(path)).parent, path.stem
        self.files = SceneFiles()
        #: Names of files in the same folder that the scene was read from, and may still refer to.
        self._read = {path.name for path in self._source.paths if path.parent == self._folder}
        self._names = {id(material): name for name, material in materials_of(scene).items()}
        self._materials = dict(scene.materials)
        self._named = set(map(id, scene.materials.values()))
        self._numbers: dict[str, int] = {}
        self._by_value = {material: name for name, material in reversed(self._materials.items())}
        self._pictures: dict[int, str] = {}
        self._pixels: dict[int, str] = {}
        self._left: dict[tuple[object, ...], list[Mesh | Instance]] = {}
        self._give_back([*scene.meshes, *scene.instances])
        #: Lights that move with models, by the table of these, and those whose table was written.
        self._lights, self._moving = dict(self._moving_lights()), set[int]()
        #: Whether a table of a moving model was written.
        self._moves = False
        self._tables: set[str] = set()
        objects = [*self._read_meshes(), *self._own_objects(), *self._spheres()]
        name = scene.name.encode("unicode_escape").decode()
        head = [
            f"# {name} as clrt renders it; edit it as you like (docs/scene-format.md).",
            *self._section("[camera]", scene.camera),
            *self._cameras(),
            *self._animation(),
            *self._section("[render]", scene.render),
        ]
        sky = _sky_of(scene)
        head += self._section("[sky]", sky) if sky else self._environment(scene.environment)
        head += self._backdrop(scene.backdrop) if scene.backdrop else ()
        head += self._section("[ground]", scene.ground) if scene.ground else ()
        head += self._section("[display]", scene.display) if scene.display != Display() else ()
        for light in scene.lights[len(sky.lights()) if sky else 0 :]:
            if id(light) not in self._moving:
                head += self._section("[[light]]", light, light.kernel)
        for name, material in self._materials.items():
            head += self._section(f"[materials.{toml_key(name)}]", material, material.kernel)
        self.files.text = "\n".join([*head, *objects]) + "\n"

    def _cameras(self) -> Iterator[str]:
        """Yield the named cameras, except those that a model file defines."""
        cameras = self._scene.cameras
        theirs = [name for name, camera in cameras.items() if self._source.cameras.get(name) == camera]
        yield from (
            f"# or, instead of the lines above: name = {toml_value(name)}"
            for name in theirs
            if cameras[name] != self._scene.camera
        )
        for name in [name for name in cameras if name not in theirs]:
            yield from self._section(f"[cameras.{toml_key(name)}]", cameras[name])

    def _animation(self) -> Iterator[str]:
        animation = self._scene.animation
        if isinstance(animation, SceneAnimation):  # the models' is in their tables
            if animation.camera is None and not self._moves:
                return
            animation = replace(animation.camera or Animation(), fps=animation.fps)
        if isinstance(animation, Animation):
            yield from self._section("[animation]", replace(animation, keyframes=()))
            for keyframe in animation.keyframes:
                yield from self._section("[[keyframe]]", keyframe)

    def _environment(self, sky: Environment) -> Iterator[str]:
        yield from self._colored("[environment]", sky)
        if sky.image is not None:
            name = built_in_name(sky.image) if self._source.file_of(sky.image) is None else None
            yield f"sky = {toml_value(name)}" if name else self._image(sky.image, "sky")

    def _backdrop(self, backdrop: Backdrop) -> Iterator[str]:
        yield from self._colored("[backdrop]", backdrop)
        if backdrop.image is not None:
            yield self._image(backdrop.image, "backdrop")

    def _colored(self, title: str, record: Environment | Backdrop) -> Iterator[str]:
        """Yield a table without its color if it has an image."""
        for line in self._section(title, record):
            if record.image is None or not line.startswith("color = "):
                yield line

    def _image(self, image: NDArray[np.float32], name: str) -> str:
        """Return the key of an image, which is written next to the scene file if it was not read from one."""
        file = self._source.file_of(image)
        if file is not None:
            return f"image = {toml_value(self._relative(file))}"
        beside = self._beside(name, ".exr")
        self.files.pixels[beside] = image
        return f"image = {toml_value(beside)}"

    def _read_meshes(self) -> Iterator[str]:
        """Yield the tables that were read, if they are unchanged, and their instances."""
        shown = {shape_of(mesh): mesh for mesh in meshes_by_id(self._scene.instances).values()}
        for origin in self._source.meshes:
            if origin.table.get("visible") is False:
                parts = [shown.get(shape_of(part), part) for part in origin.parts]
            else:
                parts = self._claimed(origin)
            assigned = self._assigned(origin, parts) if parts else None
            if assigned is not None:
                self._tables.add(str(origin.table.get("name")))
                self._moves |= _moves(origin.table)
                lights = self._lights.get(id(origin.table), set())
                self._moving |= lights
                lit = ["lights = true"] if lights else []
                yield from ("", "[[mesh]]", *self._keys(origin.table), *lit, *assigned)
            elif parts:
                self._give_back(parts)
        for origin in self._source.instances:
            parts = self._claimed(origin) if origin.table["mesh"] in self._tables else []
            if len({id(part.material) for part in parts}) == 1:
                yield from ("", "[[instance]]", *self._keys(origin.table))
                if parts[0].material is not None and parts[0].material is not origin.own[0]:
                    yield f"material = {toml_value(self._name_of(parts[0].material))}"
            else:
                self._give_back(parts)

    def _moving_lights(self) -> Iterator[tuple[int, set[int]]]:
        """Yield the tables of moving models whose lights are unchanged, and these, by their ids."""
        animation, lights = self._scene.animation, {id(light) for light in self._scene.lights}
        models = animation.models if isinstance(animation, SceneAnimation) else ()
        moving = [origin.table for origin in self._source.meshes if _moves(origin.table)]
        for table, model in zip(moving, models):
            theirs = {id(light) for light in model.base.lights}
            if theirs <= lights:
                yield id(table), theirs

    def _claimed(self, origin: Origin) -> list[Mesh | Instance]:
        """Return the scene's objects that are the origin's parts, maybe in other materials; empty if any is missing."""
        found = [left.pop(0) for part in origin.parts if (left := self._left.get(shape_of(part)))]
        if len(found) == len(origin.parts):
            return found
        self._give_back(found)
        return []

    def _give_back(self, parts: Iterable[Mesh | Instance]) -> None:
        for part in parts:
            self._left.setdefault(shape_of(part), []).append(part)

    def _assigned(self, origin: Origin, parts: Sequence[Mesh | Instance]) -> list[str] | None:
        """Return the material keys of a table; None if they cannot tell its parts apart."""
        groups: dict[str, list[tuple[Material, Material | None]]] = {}
        for part, own in zip(parts, origin.own):
            mesh = part.mesh if isinstance(part, Instance) else part
            groups.setdefault(mesh.material_name, []).append((material_of(part), own))
        if any(len({material for material, _ in pairs}) > 1 for pairs in groups.values()):
            return None
        changed = {
            name: self._name_of(named[0])
            for name, pairs in groups.items()
            if (named := [each for each, own in pairs if each != own or self._is_named(each)])
        }
        if "file" not in origin.table or list(changed) == list(groups) == [""]:
            return [f"material = {toml_value(name)}" for name in changed.values()]
        kept = [name for name in groups if name not in changed]
        return [
            *(["", "[mesh.materials]  # the file's name = the one above"] if changed else []),
            *(f"{toml_key(name)} = {toml_value(other)}" for name, other in changed.items()),
            *(
                [f"# The file's materials: {', '.join(map(toml_value, theirs))}; [mesh.materials] can replace them"]
                if (theirs := [name for name in kept if name])
                else []
            ),
        ]

    def _own_objects(self) -> Iterator[str]:
        """Yield the objects without a table: each mesh in its own file, hidden if only its instances are rendered."""
        left = [part for parts in self._left.values() for part in parts]
        meshes = [part for part in left if isinstance(part, Mesh)]
        instances = [part for part in left if isinstance(part, Instance)]
        visible = {id(mesh) for mesh in meshes}
        names = {}
        for mesh in {id(mesh): mesh for mesh in (*meshes, *meshes_by_id(instances).values())}.values():
            names[id(mesh)] = name = free_name(mesh.name, self._tables)
            self._tables.add(name)
            file = self._beside(name, ".glb")
            self.files.models[file] = mesh_glb(mesh)
            yield from (
                "",
                "[[mesh]]",
                f"name = {toml_value(name)}",
                f"file = {toml_value(file)}",
                f"material = {toml_value(self._name_of(mesh.material))}",
            )
            yield from () if id(mesh) in visible else ("visible = false",)
        for each in instances:
            matrix = tuple(map(tuple, [*each.to_world.tolist(), (0.0, 0.0, 0.0, 1.0)]))
            yield from (
                "",
                "[[instance]]",
                f"mesh = {toml_value(names[id(each.mesh)])}",
                f"name = {toml_value(each.name)}",
                f"matrix = {toml_value(matrix)}",
            )
            if each.to_world_end is not None:
                end = tuple(map(tuple, [*each.to_world_end.tolist(), (0.0, 0.0, 0.0, 1.0)]))
                yield f"motion = {toml_value({'matrix': end, **_pivot_key(each)})}"
            yield from () if each.material is None else (f"material = {toml_value(self._name_of(each.material))}",)

    def _spheres(self) -> Iterator[str]:
        for sphere in self._scene.spheres:
            yield from self._section("[[sphere]]", sphere)
            if sphere.material != Diffuse() or self._is_named(sphere.material):
                yield f"material = {toml_value(self._name_of(sphere.material))}"

    def _is_named(self, material: Material) -> bool:
        return id(material) in self._named

    def _name_of(self, material: Material) -> str:
        """Return the name under which the material will be written."""
        name = self._names.get(id(material), "material")
        if self._materials.get(name) != material:
            name = self._by_value.get(material) or free_name(name or UNNAMED, self._materials, self._numbers)
        self._materials[name] = material
        self._by_value.setdefault(material, name)
        return name

    def _keys(self, table: Mapping[str, Any]) -> Iterator[str]:
        """Yield the keys of a table as they were read, without its materials and lights."""
        for name, value in table.items():
            if name not in ASSIGNED:
                yield f"{toml_key(name)} = {toml_value(self._relative(value) if isinstance(value, Path) else value)}"

    def _section(self, title: str, record: Any, kind: str | None = None) -> Iterator[str]:
        """Yield a table of a dataclass's fields, without most of those at their defaults."""
        yield from ("", title)
        if kind is not None:
            yield f"type = {toml_value(kind)}"
        for each in fields(record):
            value = plain_value(getattr(record, each.name))
            if isinstance(value, Texture):
                yield f"{each.name} = {self._texture(value)}"
            elif isinstance(value, LightImage):
                yield f"{each.name} = {self._light_image(value)}"
            elif isinstance(value, CameraEnd):
                yield f"{each.name} = {toml_value(value.changes)}"
            elif is_plain(value) and (each.name in TELLING or value != each.default):
                yield f"{each.name} = {toml_value(value)}"

    def _texture(self, texture: Texture) -> str:
        """Return an inline table."""
        return toml_value({"image": self._picture(texture.picture), **_given(TextureTable, texture)})

    def _light_image(self, image: LightImage) -> str:
        """Return an inline table, or the file's name alone."""
        values = _given(LightImageTable, image)
        name = self._pixel_file(image)
        return toml_value({"image": name, **values} if values else name)

    def _picture(self, picture: Picture) -> str:
        """Return the file of a texture's image, which is written next to the scene file if there is none."""
        if (file := self._source.file_of(picture)) is not None:
            return self._relative(file)
        if id(picture) not in self._pictures:
            self._pictures[id(picture)] = name = self._beside(picture.name, ".png")
            self.files.texels[name] = picture.texels
        return self._pictures[id(picture)]

    def _pixel_file(self, image: LightImage) -> str:
        """Return the file of a light's image, which is written next to the scene file if there is none."""
        if (file := self._source.file_of(image.pixels)) is not None:
            return self._relative(file)
        if id(image.pixels) not in self._pixels:
            self._pixels[id(image.pixels)] = name = self._beside(image.name, ".exr")
            self.files.pixels[name] = image.pixels
        return self._pixels[id(image.pixels)]

    def _beside(self, name: str, suffix: str) -> str:
        """Return an unused file name for something of this name, next to the scene file."""
        clean = re.sub(r"[^\w-]+", "_", name)[:64].strip("_") or "part"
        taken = {*self._read, *self.files.models, *self.files.texels, *self.files.pixels}
        number, file = 2, f"{self._stem}.{clean}{suffix}"
        while file in taken:
            number, file = number + 1, f"{self._stem}.{clean}_{number}{suffix}"
        return file

    def _relative(self, file: Path) -> str:
        """Return the path of another file relative to the scene file's folder, or absolute if there is no such path."""
        try:
            return Path(os.path.relpath(file, self._folder)).as_posix()
        except ValueError:  # on another drive
            return file.as_posix()


def _sky_of(scene: Scene) -> Sky | None:
    """Return the analytic sky that the environment and the first light are, unless these were changed."""
    found = scene.environment
    if not isinstance(found, SkyEnvironment):
        return None
    made, suns = found.sky.environment(), found.sky.lights()
    same = all(np.array_equal(getattr(found, each.name), getattr(made, each.name)) for each in fields(Environment))
    return found.sky if same and scene.lights[: len(suns)] == suns else None


def _given(kind: type, record: Texture | LightImage) -> dict[str, Any]:
    """Return the values of a table of this type, without its image and those at their defaults."""
    return {
        each.name: plain_value(getattr(record, each.name))
        for each in fields(kind)
        if each.name != "image" and getattr(record, each.name) != each.default
    }


def _pivot_key(instance: Instance) -> dict[str, tuple[float, ...]]:
    """Return the key of a moving instance's pivot, unless that is the mesh's origin."""
    if instance.pivot is None:
        return {}
    axes = instance.pivot[:, :3]
    if not np.allclose(axes, np.eye(3)):
        log.warning(
            "%s: turns about the axes of its mesh in the saved scene, not those of its pivot; between the start and "
            "the end of the exposure it may be elsewhere",
            instance.title,
        )
    point = np.linalg.solve(axes, -instance.pivot[:, 3])
    return {"pivot": tuple(point.tolist())} if point.any() else {}


def _moves(table: Mapping[str, Any]) -> bool:
    """Return whether the model of a [[mesh]] table moves."""
    return "animation" in table and "time" not in table


def _is_plain(material: Material) -> bool:
    """Return whether a scene file can describe the material without other files."""
    return not material.textures()
