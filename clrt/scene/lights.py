"""Lights without a surface. Area lights are meshes and spheres with an emissive material; see also `Environment`."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, radians, sin
from typing import Annotated, ClassVar

from .materials.material import Radiance, tuples_for_lists
from .validation.limits import Ge, Gt, Le, Lt

Length = Annotated[float, Gt(0)]


@dataclass(frozen=True, kw_only=True)
class PointLight:
    """Point light. `intensity`: W/sr in every direction from `position`. `range`: distance from which it is zero;
    before, it is reduced by the fraction (distance/range)⁴ (KHR_lights_punctual); None for no limit."""

    kernel: ClassVar[str] = "point"
    position: tuple[float, float, float]
    intensity: Radiance
    range: Length | None = None

    def __post_init__(self) -> None:
        tuples_for_lists(self)


@dataclass(frozen=True, kw_only=True)
class DirectionalLight:
    """Light from infinitely far away that travels along `direction`; `irradiance`: W/m² on a surface facing it.

    angle_degrees: the angular diameter of its disc, which is visible to the camera and in reflections and softens
    shadows; 0 (or less than 1e-4) for a delta light, found by shadow rays only. The sun's is 0.53.
    """

    kernel: ClassVar[str] = "directional"
    direction: tuple[float, float, float]
    irradiance: Radiance
    angle_degrees: Annotated[float, Ge(0), Le(180)] = 0.0

    def __post_init__(self) -> None:
        tuples_for_lists(self)

    @property
    def radiance(self) -> Radiance:
        """Return the disc's radiance, irradiance over projected solid angle, pi sin²(angle/2); not for angle 0."""
        solid_angle = pi * sin(radians(self.angle_degrees) / 2) ** 2
        red, green, blue = (value / solid_angle for value in self.irradiance)
        return red, green, blue


@dataclass(frozen=True, kw_only=True)
class SpotLight:
    """Spot light of `intensity` W/sr in a cone around `direction`.

    It falls from `inner_degrees` to zero at `outer_degrees` as in glTF's KHR_lights_punctual. `range`: as PointLight's.
    """

    kernel: ClassVar[str] = "spot"
    position: tuple[float, float, float]
    direction: tuple[float, float, float]
    intensity: Radiance
    inner_degrees: Annotated[float, Ge(0), Lt(90)] = 0.0
    outer_degrees: Annotated[float, Gt(0), Le(90)] = 45.0
    range: Length | None = None

    def __post_init__(self) -> None:
        tuples_for_lists(self)


Light = PointLight | SpotLight | DirectionalLight
LIGHTS: tuple[type[Light], ...] = (PointLight, SpotLight, DirectionalLight)
