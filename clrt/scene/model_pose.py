"""Static scenes of an animated model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

from .animation import ModelAnimation
from .lights import Light
from .model import Instance, Mesh, Model, Scene

Part = TypeVar("Part", Mesh, Instance)


def posed(scene: Scene, animation: ModelAnimation, seconds: float) -> Scene:
    """Return the static scene at a time: the model's meshes, instances, lights and cameras are moved.

    Everything else stays, as do the materials that the scene's meshes have. The camera moves if it is the model's.
    """
    base, model = animation.base, animation.pose(seconds)
    name = next((name for name, camera in base.cameras.items() if camera is scene.camera), None)
    return replace(
        scene,
        meshes=_moved(scene.meshes, base.meshes, model.meshes),
        instances=_moved(scene.instances, base.instances, model.instances),
        lights=_moved_lights(scene.lights, base, model),
        cameras={**scene.cameras, **model.cameras},
        camera=scene.camera if name is None else model.cameras.get(name, scene.camera),
        animation=None,
    )


def _moved(parts: Sequence[Part], before: Sequence[Part], after: Sequence[Part]) -> list[Part]:
    """Return the parts with those in `before` replaced, one by one if there are as many `after`."""
    if len(before) != len(after):
        replaced = {id(part) for part in before}
        return list(after) + [part for part in parts if id(part) not in replaced]
    new = {id(old): each for old, each in zip(before, after)}
    return [replace(new[id(part)], material=part.material) if id(part) in new else part for part in parts]


def _moved_lights(lights: Sequence[Light], base: Model, model: Model) -> list[Light]:
    old = {id(light) for light in base.lights}
    return [*model.lights, *(light for light in lights if id(light) not in old)] if base.lights else list(lights)
