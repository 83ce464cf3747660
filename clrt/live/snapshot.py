"""What an interactive picture looks like now, and how it is coming along."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..scene.model import Scene
from .settings import Settings

#: "start": nothing yet; "build": packing, tree; "compile": program, upload; "render"; "rest": all samples are there, or
#: there is an error, or nothing to do until a movement goes on or ends.
Phase = Literal["start", "build", "compile", "render", "rest"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Snapshot:
    """The newest picture. Nothing in it changes any more, so it may be kept and read by any thread.

    number: how many pictures there were before it. pixels: (height, width, 3) float32, linear Rec. 709, smaller than
    `size`, (width, height), while things move; denoised: likewise, of these
    samples or some before, if there is such. spp: samples a pixel; seconds:
    that they took; noise: estimated √relMSE, or None; history: the same as samples grew, {spp, seconds, noise} each.
    scene, settings: what the picture shows, and `asked` which edit or choice that was (Live.asked); error: why
    what was asked for last is not shown, or None.
    frames_per_second: pictures in the last second. rays_per_second: of this picture. device: its name; device_bytes:
    memory there; tree: as the report's `bvh`; features: what is compiled in;
    programs: how often another program was needed than before.
    """

    scene: Scene
    settings: Settings
    pixels: NDArray[np.float32]
    size: tuple[int, int]
    denoised: NDArray[np.float32] | None = None
    number: int = 0
    asked: int = 0
    spp: int = 0
    seconds: float = 0.0
    noise: float | None = None
    history: list[dict[str, Any]] = field(default_factory=list)
    frames_per_second: float = 0.0
    rays_per_second: float = 0.0
    device: str = ""
    device_bytes: int = 0
    tree: dict[str, Any] = field(default_factory=dict)
    features: list[str] = field(default_factory=list)
    programs: int = 0
    phase: Phase = "start"
    error: str | None = None

    @property
    def shown(self) -> NDArray[np.float32]:
        """The denoised pixels where there are such, else the pixels."""
        return self.pixels if self.denoised is None else self.denoised
