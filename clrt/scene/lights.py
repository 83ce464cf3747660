"""Lights without a surface: plain data, one dataclass each. A light's samples are from `kernels/light/<kernel>.cl`.

To add one: write its kernel file, write its dataclass here and list it in `Light`, where the scene file, the
validation, the packing, the window and random scenes find it. A name means the same in all types: `position`, the
`direction` in which the light travels, what is `up` in its `image`, the STRENGTHS, and what LENGTHS lists. Area lights
are meshes and spheres with an emissive material; see also `Environment`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from math import atan, degrees, hypot, pi, radians, sin, sqrt, tan
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self, get_args

import numpy as np
from numpy.typing import NDArray

from .fields.group_name import GroupName
from .fields.limits import Ge, Gt, Le, Lt
from .fields.validated import Validated
from .light_images import WHITE_IMAGE, LightImage
from .materials.material import Radiance

Length = Annotated[float, Gt(0)]
Vector = tuple[float, float, float]
Doubles = NDArray[np.float64]
#: What a kernel file reads: numbers, triples, and the image of a light.
Parameter = float | Vector | LightImage

#: Fields that say how bright a light is.
STRENGTHS = ("intensity", "irradiance", "radiance")
#: Fields that depend on the unit of length, and the power of it that multiplies them: W/sr is W/m² at a distance, times
#: its square.
LENGTHS = {"range": 1, "radius": 1, "intensity": 2}
#: Directional lights of a smaller angle are delta lights: float32 has too few directions inside their disc.
SMALLEST_DEGREES = 1e-4
#: Minimum width of a spot's falloff in the cosine, and minimum square of a range: the inverse must fit in float32.
STEEPEST = 1e-30
#: Smallest sine of the angle between the axis of an image and what is up in it.
SLANT = 1e-6


class Bounds(NamedTuple):
    """Bounds of a light, at most `radius` from `center`, for light sampling (kernels/light/importance.cl).

    intensity: W/sr where it is brightest, or that of an image's `typical` pixel. axis: unit, the normal of what emits
    on one side, or the axis of a cone; None for a light that emits in all directions. height: 1 − the cosine of the
    cone's angle, None for a hemisphere; the light then has the feature LIGHT_CONES.
    """

    center: Vector
    intensity: Radiance
    radius: float = 0.0
    axis: Vector | None = None
    height: float | None = None


class DistantBounds(NamedTuple):
    """Irradiance of an infinitely distant light at a normal n: about radiance·projected·(least + n·towards), or 0.

    towards: unit. projected: the projected solid angle, 1 if `radiance` is an irradiance. least: so large that the sum
    is 0 only for normals that receive nothing.
    """

    towards: Vector
    radiance: Radiance
    projected: float = 1.0
    least: float = 0.0


@dataclass(frozen=True, kw_only=True)
class BaseLight(Validated, ABC):
    """Base class of lights. kernel: its type in scene files; distant: whether it is infinitely far away. light_group:
    the name of the layer that its light is stored in (docs/light-groups.md), "" for the rest."""

    kernel: ClassVar[str]
    distant: ClassVar[bool] = False
    light_group: GroupName = ""

    @classmethod
    def kernels(cls) -> tuple[str, ...]:
        """Return the names of all kernel files that sample lights of this type."""
        return (cls.kernel,)

    @property
    def sampled_by(self) -> str:
        """The name of the kernel file that samples this light, one of `kernels`."""
        return self.kernel

    @abstractmethod
    def parameters(self) -> dict[str, Parameter]:
        """Return the values its kernel file reads: numbers and triples; others have 0 for one that only some return."""

    @abstractmethod
    def bounds(self) -> Bounds | DistantBounds:
        """Return its bounds; DistantBounds if it is `distant`."""

    def features(self) -> frozenset[str]:
        """Return the macros to define, for parts of the kernels that only some lights need."""
        return frozenset()

    def conflicts(self) -> list[str]:
        if not any(getattr(self, "direction", (1,))):
            return ["direction: [0, 0, 0] is not a direction; write the one the light travels in"]
        if self.shows is None or upright(self.direction, self.up):  # type: ignore[attr-defined]
            return []
        return ["up: is parallel to the direction, or [0, 0, 0]; write another, such as [0, 0, -1]"]

    @property
    def shows(self) -> LightImage | None:
        """The image that it projects; None for lights without one."""
        return None

    @property
    def is_black(self) -> bool:
        """Whether it emits nothing."""
        dark = self.shows is not None and not self.shows.pixels.any()
        return dark or not any(any(value) for name, value in vars(self).items() if name in STRENGTHS)

    def in_unit(self: Self, unit: float) -> Self:
        """Return the light for a scene whose lengths are all multiplied by `unit`; it is not moved."""
        return replace(
            self,
            **{
                name: _times(value, unit ** LENGTHS[name])
                for name, value in vars(self).items()
                if name in LENGTHS and value is not None
            },
        )


@dataclass(frozen=True, kw_only=True)
class PointLight(BaseLight):
    """Point light. `intensity`: W/sr in every direction from `position`. `range`: distance from which it is zero;
    before, it is reduced by the fraction (distance/range)⁴ (KHR_lights_punctual); None for no limit."""

    kernel: ClassVar[str] = "point"
    position: Vector
    intensity: Radiance
    range: Length | None = None

    def parameters(self) -> dict[str, Parameter]:
        return {"position": self.position, "intensity": self.intensity, "per_range2": _per_range2(self.range)}

    def bounds(self) -> Bounds:
        return Bounds(self.position, self.intensity)

    def features(self) -> frozenset[str]:
        return frozenset({"LIGHT_RANGES"} if self.range else ())


@dataclass(frozen=True, kw_only=True)
class SpotLight(BaseLight):
    """Spot light of `intensity` W/sr in a cone around `direction`.

    It falls from `inner_degrees` to zero at `outer_degrees`. falloff: "cosine" as in glTF's KHR_lights_punctual, or
    linearly in the "angle" as in Mitsuba. `range`: as PointLight's. image: multiplies the intensity; its square touches
    the outer cone, with `up` as far up as possible.
    """

    kernel: ClassVar[str] = "spot"
    position: Vector
    direction: Vector
    intensity: Radiance
    inner_degrees: Annotated[float, Ge(0), Lt(90)] = 0.0
    outer_degrees: Annotated[float, Gt(0), Le(90)] = 45.0
    falloff: Literal["cosine", "angle"] = "cosine"
    range: Length | None = None
    image: LightImage | None = None
    up: Vector = (0.0, 1.0, 0.0)

    @classmethod
    def kernels(cls) -> tuple[str, ...]:
        return "spot", "spot_image"

    @property
    def sampled_by(self) -> str:
        return "spot" if self.image is None else "spot_image"

    @property
    def shows(self) -> LightImage | None:
        return self.image

    def parameters(self) -> dict[str, Parameter]:
        """The slope of a falloff by angle is negative."""
        projection = {} if self.image is None else _projection(self, self.image, tan(radians(self.outer_degrees)))
        scale, sign = (radians, -1) if self.falloff == "angle" else (one_minus_cos, 1)
        inner, outer = scale(self.inner_degrees), scale(self.outer_degrees)
        return {
            "position": self.position,
            "axis": unit_vector(self.direction),
            "intensity": self.intensity,
            "outer": outer,
            "slope": sign / max(outer - inner, STEEPEST),
            "per_range2": _per_range2(self.range),
            **projection,
        }

    def bounds(self) -> Bounds:
        intensity = self.intensity if self.image is None else _typical(self.intensity, self.image)
        return Bounds(
            self.position, intensity, axis=unit_vector(self.direction), height=one_minus_cos(self.outer_degrees)
        )

    def features(self) -> frozenset[str]:
        has = {"LIGHT_CONES": True, "LIGHT_RANGES": self.range, "ANGULAR_SPOTS": self.falloff == "angle"}
        return frozenset(name for name, present in has.items() if present)

    def conflicts(self) -> list[str]:
        fault = (
            f"inner_degrees: {self.inner_degrees:g} is not below outer_degrees, {self.outer_degrees:g}; write a "
            "smaller angle"
        )
        return super().conflicts() + ([] if self.inner_degrees < self.outer_degrees else [fault])


@dataclass(frozen=True, kw_only=True)
class ProjectorLight(BaseLight):
    """Point light that projects an image, white if there is none, along `direction`, with `up` as far up as possible.

    fov_degrees: the image's vertical angle, as a camera's; its pixels are square. intensity: W/sr of white on the axis.
    image_of: the image is proportional to the "irradiance" of a screen perpendicular to the axis, as of a projector of
    slides; the radiant intensity is larger by the cube of 1/cos of the angle from the axis. Or it is proportional to
    the radiant "intensity". `range`: as PointLight's.
    """

    kernel: ClassVar[str] = "projector"
    position: Vector
    direction: Vector
    intensity: Radiance
    image: LightImage | None = None
    up: Vector = (0.0, 1.0, 0.0)
    fov_degrees: Annotated[float, Gt(0), Lt(180)] = 40.0
    image_of: Literal["irradiance", "intensity"] = "irradiance"
    range: Length | None = None

    @property
    def shows(self) -> LightImage:
        return self.image or WHITE_IMAGE

    def parameters(self) -> dict[str, Parameter]:
        return {
            "position": self.position,
            "axis": unit_vector(self.direction),
            "intensity": self.intensity,
            "of_irradiance": float(self.image_of == "irradiance"),
            "per_range2": _per_range2(self.range),
            **_projection(self, self.shows, self._tangent, self.shows.aspect),
        }

    def bounds(self) -> Bounds:
        corner = degrees(atan(self._tangent * hypot(1, self.shows.aspect)))
        axis = unit_vector(self.direction)
        return Bounds(self.position, _typical(self.intensity, self.shows), axis=axis, height=one_minus_cos(corner))

    def features(self) -> frozenset[str]:
        return frozenset({"LIGHT_CONES", "LIGHT_RANGES"} if self.range else {"LIGHT_CONES"})

    @property
    def _tangent(self) -> float:
        return tan(radians(self.fov_degrees) / 2)


@dataclass(frozen=True, kw_only=True)
class GoniometricLight(BaseLight):
    """Point light whose radiant intensity, `intensity` times the image, is measured in all directions.

    image: equirectangular, as an environment map; white if there is none. direction: the center of the image, with `up`
    towards its top. `range`: as PointLight's.
    """

    kernel: ClassVar[str] = "goniometric"
    position: Vector
    intensity: Radiance
    image: LightImage | None = None
    direction: Vector = (0.0, 0.0, 1.0)
    up: Vector = (0.0, 1.0, 0.0)
    range: Length | None = None

    @property
    def shows(self) -> LightImage:
        return self.image or WHITE_IMAGE

    def parameters(self) -> dict[str, Parameter]:
        right, top = image_axes(self.direction, self.up)
        return {
            "position": self.position,
            "axis": unit_vector(self.direction),
            "intensity": self.intensity,
            "per_range2": _per_range2(self.range),
            "right": _vector(right),
            "top": _vector(top),
            "image": self.shows.with_wrap(("repeat", "clamp")),
        }

    def bounds(self) -> Bounds:
        return Bounds(self.position, _typical(self.intensity, self.shows))

    def features(self) -> frozenset[str]:
        return frozenset({"LIGHT_RANGES"} if self.range else ())


@dataclass(frozen=True, kw_only=True)
class DirectionalLight(BaseLight):
    """Light from infinitely far away that travels along `direction`; `irradiance`: W/m² on a surface facing it.

    angle_degrees: the angular diameter of its disc, which is visible to the camera and in reflections and softens
    shadows; 0 (or less than 1e-4) for a delta light, found by shadow rays only. The sun's is 0.53. camera_visible:
    whether the camera sees the disc.
    """

    kernel: ClassVar[str] = "directional"
    distant: ClassVar[bool] = True
    direction: Vector
    irradiance: Radiance
    angle_degrees: Annotated[float, Ge(0), Le(180)] = 0.0
    camera_visible: bool = True

    @classmethod
    def kernels(cls) -> tuple[str, ...]:
        return "directional", "sun"

    @property
    def sampled_by(self) -> str:
        return "sun" if self.angle_degrees >= SMALLEST_DEGREES else "directional"

    @property
    def radiance(self) -> Radiance:
        """Return the disc's radiance, irradiance over projected solid angle, pi sin²(angle/2); not for angle 0."""
        solid_angle = pi * sin(radians(self.angle_degrees) / 2) ** 2
        red, green, blue = (value / solid_angle for value in self.irradiance)
        return red, green, blue

    def parameters(self) -> dict[str, Parameter]:
        towards = unit_vector(self.direction, -1)
        if self.sampled_by == "directional":
            return {"towards": towards, "irradiance": self.irradiance}
        hidden = {} if self.camera_visible else {"camera_hidden": 1.0}
        return {
            "towards": towards,
            "radiance": self.radiance,
            "height": one_minus_cos(self.angle_degrees / 2),
            **hidden,
        }

    def features(self) -> frozenset[str]:
        return frozenset(() if self.camera_visible or self.sampled_by != "sun" else {"HIDDEN_SUNS"})

    def bounds(self) -> DistantBounds:
        """Return an upper bound. The highest point of a disc has elevation h + a, where h is the elevation of its
        center and a half its angle, and sin(h + a) <= sin h + sin a."""
        towards = unit_vector(self.direction, -1)
        if self.sampled_by == "directional":
            return DistantBounds(towards, self.irradiance)
        height = float(np.float32(one_minus_cos(self.angle_degrees / 2)))  # the disc that the kernel samples
        sine2 = height * (2 - height)
        return DistantBounds(towards, self.radiance, pi * sine2, sqrt(sine2))


#: Every type of light.
Light = PointLight | SpotLight | ProjectorLight | GoniometricLight | DirectionalLight
LIGHTS: tuple[type[Light], ...] = get_args(Light)


def fields_of(kind: type[Light], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return those of the values, by name, that are fields of a type of light."""
    return {field.name: values[field.name] for field in fields(kind) if field.name in values}


def unit_vector(direction: Vector, sign: float = 1) -> Vector:
    """Return the unit vector along a direction, or against it for a sign of −1."""
    along = np.asarray(direction, np.float64)  # numpy has no integers of more than 64 bits
    x, y, z = (sign * along / np.linalg.norm(along)).tolist()
    return x, y, z


def image_axes(direction: Vector, up: Vector) -> tuple[Doubles, Doubles]:
    """Return the unit vectors (3,) to the right and the top of an image that is seen along `direction`."""
    forward = np.array(unit_vector(direction))
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    return right, np.cross(right, forward)


def upright(direction: Vector, up: Vector) -> bool:
    """Return whether `up` is a direction that is not parallel to another one."""
    return any(up) and float(np.linalg.norm(np.cross(unit_vector(direction), unit_vector(up)))) > SLANT


def one_minus_cos(degrees: float) -> float:
    """Return 1 − cos x as 2 sin² (x/2), which is accurate for small angles."""
    return float(2 * np.sin(np.radians(degrees) / 2) ** 2)


def _projection(
    light: SpotLight | ProjectorLight, image: LightImage, tangent: float, aspect: float = 1.0
) -> dict[str, Parameter]:
    """Return the parameters of an image seen along the axis (kernels/light/image.cl). tangent: of half its
    vertical angle; aspect: width over height."""
    right, top = image_axes(light.direction, light.up)
    across, upwards = _vector(right / (tangent * aspect)), _vector(top / tangent)
    return {"across": across, "upwards": upwards, "image": image.with_wrap(("clamp", "clamp"))}


def _typical(intensity: Radiance, image: LightImage) -> Radiance:
    """Return the typical intensity: for a mean over all directions the probabilities of lights proportional to the
    root mean square of what they contribute have the least variance."""
    red, green, blue = (image.typical * intensity).tolist()
    return red, green, blue


def _vector(row: Doubles) -> Vector:
    x, y, z = row.tolist()
    return x, y, z


def _per_range2(reach: float | None) -> float:
    return 0.0 if reach is None else 1 / max(reach**2, STEEPEST)


def _times(value: Any, factor: float) -> Any:
    return tuple(factor * part for part in value) if isinstance(value, tuple) else factor * value
