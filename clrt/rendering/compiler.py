"""Compiles scenes for devices, one after another: what a scene shares with the one before is not made again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..device.open import Device
from ..scene.model import Scene
from ..scene.validate import validate
from .camera import camera_file
from .carried import Carried
from .choices import Choices
from .compile import CompiledScene, compile_scene
from .identity import parts_of

#: Settings that change neither buffers nor programs.
PASSING = ("size", "spp", "max_depth", "seed", "adaptive")


class Compiler:
    """For so many devices. What it compiled is of no use any more once it compiles another scene."""

    def __init__(self, devices: Sequence[Device]) -> None:
        self.devices = list(devices)
        self._carried = [Carried() for _ in devices]
        self._last: tuple[Scene, list[Choices], list[CompiledScene]] | None = None

    @classmethod
    def after(cls, last: Compiler | None, devices: Sequence[Device]) -> Compiler:
        """The last one, if it is for these devices, or another."""
        return last if last and last.devices == devices else cls(devices)

    def compile(self, scene: Scene, choices: list[Choices], ahead: bool = False) -> list[CompiledScene]:
        """The scene for each device with its choices; ahead: see `compile_scene`.

        Where all but the camera and PASSING settings are the very same objects as before, only these are looked at.
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

    def _anew(self, scene: Scene, choices: list[Choices], ahead: bool) -> list[CompiledScene]:
        """Once for those devices that agree, unless trees were built on a device."""
        compiled: list[CompiledScene] = []
        for choice, device, carried in zip(choices, self.devices, self._carried):
            alike = [done for done, other, chosen in zip(compiled, self.devices, choices) if chosen == choice
                     and (other.layout, other.info.max_alloc_bytes) == (device.layout, device.info.max_alloc_bytes)
                     and all(isinstance(array, np.ndarray) for _, array in done.buffers.values())]
            compiled.append(alike[0] if alike else compile_scene(scene, choice, device=device, carried=carried,
                                                                 ahead=ahead))
        return compiled


def _differs_in_passing(scene: Scene, last: Scene) -> bool:
    """Whether no more than the camera and PASSING settings differ."""
    passing = {name: getattr(last.render, name) for name in PASSING}
    return (all(getattr(scene, name) is getattr(last, name) for name in parts_of(scene) if name != "camera")
            and replace(scene.render, **passing) == last.render)
