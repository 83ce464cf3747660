"""What workers are sent to do, with the scene that it is of. Nothing but data: see parcels.py."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from ..rendering.choices import Choices
from ..rendering.options import choices_of, settings_of
from ..scene.model import Camera, Scene


@dataclass(frozen=True)
class Order:
    """A scene to prepare for shares of its picture. asked, lanes: see `choices_on`; planned_spp: see
    `session.block_bits`; devices: a worker's devices that are meant; none for its best one; simulated: samples a second
    of a worker that only sleeps (simulated.py)."""

    scene: Scene
    asked: Choices
    lanes: int | None
    planned_spp: int | None
    devices: tuple[str | int, ...] = ()
    simulated: float | None = None


@dataclass(frozen=True)
class PictureOrder:
    """A whole picture. camera: instead of the scene's; options: of `Renderer`; spp, time, error: of its
    `passes`; denoise: whether to; band: rows first … end − 1 of its tiles alone."""

    scene: Scene
    options: dict[str, Any] = field(default_factory=dict)
    spp: int | None = None
    time: float | None = None
    error: float | None = None
    denoise: bool = False
    band: tuple[int, int] | None = None
    camera: Camera | None = None

    @property
    def settled(self) -> Scene:
        """The scene with those options that are settings of it."""
        return replace(self.scene, camera=self.camera or self.scene.camera,
                       render=settings_of(self.scene.render, self.options))

    @property
    def choices(self) -> Choices:
        """What the options choose about the program."""
        return choices_of(self.options)
