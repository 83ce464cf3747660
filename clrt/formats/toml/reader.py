"""Conversion of a TOML document to a scene, collecting all problems in it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from ...errors import ObjectError, SceneError
from ...scene.animation import Animation, Keyframe, SceneAnimation
from ...scene.cameras import CameraEnd
from ...scene.default_sky import SUN
from ...scene.fields.field_types import field_problems, show, unknown, usable
from ...scene.fields.number_arrays import read_only
from ...scene.geometry.instancing import meshes_by_id
from ...scene.geometry.transform_faults import transform_faults
from ...scene.lights import LIGHTS, Light
from ...scene.materials.material_types import MATERIALS, Diffuse, Material
from ...scene.materials.textures import WHITE, Texture
from ...scene.model import (
    Backdrop,
    Camera,
    Display,
    Environment,
    Ground,
    Instance,
    Model,
    Origin,
    RenderSettings,
    Scene,
    Source,
    Sphere,
    Vector,
)
from ...scene.model_pose import with_poses
from ...scene.provenance import material_of, parts_of
from ...scene.sky.sky import Sky
from ..images.image_reader import read_picture
from ..referenced_files import name_of
from .built_in_environments import BUILT_IN
from .instance_table import InstanceReader, InstanceTable, Repeat, placed
from .mesh_table import MeshTable
from .moving_mesh import MovingMesh, shown
from .placement import MotionTable
from .texture_table import TextureReader
from .values import toml_key

Kind = TypeVar("Kind")
#: Keys of [camera] that may accompany the name of another one.
SHUTTER = ("shutter", "rolling_shutter")
ORIGIN: Vector = (0.0, 0.0, 0.0)
Placed = TypeVar("Placed", MeshTable, InstanceTable)
Table = Mapping[str, Any]
SECTIONS = (
    "camera",
    "cameras",
    "animation",
    "keyframe",
    "render",
    "environment",
    "sky",
    "backdrop",
    "ground",
    "display",
    "materials",
    "mesh",
    "instance",
    "sphere",
    "light",
)


class SceneReader:
    """Reader for one document. `problems` holds its problems; parts with problems are left out or at their defaults."""

    def __init__(self, path: Path, document: Table) -> None:
        """Create a reader for a document read from `path`; the files that it names are relative to that folder."""
        self._path = path
        self._document: Table = _frozen(document)
        self._materials: dict[str, Material] = {}
        self._textures = TextureReader(path.parent)
        self._cameras: dict[str, Camera] = {}
        self._instances = InstanceReader()
        self._moving: list[tuple[str | None, MovingMesh]] = []
        self._source = Source()
        self.problems = [f'key "{key}" {unknown(key, SECTIONS)}' for key in document if key not in SECTIONS]

    def scene(self) -> Scene:
        for name, values in self._table("cameras").items():
            self._cameras[name] = self._camera(values, f"cameras.{name}")
        lens = self._table("camera")
        camera = Camera() if "name" in lens else self._camera(lens, "camera")
        render = self._build(RenderSettings, self._table("render"), "render")
        sky = self._sky()
        environment = sky.environment() if sky else self._environment(self._table("environment"))
        backdrop = self._backdrop(self._table("backdrop")) if "backdrop" in self._document else None
        ground = self._build(Ground, self._table("ground"), "ground") if "ground" in self._document else None
        display = self._build(Display, self._table("display"), "display")
        for name, values in self._table("materials").items():
            where = f"materials.{name}"
            self._materials[name] = self._typed(MATERIALS, values, where) or Diffuse()
        spheres = [self._sphere(values, f"sphere[{i}]") for i, values in enumerate(self._tables("sphere"))]
        lights: list[Light] = sky.lights() if sky else []
        lights += [
            self._light(values, f"light[{i}]") or SUN  # keeps the later ones' numbers
            for i, values in enumerate(self._tables("light"))
        ]
        models = [self._mesh(values, f"mesh[{i}]") for i, values in enumerate(self._tables("mesh"))]
        lights += [light for model in models for light in model.lights]
        meshes = [mesh for model in models for mesh in [*model.meshes, *model.emitters]]
        instances = [instance for model in models for instance in model.instances]
        instances += [
            one for i, values in enumerate(self._tables("instance")) for one in self._instance(values, f"instance[{i}]")
        ]
        camera = self._named_camera(lens) if "name" in lens else camera
        animation, source = self._with_models(self._animation()), self._sources()
        made = self._tried(
            lambda: Scene(
                meshes=meshes,
                instances=instances,
                lights=lights,
                spheres=[each for each in spheres if each],
                camera=camera,
                cameras=self._cameras,
                environment=environment or Environment(),
                backdrop=backdrop,
                ground=ground,
                display=display or Display(),
                render=render or RenderSettings(),
                name=name_of(self._path),
                animation=animation,
                materials=self._materials,
                source=source,
            )
        )
        return made or Scene(cameras=self._cameras)

    def _sources(self) -> Source:
        self._source.files += [
            (image, (self._path.parent / name).resolve())
            for images in (self._textures.pictures, self._textures.pixels)
            for name, image in images.items()
        ]
        return self._source

    def _camera(self, values: Any, where: str) -> Camera:
        """Return the camera, or a default one if it is invalid; its position, look_at and up are always checked."""
        if not isinstance(values, dict):
            self.problems.append(f"{where}: {show(values)} is not a table; write its keys below [{where}]")
            return Camera()
        if isinstance(end := values.get("end"), dict):
            built = self._build(CameraEnd, end, f"{where}.end")
            values = {**values, "end": built}
        elif "end" in values:
            self.problems.append(f"{where}.end: {show(end)} is not a table; write its keys below [{where}.end]")
            values = {key: value for key, value in values.items() if key != "end"}
        if camera := self._build(Camera, values, where):
            return camera
        place = {key: values[key] for key in ("position", "look_at", "up") if key in values}
        if not field_problems(Camera, place, where):
            self._made(lambda: Camera(**usable(Camera, place)), where)
        return Camera()

    def _named_camera(self, values: Table) -> Camera:
        """Return the camera of `cameras` that the table names."""
        name = str(values["name"])
        self.problems += camera_problems(name, self._cameras, "camera.name")
        shutter = {key: value for key, value in values.items() if key in SHUTTER}
        self.problems += [
            f"camera: has both a name and {key}; keep one of them" for key in values if key not in {"name", *SHUTTER}
        ]
        named = self._cameras.get(name, Camera())
        exposed = self._build(Camera, shutter, "camera") if shutter else None
        return exposed.exposed_as(named) if exposed else named

    def _animation(self) -> Animation | None:
        """Return the camera's animation; None if there is none or if it is invalid."""
        if not {"animation", "keyframe"} & set(self._document):
            return None
        table = self._table("animation")
        if "keyframes" in table:
            self.problems.append("animation.keyframes: keyframes are tables of their own; write [[keyframe]]")
        whole = self._build(Animation, {key: table[key] for key in table if key != "keyframes"}, "animation")
        keys = [self._keyframe(values, f"keyframe[{i}]") for i, values in enumerate(self._tables("keyframe"))]
        known = tuple(key for key in keys if key)
        return replace(whole, keyframes=known) if whole and len(known) == len(keys) else None

    def _with_models(self, camera: Animation | None) -> Animation | SceneAnimation | None:
        """Return the scene's animation, of its camera and of its moving meshes."""
        models = tuple(moving.animation() for _, moving in self._moving)
        if not models:
            return camera
        given = camera or Animation()
        moves = bool(given.keyframes) or given.turntable_seconds is not None
        return SceneAnimation(models=models, camera=given if moves else None, fps=given.fps)

    def _keyframe(self, values: Any, where: str) -> Keyframe | None:
        if isinstance(values, dict):
            return self._build(Keyframe, values, where)
        self.problems.append(f"{where}: {show(values)} is not a table; write [[keyframe]]")
        return None

    def _table(self, name: str) -> Table:
        """Return the section [name], empty if there is none."""
        table = self._document.get(name, {})
        if isinstance(table, dict):
            return table
        self.problems.append(f"{name}: {show(table)} is not a table; write [{name}]")
        return {}

    def _tables(self, name: str) -> Sequence[Any]:
        """Return the sections [[name]]."""
        tables = self._document.get(name, ())
        if isinstance(tables, tuple):
            return tables
        self.problems.append(f"{name}: is not a list of tables; write [[{name}]] in double brackets")
        return ()

    def _build(self, kind: type[Kind], values: Table, where: str) -> Kind | None:
        """Return kind(**values), or None if they are invalid."""
        problems = field_problems(kind, values, where)
        self.problems += problems
        return None if problems else self._made(lambda: kind(**usable(kind, values)), where)

    def _made(self, make: Callable[[], Kind], where: str) -> Kind | None:
        """Return make(), or None if it raises ObjectError, whose problems are collected as those of the table."""
        try:
            return make()
        except ObjectError as error:
            self.problems += [problem for problem in error.named(where) if problem not in self.problems]
            return None

    def _typed(self, kinds: Sequence[type[Kind]], values: Any, where: str) -> Kind | None:
        """Return a material or light of the class whose `kernel` is the table's `type`."""
        known = {kind.kernel: kind for kind in kinds}  # type: ignore[attr-defined]
        if not isinstance(values, dict):
            self.problems.append(f"{where}: {show(values)} is not a table; write its keys below [{where}]")
        elif "type" not in values:
            self.problems.append(f"{where}: type is missing; write one of {', '.join(known)}")
        elif str(values["type"]) not in known:
            self.problems.append(f"{where}.type: {show(values['type'])} {unknown(values['type'], known)}")
        else:
            rest = {key: value for key, value in values.items() if key != "type"}
            rest = {
                key: self._texture(value, f"{where}.{key}") if isinstance(value, dict) else value
                for key, value in rest.items()
            }
            return self._build(known[str(values["type"])], rest, where)
        return None

    def _light(self, values: Any, where: str) -> Light | None:
        if isinstance(values, dict) and "image" in values:
            name = values["image"]
            table = (name, f"{where}.image") if isinstance(name, dict) else ({"image": name}, where)
            values = {**values, "image": self._tried(self._textures.light_image, *table)}
        return self._typed(LIGHTS, values, where)

    def _texture(self, values: Table, where: str) -> Texture:
        """Return the texture that a table describes, or a white one if it is invalid."""
        return self._tried(self._textures.read, values, where) or Texture(picture=WHITE)

    def _environment(self, values: Table) -> Environment | None:
        values, image = dict(values), None
        if (sky := values.pop("sky", None)) is not None:
            if str(sky) in BUILT_IN:
                image = BUILT_IN[str(sky)]().image
            else:
                self.problems.append(f"environment.sky: {show(sky)} {unknown(sky, BUILT_IN)}")
            self.problems += [
                f"environment: has both a sky and {key}; keep one of them"
                for key in ("color", "image")
                if key in values
            ]
        image = self._picture(values, "environment") if "image" in values else image
        return self._build(Environment, _one_kind(values, image), "environment")

    def _sky(self) -> Sky | None:
        """Return the analytic sky; None if there is none or if it is invalid."""
        if "sky" not in self._document:
            return None
        if "environment" in self._document:
            self.problems.append("sky: the scene has both [sky] and [environment]; keep one of them")
        values = self._table("sky")
        if values is not self._document["sky"]:
            return None
        return self._build(Sky, values, "sky")

    def _backdrop(self, values: Table) -> Backdrop | None:
        image = self._picture(values, "backdrop") if "image" in values else None
        return self._build(Backdrop, _one_kind(values, image), "backdrop")

    def _picture(self, values: Table, where: str) -> Any:
        """Return the image of a table without a color; None if it cannot be read."""
        name = values["image"]
        if "color" in values:
            self.problems.append(f"{where}: has both a color and an image; keep one of them")
        if not isinstance(name, str):
            self.problems.append(f"{where}.image: {show(name)} is not a string; write a file name in quotes")
            return None
        try:
            image = read_only(read_picture(self._path.parent / name))
        except SceneError as error:
            self.problems += [f"{where}.image: {problem}" for problem in error.problems]
            return None
        self._source.files.append((image, (self._path.parent / name).resolve()))
        return image

    def _material(self, values: Table, where: str) -> Material | None:
        """Return the material that the table names, or None if it names none."""
        return self._named_material(values["material"], f"{where}.material") if "material" in values else None

    def _named_material(self, name: Any, where: str) -> Material:
        """Return the material of this name, or a grey one if there is none."""
        if str(name) not in self._materials:
            self.problems.append(f"{where}: {show(name)} {unknown(name, self._materials)}")
        return self._materials.get(str(name), Diffuse())

    def _sphere(self, values: Any, where: str) -> Sphere | None:
        if not isinstance(values, dict):
            self.problems.append(f"{where}: {show(values)} is not a table; write [[sphere]]")
            return None
        material = self._material(values, where) or Diffuse()
        return self._build(Sphere, {**values, "material": material}, where)

    def _mesh(self, values: Any, where: str) -> Model:
        """Return what one table shows, in world coordinates."""
        if not isinstance(values, dict):
            self.problems.append(f"{where}: {show(values)} is not a table; write [[mesh]]")
            return Model(meshes=[])
        material = self._material(values, where)
        table = self._build(MeshTable, _one_scale(values), where)
        geometry = {key: values[key] for key in ("file", "vertices", "faces") if key in values}
        model, matrix = None, None
        if table or not field_problems(MeshTable, geometry, where):
            model = self._tried((table or MeshTable(**geometry)).read, self._path.parent, where)
            matrix = self._tried((table or MeshTable()).to_world, where)
        last, pivot = self._motion(table, values, where)
        end = None if last is None else self._tried(last.to_world, f"{where}.motion")
        if end is not None and any(fault.any() for fault in transform_faults(end[None, :3]).values()):
            self.problems.append(f"{where}.motion: its transform flattens the mesh; write a nonzero scale")
            end = None
        if matrix is not None and not matrix[:3, :3].any():
            self.problems.append(f"{where}: its transform collapses it to a point; write a nonzero scale")
        if model is None or matrix is None:
            model = Model(meshes=[])
        else:
            own = {mesh.material_name for mesh in (*model.meshes, *meshes_by_id(model.instances).values())}
            before = list(map(material_of, parts_of(model)))
            others = self._others(values, own, where)
            at = partial(placed, matrix=matrix, material=material, others=others, end=end, pivot=pivot)
            model = self._made(partial(with_poses, model, at), where) or Model(meshes=[])
            self._source.meshes.append(Origin(self._located(values), parts_of(model), before))
        for name, camera in model.cameras.items():
            self._source.cameras.setdefault(name, self._cameras.setdefault(name, camera))
        own_name = str(values["name"]) if "name" in values else None
        self._instances.add(own_name, model)
        visible, lights = table is None or table.visible, table is not None and table.lights
        if model.animation is not None:
            self._moving.append((own_name, MovingMesh(model, model.animation, visible, lights)))
        return shown(model, visible, lights)

    def _motion(self, table: Placed | None, values: Table, where: str) -> tuple[Placed | None, Vector]:
        """Return the table at the end of the exposure, and its pivot; None if it has no motion or an invalid one."""
        if table is None or "motion" not in values:
            return None, ORIGIN
        motion = values["motion"]
        if not isinstance(motion, dict):
            self.problems.append(f"{where}.motion: {show(motion)} is not a table; write {{ translate = [1, 0, 0] }}")
            return None, ORIGIN
        keys = _one_scale(motion)
        built = self._build(MotionTable, keys, f"{where}.motion")
        if built and (fault := table.turn_fault(keys)):
            self.problems.append(f"{where}.motion.{fault}")
        return (table.moved(usable(MotionTable, keys)), built.pivot) if built else (None, ORIGIN)

    def _located(self, values: Table) -> Table:
        """Return the table of a mesh with an absolute path."""
        return {**values, "file": (self._path.parent / values["file"]).resolve()} if "file" in values else values

    def _others(self, values: Table, own: set[str], where: str) -> dict[str, Material]:
        """Return the table's replacements for the file's `own` materials, by their names."""
        pairs = values.get("materials", {})
        if not isinstance(pairs, dict):
            self.problems.append(
                f'{where}.materials: {show(pairs)} is not a table; write {{ "name in the file" = "NAME" }}'
            )
            return {}
        if pairs and "material" in values:
            self.problems.append(f"{where}: has both a material and materials; keep one of them")
        named = own - {""}
        self.problems += [
            f'{where}.materials: "{name}" '
            + (
                unknown(name, named)
                if named
                else 'is unknown, as the model has no named materials; write material = "NAME"'
            )
            for name in pairs
            if name not in own
        ]
        return {
            name: self._named_material(other, f"{where}.materials.{toml_key(name)}") for name, other in pairs.items()
        }

    def _instance(self, values: Any, where: str) -> list[Instance]:
        if not isinstance(values, dict):
            self.problems.append(f"{where}: {show(values)} is not a table; write [[instance]]")
            return []
        material = self._material(values, where)
        table = self._build(InstanceTable, _one_scale(values), where)
        self.problems += self._instances.problems(values["mesh"], where) if "mesh" in values else []
        repeats = self._repeats(values.get("repeat", ()), f"{where}.repeat")
        end, pivot = self._motion(table, values, where)
        copies = table and self._tried(self._instances.read, table, repeats, material, where, end, pivot)
        parts = self._instances.parts(table) if table and copies else []
        made = (self._made(lambda: copies.of(parts), where) if copies else None) or []
        self._source.instances.append(Origin(values, made, [each.material for each in parts]))
        for name, moving in self._moving:
            if copies and name == str(values["mesh"]):
                moving.add(copies, made)
        return made

    def _repeats(self, values: Any, where: str) -> list[Repeat]:
        if not isinstance(values, tuple) or not all(isinstance(entry, dict) for entry in values):
            self.problems.append(f"{where}: {show(values)} is not a list of tables; write [{{ count = 3, … }}]")
            return []
        built = [self._build(Repeat, _one_scale(entry), f"{where}[{i}]") for i, entry in enumerate(values)]
        return [each for each in built if each]

    def _tried(self, read: Callable[..., Kind], *arguments: Any) -> Kind | None:
        """Return read(*arguments), or None if it raises SceneError, whose problems are collected."""
        try:
            return read(*arguments)
        except SceneError as error:
            self.problems += error.problems
            return None


def camera_problems(name: str, cameras: Collection[str], where: str) -> list[str]:
    """Return a problem if there is no camera of this name."""
    if name in cameras:
        return []
    remedy = unknown(name, cameras) if cameras else "is unknown, as neither [cameras] nor a model file has one"
    return [f"{where}: {show(name)} {remedy}"]


def _one_kind(values: Table, image: Any) -> Table:
    """Return the table with its image instead of the file's name, if it could be read, or with its color."""
    rest = {key: value for key, value in values.items() if key not in ("image", "color")}
    color = {"color": values["color"]} if "color" in values and image is None else {}
    return {**rest, **color, "image": image}


def _one_scale(values: Table) -> Table:
    """Return the table with a single number for `scale` expanded to three."""
    return {**values, "scale": (scale,) * 3} if isinstance(scale := values.get("scale"), (int, float)) else values


def _frozen(value: Any) -> Any:
    """Convert TOML's arrays to tuples, recursively."""
    if isinstance(value, list):
        return tuple(map(_frozen, value))
    return {key: _frozen(entry) for key, entry in value.items()} if isinstance(value, dict) else value
