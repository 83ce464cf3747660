"""Scene compiler for a set of devices; what consecutive scenes have in common is not compiled again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...device.open import Device
from ...scene.exposure import motion_features
from ...scene.model import Scene
from ...scene.validation.validate import validate
from .camera_kernel import camera_file
from .choices import Choices
from .compile_scene import CompiledScene, compile_scene
from .reuse_cache import ReuseCache
from .visible_parts import same_world

#: Settings that affect neither buffers nor programs.
PASSING = ("size", "spp", "max_depth", "seed", "adaptive")


class SceneCompiler:
    """Compiler for several devices. A compiled scene must not be used any more once another one is compiled."""

    def __init__(self, devices: Sequence[Device]) -> None:
        self.devices = list(devices)
        self._carried = [ReuseCache() for _ in devices]
        self._last: tuple[Scene, Choices, list[CompiledScene]] | None = None

    @classmethod
    def after(cls, last: SceneCompiler | None, devices: Sequence[Device]) -> SceneCompiler:
        """Return the last compiler if it is for the same devices, else a new one."""
        return last if last and last.devices == devices else cls(devices)

    def compile(self, scene: Scene, choices: Choices, ahead: bool = False) -> list[CompiledScene]:
        """Return the scene compiled for each device; ahead: see `compile_scene`.

        If everything but the camera and PASSING settings is the identical object as before, only these are updated.
        """
        if self._last and choices == self._last[1] and _differs_in_passing(scene, self._last[0]):
            validate(Scene(camera=scene.camera, render=scene.render))
            file = camera_file(scene.camera, scene.render.integrator)
            compiled = [each.seen_by(scene.camera, file) for each in self._last[2]]
        else:
            self._last = None
            compiled = self._anew(scene, choices, ahead)
        self._last = scene, choices, compiled
        return compiled

    def _anew(self, scene: Scene, choices: Choices, ahead: bool) -> list[CompiledScene]:
        """Compile once for devices with equal properties, unless BVHs were built on a device."""
        compiled: list[CompiledScene] = []
        for device, carried in zip(self.devices, self._carried):
            alike = [
                done
                for done, other in zip(compiled, self.devices)
                if done.choices == choices.on(device)
                and (other.layout, other.info.max_alloc_bytes) == (device.layout, device.info.max_alloc_bytes)
                and all(isinstance(array, np.ndarray) for _, array in done.buffers.values())
            ]
            compiled.append(
                alike[0] if alike else compile_scene(scene, choices, device=device, carried=carried, ahead=ahead)
            )
        return compiled


def _differs_in_passing(scene: Scene, last: Scene) -> bool:
    """Return whether at most the camera and PASSING settings differ."""
    passing = {name: getattr(last.render, name) for name in PASSING}
    return (
        same_world(scene, last)
        and replace(scene.render, **passing) == last.render
        and motion_features(scene) == motion_features(last)
    )
