"""What the directives of a pbrt file describe: shapes with their attributes, lights, a camera, settings."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from ...errors import SceneError
from ...scene.geometry.transform import axis_rotation, looking_at, scaling, translation
from .directives import Directive, Reader
from .entities import Entity, Files, Parameter
from .tokens import Doubles

#: Maximum nesting depth of attributes.
DEEPEST = 256
#: Tolerance of the last row of a matrix.
AFFINE = 1e-4
#: What only files of v3 and before have, by directive.
OLD = {
    "Film": {"image"},
    "Sampler": {"random", "02sequence", "lowdiscrepancy", "maxmindist", "bestcandidate", "adaptive"},
    "Integrator": {"directlighting", "whitted"},
    "Material": {
        "matte",
        "plastic",
        "metal",
        "glass",
        "mirror",
        "uber",
        "substrate",
        "translucent",
        "disney",
        "fourier",
        "kdsubsurface",
    },
}
TARGETS = {"Shape": "shape", "LightSource": "light", "AreaLightSource": "light", "Texture": "texture"}
TARGETS |= {"Material": "material", "MakeNamedMaterial": "material", "MakeNamedMedium": "medium"}


class ShapeUse(NamedTuple):
    """A shape and the attributes then in effect. material: an entity, the name of one defined later, or None; area: its
    emission; inside, outside: names of media."""

    shape: Entity
    reversed: bool
    material: Entity | str | None
    area: Entity | None
    inside: str
    outside: str


class Placed(NamedTuple):
    """An ObjectInstance. place: its line; to_world_end: as that of an Entity."""

    name: str
    to_world: Doubles
    place: str
    to_world_end: Doubles | None = None


@dataclass
class Description:
    """old: whether the file is of v3 or before; times: of the transformations at the start and at the end."""

    files: Files
    single: dict[str, Entity] = field(default_factory=dict)
    shapes: list[ShapeUse] = field(default_factory=list)
    objects: dict[str, list[ShapeUse]] = field(default_factory=dict)
    instances: list[Placed] = field(default_factory=list)
    lights: list[Entity] = field(default_factory=list)
    materials: dict[str, Entity] = field(default_factory=dict)
    media: dict[str, Entity] = field(default_factory=dict)
    textures: dict[tuple[str, str], Entity] = field(default_factory=dict)
    times: tuple[float, float] = (0.0, 1.0)
    old: bool = False

    def entity(self, tag: str) -> Entity:
        """Return the Camera, Film, Sampler, PixelFilter or Integrator; an empty one if the file has none."""
        return self.single.get(tag) or Entity(tag, "")

    def material(self, name: str, user: Entity) -> Entity:
        """Return a named material. Raises SceneError naming the user of an undefined one."""
        if name not in self.materials:
            raise SceneError(f'{user.at}: uses the material "{name}", which is not defined; define it')
        return self.materials[name]


@dataclass
class State:
    """Attributes that AttributeBegin saves."""

    to_world: Doubles = field(default_factory=lambda: np.eye(4))
    reversed: bool = False
    material: Entity | str | None = field(default_factory=lambda: Entity("Material", "diffuse"))
    area: Entity | None = None
    inside: str = ""
    outside: str = ""
    space: str = "srgb"
    #: The transformation at the end of its time, if that is another one, and which of the two are changed.
    to_world_end: Doubles | None = None
    active: str = "All"
    defaults: dict[str, dict[str, Parameter]] = field(default_factory=dict)


def describe(reader: Reader, directives: Iterable[Directive]) -> Description:
    """Interpret the directives of a scene. Raises SceneError for the first one that makes no sense."""
    return _Interpreter(reader.files).description(directives)


class _Interpreter:
    def __init__(self, files: Files) -> None:
        self._found = Description(files)
        self._state = State()
        self._saved: list[tuple[str, State]] = []
        self._systems: dict[str, tuple[Doubles, Doubles | None]] = {}
        self._object: str | None = None
        self._transforms: dict[str, Callable[[Doubles, Directive], Doubles]] = {
            "Translate": lambda before, each: before @ translation(_triple(each.numbers)),
            "Scale": lambda before, each: before @ scaling(_triple(each.numbers)),
            "Rotate": lambda before, each: before @ axis_rotation(_triple(each.numbers[1:]), each.numbers[0]),
            "LookAt": lambda before, each: before @ _world_to_camera(each),
            "Identity": lambda before, each: np.eye(4),
            "Transform": lambda before, each: _matrix(each),
            "ConcatTransform": lambda before, each: before @ _matrix(each),
        }

    def description(self, directives: Iterable[Directive]) -> Description:
        for each in directives:
            if each.name in self._transforms or each.name == "CoordSysTransform":
                self._transform(each)
            else:
                HANDLED[each.name](self, each)
        if self._saved:
            begun, _ = self._saved[-1]
            raise SceneError(f"{begun}: has no matching end; add it")
        return self._found

    def _transform(self, each: Directive) -> None:
        state = self._state
        start, end = state.to_world, state.to_world if state.to_world_end is None else state.to_world_end
        if state.active != "EndTime":
            start = self._transformed(start, each, 0)
        if state.active != "StartTime":
            end = self._transformed(end, each, 1)
        state.to_world, state.to_world_end = start, None if np.array_equal(start, end) else end

    def _transformed(self, before: Doubles, each: Directive, time: int) -> Doubles:
        """Return the transformation at the start (0) or at the end (1) after a directive."""
        with np.errstate(all="ignore"):
            made = (
                self._system(each)[time]
                if each.name == "CoordSysTransform"
                else self._transforms[each.name](before, each)
            )
            to_world = made / made[3, 3]
        last = np.abs(made[3] - (0, 0, 0, made[3, 3])).max()
        if not np.isfinite(to_world).all() or last > AFFINE * abs(made[3, 3]):
            raise SceneError(f"{each.place}: {each.name} is not affine or not finite; write an affine one")
        to_world[3] = (0, 0, 0, 1)
        return np.asarray(to_world, np.float64)

    def _system(self, each: Directive) -> tuple[Doubles, Doubles]:
        name = each.words[0]
        if name not in self._systems:
            raise SceneError(f'{each.place}: the coordinate system "{name}" is not defined; define it')
        start, end = self._systems[name]
        return start, start if end is None else end

    def _entity(self, each: Directive, name: str = "", kind: str = "", value_type: str = "") -> Entity:
        kind = kind or each.words[-1]
        defaults = self._state.defaults.get(TARGETS.get(each.name, ""), {})
        self._found.old |= kind in OLD.get("Material" if each.name == "MakeNamedMaterial" else each.name, ())
        return Entity(
            each.name,
            kind,
            each.place,
            {**defaults, **each.parameters},
            name,
            value_type,
            self._state.to_world,
            self._state.space,
            self._found.files,
            each.file,
            frozenset(defaults.keys() - each.parameters.keys()),
            self._known(each.parameters),
            to_world_end=self._state.to_world_end,
        )

    def _known(self, parameters: dict[str, Parameter]) -> dict[tuple[str, str], Entity]:
        """Return the textures that parameters name: as defined so far, since v3 allows to define a name again."""
        names = [str(each.values[0]) for each in parameters.values() if each.type == "texture" and len(each.values)]
        keys = [(kind, name) for name in names for kind in ("float", "spectrum")]
        if all(("float", name) in self._found.textures or ("spectrum", name) in self._found.textures for name in names):
            return {key: self._found.textures[key] for key in keys if key in self._found.textures}
        return self._found.textures

    def single(self, each: Directive) -> None:
        """Note the Camera and the like."""
        tag = {"SurfaceIntegrator": "Integrator"}.get(each.name, each.name)
        self._found.single[tag] = replace(self._entity(each), tag=tag)
        if tag == "Camera":
            poses = self._state.to_world, self._state.to_world_end
            with np.errstate(all="ignore"):
                if any(pose is not None and abs(np.linalg.det(pose)) < 1e-300 for pose in poses):
                    raise SceneError(f"{each.place}: the camera's transformation is singular; write another")
                start, end = (None if pose is None else np.asarray(np.linalg.inv(pose), np.float64) for pose in poses)
            assert start is not None
            self._systems["camera"] = start, end

    def shape(self, each: Directive) -> None:
        """Note a shape, of the scene or of an object."""
        state = self._state
        use = ShapeUse(self._entity(each), state.reversed, state.material, state.area, state.inside, state.outside)
        if self._object is None:
            self._found.shapes.append(use)
        else:
            self._found.objects[self._object].append(use._replace(area=None))  # pbrt ignores emission there

    def light(self, each: Directive) -> None:
        """Note a light."""
        entity = self._entity(each)
        self._found.old |= "mapname" in entity.parameters
        self._found.lights.append(entity)

    def area(self, each: Directive) -> None:
        """Set the emission of shapes."""
        self._state.area = self._entity(each)

    def material(self, each: Directive) -> None:
        """Set the material of shapes."""
        self._state.material = self._entity(each)

    def use_material(self, each: Directive) -> None:
        """Set a named material, which may be defined later."""
        self._state.material = self._found.materials.get(each.words[0], each.words[0])

    def make_material(self, each: Directive) -> None:
        """Note a named material."""
        kind = each.parameters.get("type")
        if kind is None or not len(kind.values):
            raise SceneError(f'{each.place}: material "{each.words[0]}" has no type; write "string type" "diffuse"')
        entity = self._entity(each, each.words[0], str(kind.values[0]))
        entity.used.add("type")
        self._found.materials[each.words[0]] = entity

    def make_medium(self, each: Directive) -> None:
        """Note a named medium."""
        kind = each.parameters.get("type")
        name = str(kind.values[0]) if kind and len(kind.values) else "homogeneous"
        self._found.media[each.words[0]] = self._entity(each, each.words[0], name)

    def texture(self, each: Directive) -> None:
        """Note a texture."""
        name, value_type, kind = each.words
        value_type = "float" if value_type == "float" else "spectrum"
        entity = self._entity(each, name, kind, value_type)
        self._found.textures[value_type, name] = entity

    def attribute(self, each: Directive) -> None:
        """Set defaults of parameters."""
        defaults = self._state.defaults
        self._state.defaults = {**defaults, each.words[0]: {**defaults.get(each.words[0], {}), **each.parameters}}

    def begin(self, each: Directive) -> None:
        """Save the attributes."""
        if len(self._saved) > DEEPEST:
            raise SceneError(f"{each.place}: attributes are nested more than {DEEPEST} deep; end some")
        self._saved.append((f"{each.place}: {each.name}", replace(self._state)))

    def end(self, each: Directive) -> None:
        """Restore the attributes, or after TransformBegin the transformation alone."""
        if not self._saved:
            raise SceneError(f"{each.place}: {each.name} ends what did not begin; remove it")
        _, saved = self._saved.pop()
        if each.name == "TransformEnd":
            self._state = replace(
                self._state, to_world=saved.to_world, to_world_end=saved.to_world_end, active=saved.active
            )
        else:
            self._state = saved

    def begin_object(self, each: Directive) -> None:
        """Begin an object, whose shapes are rendered by its instances."""
        if self._object is not None:
            raise SceneError(f"{each.place}: ObjectBegin is inside an object; end that first")
        self.begin(each)
        self._object = each.words[0]
        self._found.objects[self._object] = []

    def end_object(self, each: Directive) -> None:
        """End an object."""
        if self._object is None:
            raise SceneError(f"{each.place}: ObjectEnd ends what did not begin; remove it")
        self.end(each)
        self._object = None

    def instance(self, each: Directive) -> None:
        """Note an instance."""
        if self._object is not None:
            raise SceneError(f"{each.place}: ObjectInstance is inside an object; write it outside")
        self._found.instances.append(Placed(each.words[0], self._state.to_world, each.place, self._state.to_world_end))

    def world(self, each: Directive) -> None:
        """Begin the world, whose coordinates those of the camera were relative to."""
        self._state.to_world, self._state.to_world_end = np.eye(4), None
        self._state.active = "All"
        self._systems["world"] = np.eye(4), None

    def reverse(self, each: Directive) -> None:
        """Turn shapes inside out."""
        self._state.reversed = not self._state.reversed

    def system(self, each: Directive) -> None:
        """Name the coordinate system."""
        self._systems[each.words[0]] = self._state.to_world, self._state.to_world_end

    def active(self, each: Directive) -> None:
        """Select the transformations of the start or the end of the shutter's time."""
        self._state.active = each.words[0]

    def times(self, each: Directive) -> None:
        """Set the times of the transformations at the start and at the end."""
        start, end = each.numbers
        self._found.times = float(start), float(end)

    def media(self, each: Directive) -> None:
        """Set the media inside and outside shapes."""
        self._state.inside, self._state.outside = each.words

    def space(self, each: Directive) -> None:
        """Set the color space."""
        self._state.space = each.words[0].lower()

    def volume(self, each: Directive) -> None:
        """Note a medium of v2, which the scene contains directly."""
        self._found.single["Volume"] = self._entity(each)

    def end_world(self, each: Directive) -> None:
        """Note that the file is of v3 or before."""
        self._found.old = True

    def ignore(self, each: Directive) -> None:
        """Leave the directive out: it does not affect the image."""


HANDLED: dict[str, Callable[[_Interpreter, Directive], None]] = {
    **dict.fromkeys(
        ("Camera", "Film", "Sampler", "PixelFilter", "Integrator", "SurfaceIntegrator"), _Interpreter.single
    ),
    **dict.fromkeys(("AttributeBegin", "TransformBegin"), _Interpreter.begin),
    **dict.fromkeys(("AttributeEnd", "TransformEnd"), _Interpreter.end),
    **dict.fromkeys(("Accelerator", "VolumeIntegrator", "Renderer", "Option"), _Interpreter.ignore),
    "Shape": _Interpreter.shape,
    "LightSource": _Interpreter.light,
    "AreaLightSource": _Interpreter.area,
    "Material": _Interpreter.material,
    "NamedMaterial": _Interpreter.use_material,
    "MakeNamedMaterial": _Interpreter.make_material,
    "MakeNamedMedium": _Interpreter.make_medium,
    "MediumInterface": _Interpreter.media,
    "Texture": _Interpreter.texture,
    "Attribute": _Interpreter.attribute,
    "ObjectBegin": _Interpreter.begin_object,
    "ObjectEnd": _Interpreter.end_object,
    "ObjectInstance": _Interpreter.instance,
    "WorldBegin": _Interpreter.world,
    "WorldEnd": _Interpreter.end_world,
    "ReverseOrientation": _Interpreter.reverse,
    "CoordinateSystem": _Interpreter.system,
    "ActiveTransform": _Interpreter.active,
    "TransformTimes": _Interpreter.times,
    "ColorSpace": _Interpreter.space,
    "Volume": _Interpreter.volume,
}


def _triple(numbers: tuple[float, ...]) -> tuple[float, float, float]:
    x, y, z = numbers[:3]
    return x, y, z


def _matrix(each: Directive) -> Doubles:
    """Return the matrix whose columns follow each other."""
    return np.reshape(each.numbers, (4, 4)).T


def _world_to_camera(each: Directive) -> Doubles:
    eye, target, up = (_triple(each.numbers[start : start + 3]) for start in (0, 3, 6))
    try:
        return np.asarray(np.linalg.inv(looking_at(eye, target, up)), np.float64)
    except (ValueError, np.linalg.LinAlgError):
        raise SceneError(f"{each.place}: LookAt has no direction, or looks along up; write another") from None
