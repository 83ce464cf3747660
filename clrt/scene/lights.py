"""Lights without a surface. (Meshes and spheres shine by their material's emission; the sky is the Environment.)"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from .materials import Radiance, tuples_for_lists


@dataclass(frozen=True, kw_only=True)
class PointLight:
    """`intensity`: W/sr in every direction from `position`."""

    kernel: ClassVar[str] = "point"
    position: tuple[float, float, float]
    intensity: Radiance

    def __post_init__(self) -> None:
        tuples_for_lists(self)


@dataclass(frozen=True, kw_only=True)
class DirectionalLight:
    """Parallel light that travels along `direction`; `irradiance`: W/m² on a surface facing it."""

    kernel: ClassVar[str] = "directional"
    direction: tuple[float, float, float]
    irradiance: Radiance

    def __post_init__(self) -> None:
        tuples_for_lists(self)


Light = PointLight | DirectionalLight
LIGHTS: tuple[type[Light], ...] = (PointLight, DirectionalLight)
