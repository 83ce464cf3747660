"""Static scenes of an animated model."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, TypeVar

from .animation import ModelAnimation
from .lights import Light
from .materials.material import Material
from .model import Camera, Instance, Mesh, Model, Scene

Part = TypeVar("Part", bound=Mesh | Instance | Light)


def posed(scene: Scene, animation: ModelAnimation, seconds: float) -> Scene:
    """Return the static scene at a time: the model's meshes, instances, lights and cameras are moved.

    Everything else stays, as do the materials of the scene's meshes, unless they are animated. The camera moves if it
    is the model's.
    """
    base, model = animation.base, animation.pose(seconds)
    cameras = {
        name: model.cameras.get(name, camera) if base.cameras.get(name) is camera else camera
        for name, camera in scene.cameras.items()
    }
    name = next((name for name, camera in base.cameras.items() if _is_shot_by(scene.camera, camera)), None)
    moved = scene.camera if name is None else scene.camera.exposed_as(model.cameras.get(name, scene.camera))
    return replace(
        scene,
        meshes=_moved(scene.meshes, [*base.meshes, *base.emitters], [*model.meshes, *model.emitters], animation),
        instances=_moved(scene.instances, base.instances, model.instances, animation),
        lights=_moved(scene.lights, base.lights, model.lights, animation),
        cameras=cameras,
        camera=moved,
        animation=None,
    )


def _is_shot_by(camera: Camera, own: Camera) -> bool:
    """Return whether a scene's camera is a model's own, maybe with a shutter."""
    return camera is own or (camera.exposure > 0 and camera.exposed_as(own) == camera)


def own_materials(model: Model) -> list[Material | None]:
    """Return the materials of a model's parts, for `ModelAnimation.own`."""
    return [part.material for part in _parts(model)]


def _parts(model: Model) -> list[Mesh | Instance]:
    return [*model.meshes, *model.emitters, *model.instances]


def with_poses(model: Model, change: Callable[[Model], Model]) -> Model:
    """Apply a change, which returns a model without animation, to a model and to all poses of its animation."""
    still, animation = change(model), model.animation
    if animation is None:
        return still
    pose = partial(_changed_pose, change, animation.pose)
    own = own_materials(still) if animation.own else ()
    return replace(still, animation=replace(animation, base=still, pose=pose, own=own))


def _changed_pose(change: Callable[[Model], Model], pose: Callable[[float], Model], seconds: float) -> Model:
    return change(pose(seconds))


def _moved(
    parts: Sequence[Part], before: Sequence[Part], after: Sequence[Part], animation: ModelAnimation
) -> list[Part]:
    """Return the parts with those in `before` replaced: one by one if `after` are as many, of the same names; else by
    all of these, in the place of the first. Parts keep the scene's material, unless it is animated and the model's."""
    numbers = {id(part): number for number, part in enumerate(before)}
    if list(map(_name, before)) != list(map(_name, after)):
        first = next((number for number, part in enumerate(parts) if id(part) in numbers), len(parts))
        return [*parts[:first], *after, *(part for part in parts[first:] if id(part) not in numbers)]
    own = dict(zip(map(id, _parts(animation.base)), animation.own))
    return [_in_material(after[numbers[id(part)]], part, own) if id(part) in numbers else part for part in parts]


def _name(part: Mesh | Instance | Light) -> str:
    return "" if isinstance(part, Light) else part.name


def _in_material(part: Any, before: Any, own: Mapping[int, Material | None]) -> Any:
    """Return the part, in the material that it had before unless that is its model's and animated."""
    if isinstance(part, Light) or part.material is before.material:
        return part
    return part if own.get(id(before), part) is before.material else replace(part, material=before.material)
