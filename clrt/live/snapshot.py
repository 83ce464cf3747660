"""Snapshot of an interactive image and of its progress."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..scene.model import Scene
from .settings import Settings

#: "start": nothing yet; "build": packing, BVH build; "compile": program build, upload; "render"; "rest": all samples
#: are rendered, or there is an error, or nothing to do until a movement continues or ends.
Phase = Literal["start", "build", "compile", "render", "rest"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Snapshot:
    """Newest image. It is immutable, so it may be kept and read by any thread.

    number: how many images preceded it. pixels: (height, width, 3) float32, linear Rec. 709, smaller than `size`,
    (width, height), during movements; denoised: likewise, of these samples or an earlier state, if available. alpha:
    (height, width) float32, the coverage of a transparent image, whose pixels are premultiplied, else None. spp:
    samples per pixel; seconds: their rendering time; noise: estimated √relMSE, or None; history: the same as samples
    grew, {spp, seconds, noise} each. scene, settings: those of the image, and `asked` the number of their edit or
    choice (Live.asked); error: why the newest request is not shown, or None. frames_per_second: images in the last
    second. rays_per_second: of this image. device: its name; device_bytes: memory used there; tree: like the report's
    `bvh`; features: those compiled in; programs: number of program changes.
    """

    scene: Scene
    settings: Settings
    pixels: NDArray[np.float32]
    size: tuple[int, int]
    denoised: NDArray[np.float32] | None = None
    alpha: NDArray[np.float32] | None = None
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
        """The denoised pixels if available, else the pixels."""
        return self.pixels if self.denoised is None else self.denoised
