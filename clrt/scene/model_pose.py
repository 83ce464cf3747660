"""Static scenes of an animated model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, TypeVar

from .animation import ModelAnimation
from .lights import Light
from .model import Instance, Mesh, Model, Scene

Part = TypeVar("Part", bound=Mesh | Instance | Light)


def posed(scene: Scene, animation: ModelAnimation, seconds: float) -> Scene:
    """Return the static scene at a time: the model's meshes, instances, lights and cameras are moved.

    Everything else stays, as do the materials that the scene's meshes have. The camera moves if it is the model's.
    """
    base, model = animation.base, animation.pose(seconds)
    cameras = {
        name: model.cameras.get(name, camera) if base.cameras.get(name) is camera else camera
        for name, camera in scene.cameras.items()
    }
    name = next((name for name, camera in base.cameras.items() if camera is scene.camera), None)
    return replace(
        scene,
        meshes=_moved(scene.meshes, [*base.meshes, *base.emitters], [*model.meshes, *model.emitters]),
        instances=_moved(scene.instances, base.instances, model.instances),
        lights=_moved(scene.lights, base.lights, model.lights),
        cameras=cameras,
        camera=scene.camera if name is None else model.cameras.get(name, scene.camera),
        animation=None,
    )


def with_poses(model: Model, change: Callable[[Model], Model]) -> Model:
    """Apply a change, which returns a model without animation, to a model and to all poses of its animation."""
    still, animation = change(model), model.animation
    if animation is None:
        return still
    pose = partial(_changed_pose, change, animation.pose)
    return replace(still, animation=replace(animation, base=still, pose=pose))


def _changed_pose(change: Callable[[Model], Model], pose: Callable[[float], Model], seconds: float) -> Model:
    return change(pose(seconds))


def _moved(parts: Sequence[Part], before: Sequence[Part], after: Sequence[Part]) -> list[Part]:
    """Return the parts with those in `before` replaced: one by one if there are as many `after`, each in the material
    of the one before; else by all of these, in the place of the first."""
    numbers = {id(part): number for number, part in enumerate(before)}
    if len(before) == len(after):
        return [_in_material(after[numbers[id(part)]], part) if id(part) in numbers else part for part in parts]
    first = next((number for number, part in enumerate(parts) if id(part) in numbers), len(parts))
    return [*parts[:first], *after, *(part for part in parts[first:] if id(part) not in numbers)]


def _in_material(part: Any, other: Any) -> Any:
    """Return the part, or a copy in the other's material if that is another one."""
    same = isinstance(part, Light) or part.material is other.material
    return part if same else replace(part, material=other.material)
