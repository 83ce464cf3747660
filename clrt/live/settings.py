"""Settings of interactive rendering that are not part of the scene, whose own settings are edited with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

from ..errors import UsageError

Selector = str | int | Sequence[str | int] | None
#: Settings that are not passed to the renderer, or not by the same name.
OWN = {"device", "scale", "frame_rate", "samples", "denoise"}


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Settings for rendering the newest scene; integrator, depth, size and end (`spp`) are those of `scene.render`.

    device: see `clrt devices`; tree, builder, layout, triangle: see `rendering.renderer.Renderer`. scale: factor for
    width and height. frame_rate: target images per second during movements, for which the resolution is reduced as far
    as needed; 0: never. samples: samples per pixel of each of these. denoise: whether an image at rest is denoised.
    Raises UsageError.
    """

    device: Selector = None
    tree: bool | None = None
    builder: str | None = None
    layout: str | None = None
    triangle: str = "watertight"
    scale: float = 1.0
    frame_rate: float = 20.0
    samples: int = 1
    denoise: bool = False

    def __post_init__(self) -> None:
        for name, value, least, most in (
            ("scale", self.scale, 0.01, 4.0),
            ("frame_rate", self.frame_rate, 0, 1000),
            ("samples", self.samples, 1, 1 << 20),
        ):
            if not least <= value <= most:
                raise UsageError(f"{name} is {value:g}; it must be {least:g} to {most:g}")

    @property
    def tracing(self) -> dict[str, Any]:
        """Settings that a Renderer takes by the same names."""
        return {field.name: getattr(self, field.name) for field in fields(self) if field.name not in OWN}

    def size_of(self, size: tuple[int, int]) -> tuple[int, int]:
        """Return a scene's (width, height), scaled."""
        return scaled(size, self.scale)


def scaled(size: tuple[int, int], factor: float) -> tuple[int, int]:
    """Return (width, height) times a factor, at least 1 pixel each."""
    return max(1, round(size[0] * factor)), max(1, round(size[1] * factor))
