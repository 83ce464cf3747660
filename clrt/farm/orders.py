"""Work orders sent to workers, with their scene. Plain data only: see serialization.py."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from ..device.open import Device, Selectors
from ..errors import UsageError
from ..rendering.compile.choices import Choices
from ..rendering.renderer_options import choices_of, settings_of
from ..scene.model import Camera, Scene


@dataclass(frozen=True)
class Order:
    """A scene to prepare for rendering shares of its image.

    choices: resolved by each worker for its devices; planned_spp: see `launch_plan.block_bits`; devices: selectors of a
    worker's devices, none for its best one; simulated: samples per second of a worker that only sleeps
    (simulated_workers.py).
    """

    scene: Scene
    choices: Choices
    planned_spp: int | None
    devices: tuple[str | int, ...] = ()
    simulated: float | None = None


@dataclass(frozen=True)
class PictureOrder:
    """A whole image.

    camera: replaces the scene's; options: of `Renderer`; spp, time, error: of its `passes`; denoise: whether to
    denoise; band: only tile rows first … end − 1; lit: whether to render more than its AOVs of first hits.
    """

    scene: Scene
    options: dict[str, Any] = field(default_factory=dict)
    spp: int | None = None
    time: float | None = None
    error: float | None = None
    denoise: bool = False
    band: tuple[int, int] | None = None
    camera: Camera | None = None
    lit: bool = True

    @property
    def settled(self) -> Scene:
        """Return the scene with those options applied that are render settings."""
        return replace(
            self.scene, camera=self.camera or self.scene.camera, render=settings_of(self.scene.render, self.options)
        )

    @property
    def choices(self) -> Choices:
        """Return the program choices among the options."""
        return choices_of(self.options)


def worker_selectors(device: Selectors) -> tuple[str | int, ...]:
    """Return the selectors among each worker's devices; none for its best one. Raises UsageError for opened devices."""
    given = [] if device is None else [device] if isinstance(device, str | int | Device) else list(device)
    selectors = tuple(each for each in given if isinstance(each, str | int))
    if len(selectors) < len(given):
        raise UsageError("a farm renders on its workers' devices; give their names instead of opened devices")
    return selectors
