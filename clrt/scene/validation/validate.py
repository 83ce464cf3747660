"""Scene validation, for scenes read from files and built in Python alike.

The objects of a scene validate themselves when they are made (fields.validated). Here their types are checked, what was
assigned to them later, and what is wrong with them together.
"""

from __future__ import annotations

from ...errors import ObjectError, SceneError
from ..animation import Animation, ModelAnimation, SceneAnimation
from ..camera_path import animation_problems
from ..exposure import motion_features
from ..fields.field_types import not_of_type, show
from ..fields.validated import Validated
from ..lights import LIGHTS, BaseLight
from ..materials.material_types import MATERIALS, Material
from ..model import Backdrop, Camera, Display, Environment, Ground, Instance, Mesh, RenderSettings, Scene, Sphere

#: Lists of a scene by field: what an entry is called, and its type.
LISTS: dict[str, tuple[str, type[Validated]]] = {
    "meshes": ("mesh", Mesh),
    "spheres": ("sphere", Sphere),
    "instances": ("instance", Instance),
    "lights": ("light", BaseLight),
}
#: Single parts of a scene by field, likewise.
PARTS: dict[str, type[Validated]] = {
    "camera": Camera,
    "environment": Environment,
    "render": RenderSettings,
    "display": Display,
}
#: Parts that a scene may lack.
OPTIONAL: dict[str, type[Validated]] = {"backdrop": Backdrop, "ground": Ground}
#: Parts by their names in the scene, likewise.
NAMED: dict[str, type[Validated]] = {"cameras": Camera, "materials": Material}
#: Concrete types of the abstract ones.
KINDS: dict[type, tuple[type, ...]] = {Material: MATERIALS, BaseLight: LIGHTS}


def validate(scene: Scene) -> None:
    """Raise one SceneError with all problems of the scene; do nothing if there are none."""
    problems = scene_problems(scene)
    if problems:
        raise SceneError(problems)


def scene_problems(scene: Scene) -> list[str]:
    """Return one sentence per problem; empty if the scene can be rendered."""
    if problems := _list_problems(scene):
        return problems
    problems = [problem for name, kind in PARTS.items() for problem in _problems(getattr(scene, name), kind, name)]
    for name, kind in OPTIONAL.items():
        problems += [] if getattr(scene, name) is None else _problems(getattr(scene, name), kind, name)
    for name, kind in NAMED.items():
        for key, part in getattr(scene, name).items():
            problems += _problems(part, kind, f"{name}[{show(key)}]")
    for field, (name, kind) in LISTS.items():
        for i, part in enumerate(getattr(scene, field)):
            problems += _problems(part, kind, f"{name}[{i}]")
    for of_scene in (_animation_problems, _raster_problems, _local_problems, _moving_raster_problems):
        problems = problems or of_scene(scene)
    return problems


def _list_problems(scene: Scene) -> list[str]:
    """Return problems of parts of the scene that should be lists, or mappings by name, and are not."""
    return [
        f"{name}: {show(part)} is not a list; write {name}=[...]"
        for name in LISTS
        if not isinstance(part := getattr(scene, name), (list, tuple))
    ] + [
        f"{name}: {show(part)} is not a dict; write {name}={{...}}, by their names"
        for name in NAMED
        if not isinstance(part := getattr(scene, name), dict)
    ]


def _problems(part: object, kind: type[Validated], where: str) -> list[str]:
    """Return problems unless `part` is a valid object of this type. A mesh or instance is called by its name, too."""
    if not isinstance(part, kind):
        names = " or clrt.".join(each.__name__ for each in KINDS.get(kind, (kind,)))
        fault = not_of_type(part, kind, kind.__name__.removeprefix("Base"), f"write a clrt.{names}")
        return [f"{where}: {fault}"]
    try:
        part.check()
        if isinstance(part, Instance):
            part.mesh.check()
    except ObjectError as error:
        named = f"{where} {show(part.name)}" if isinstance(part, Mesh | Instance) else where
        return error.named(named)
    return []


def _animation_problems(scene: Scene) -> list[str]:
    """Return problems of the animation of the scene's camera, if it has one."""
    animation = scene.animation.camera if isinstance(scene.animation, SceneAnimation) else scene.animation
    if animation is None or isinstance(animation, ModelAnimation):
        return []
    return _problems(animation, Animation, "animation") or animation_problems(scene.camera, animation)


def _raster_problems(scene: Scene) -> list[str]:
    """Return a problem if the raster integrator does not support the camera."""
    camera, plain = scene.camera, Camera()
    if scene.render.integrator != "raster":
        return []
    names = ("projection", "aperture_radius", "lens_shift", "skew", "distortion")
    given = next((name for name in names if getattr(camera, name) != getattr(plain, name)), None)
    if given is None:
        return []
    shown = f"{given} = {show(getattr(camera, given))}"
    return [
        f'render.integrator: "raster" supports only pinhole cameras, and the camera has {shown}; leave that out, '
        'or write "local"'
    ]


def _moving_raster_problems(scene: Scene) -> list[str]:
    """Return a problem if the raster integrator is to render motion."""
    if scene.render.integrator != "raster" or not motion_features(scene):
        return []
    return [
        'render.integrator: "raster" does not support motion blur; write "local", or leave out the shutter and '
        "rolling_shutter of the camera"
    ]


def _local_problems(scene: Scene) -> list[str]:
    """Return a problem if a local integrator is to render catchers."""
    integrator = scene.render.integrator
    if integrator not in ("local", "raster"):
        return []
    parts: list[Mesh | Sphere | Instance] = [
        *scene.meshes,
        *scene.spheres,
        *scene.instances,
        *(each.mesh for each in scene.instances),
    ]
    if not any(part.material is not None and part.material.catcher for part in parts):
        return []
    return [
        f'render.integrator: "{integrator}" does not support catchers, which need light with and without the objects; '
        'write "path" or "direct", or leave out catcher = true'
    ]
