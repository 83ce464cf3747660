"""The analytic sky: sky and sun by time and place, or by the sun's direction."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import datetime, timedelta, timezone
from math import asin, atan2, cos, degrees, pi, radians, sin
from typing import Annotated

import numpy as np

from ...errors import ObjectError, SceneError
from ..fields.field_types import show
from ..fields.group_name import GroupName
from ..fields.limits import Ge, Le
from ..fields.validated import Validated
from ..geometry.transform import unit
from ..lights import DirectionalLight, Light
from ..materials.textures import NonNegative
from ..model import Environment, Scene, Vector
from .hosek_wilkie import SUN_DEGREES, sun_irradiance
from .sky_image import horizontal_irradiance, sky_image
from .sun_position import SunPosition, sun_position

Fraction = Annotated[float, Ge(0), Le(1)]
PLACE = ("time", "latitude", "longitude")
#: What a given direction of the sun replaces.
OF_PLACE = (*PLACE, "rotation_degrees", "hours_per_second")
UP = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True, kw_only=True)
class Sky(Validated):
    """A clear sky and its sun, by Hosek and Wilkie (2012, 2013): an environment map and a directional light.

        sky = clrt.Sky(time=datetime.fromisoformat("2026-06-21T17:00+02:00"), latitude=52.5, longitude=13.4)
        scene = clrt.Scene(meshes=[...], environment=sky.environment(), lights=sky.lights())

    Radiance is in W·m⁻²·sr⁻¹ per nanometer: times 683·106.857 lm·nm/W, the luminance is in cd/m². Raises SceneError
    for values out of range, and if the sun is below the horizon, where the model ends.

    - sun_direction: towards the sun, of any length; +Y is up. Or else time and place:
    - time: with an offset from UTC. latitude, longitude: degrees, north and east above 0. Refraction is ignored.
    - rotation_degrees: rotates the points of the compass about +Y, counter-clockwise seen from above; at 0, −Z is north
      and +X is east.
    - turbidity: of the air, 1 to 10: 2 is very clear, 3 clear, 6 hazy. albedo: of the ground; it brightens the sky.
    - ground: whether the lower half is the ground of this albedo, as sky and sun light it, or black.
    - sky_strength, sun_strength: factors; 0 leaves one out.
    - sun_angle_degrees: the angular diameter of the sun's disc, which does not change its irradiance.
    - light_group, sun_light_group: names of the layers that their light is stored in (docs/light-groups.md); the sun is
      in the sky's group if it has none of its own.
    - hours_per_second: in the frames of an animation, how fast `time` passes from frame 0 on.
    """

    sun_direction: Vector | None = None
    time: datetime | None = None
    latitude: Annotated[float, Ge(-90), Le(90)] | None = None
    longitude: Annotated[float, Ge(-180), Le(180)] | None = None
    rotation_degrees: float = 0.0
    turbidity: Annotated[float, Ge(1), Le(10)] = 3.0
    albedo: tuple[Fraction, Fraction, Fraction] = (0.3, 0.3, 0.3)
    ground: bool = True
    sky_strength: NonNegative = 1.0
    sun_strength: NonNegative = 1.0
    sun_angle_degrees: Annotated[float, Ge(0), Le(90)] = SUN_DEGREES
    hours_per_second: float = 0.0
    light_group: GroupName = ""
    sun_light_group: GroupName = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.time is not None:  # without the time zone's name, which is not data
            offset = timezone(self.time.utcoffset() or timedelta())
            object.__setattr__(self, "time", self.time.replace(tzinfo=offset))
        if self.position.elevation < 0:
            below = f"is {-self.position.elevation:.3g} degrees below the horizon, where the model ends; write one"
            fault = (
                f".sun_direction: {show(self.sun_direction)} {below} above it"
                if self.time is None
                else f".time: at {show(self.time)} the sun {below} when it is up"
            )
            raise ObjectError(self.title, [fault])

    @property
    def position(self) -> SunPosition:
        """Return the sun's elevation and azimuth in degrees, the azimuth as if −Z were north for `sun_direction`."""
        if self.sun_direction is None:
            assert self.time is not None and self.latitude is not None and self.longitude is not None
            return sun_position(self.time, self.latitude, self.longitude)
        x, y, z = self.towards_sun
        return SunPosition(degrees(asin(min(max(y, -1.0), 1.0))), degrees(atan2(x, -z)) % 360)

    @property
    def towards_sun(self) -> Vector:
        """Return the unit vector to the sun."""
        if self.sun_direction is not None:
            x, y, z = unit(np.array(self.sun_direction)).tolist()
            return x, y, z
        elevation, azimuth = map(radians, self.position)
        azimuth -= radians(self.rotation_degrees)
        return cos(elevation) * sin(azimuth), sin(elevation), -cos(elevation) * cos(azimuth)

    def after(self, seconds: float) -> Sky:
        """Return the sky at another time of an animation. Raises SceneError if the sun has set or not risen."""
        try:
            passed = timedelta(hours=self.hours_per_second * seconds)
            return self if self.time is None else replace(self, time=self.time + passed)
        except OverflowError:
            fast = f"{self.hours_per_second:g} hours per second lead to no date after {seconds:g} s"
            raise SceneError(f"sky.hours_per_second: {fast}; write a smaller number") from None

    def environment(self) -> SkyEnvironment:
        """Return the sky without the sun's disc, as an environment map."""
        image = sky_image(np.array(self.towards_sun), UP, self.turbidity, self.albedo) * np.float32(self.sky_strength)
        if self.ground:
            towards = sin(radians(self.position.elevation))
            irradiance = horizontal_irradiance(image) + towards * np.array(self.irradiance)
            image[len(image) // 2 :] = np.array(self.albedo) / pi * irradiance
        return SkyEnvironment(image=image, light_group=self.light_group, sky=self)

    def lights(self) -> list[Light]:
        """Return the sun; an empty list if it does not shine."""
        x, y, z = self.towards_sun
        sun: Light = DirectionalLight(
            direction=(0 - x, 0 - y, 0 - z),
            irradiance=self.irradiance,
            angle_degrees=self.sun_angle_degrees,
            light_group=self.sun_light_group or self.light_group,
        )
        return [] if sun.is_black else [sun]

    @property
    def irradiance(self) -> Vector:
        """Return the sun's irradiance on a surface that faces it."""
        red, green, blue = (self.sun_strength * sun_irradiance(self.position.elevation, self.turbidity)).tolist()
        return red, green, blue

    def faults(self) -> list[str]:
        return super().faults() or list(self._place_faults())

    def _place_faults(self) -> Iterator[str]:
        given = [name for name in PLACE if getattr(self, name) is not None]
        if self.sun_direction is None:
            missing = [name for name in PLACE if name not in given]
            if not given:
                yield ": has no sun; write time, latitude and longitude, or sun_direction"
            elif missing:
                yield f": {' and '.join(missing)} {'is' if len(missing) == 1 else 'are'} missing; add what is"
        elif also := [name for name in OF_PLACE if getattr(self, name) != getattr(Sky, name)]:
            yield f": has both a sun_direction and {also[0]}; keep one of them"
        elif not any(self.sun_direction):
            yield ".sun_direction: [0, 0, 0] is not a direction; write the one towards the sun"
        if self.time is not None and self.time.utcoffset() is None:
            yield f".time: {show(self.time)} has no offset from UTC; write one, such as {show(self.time)}+02:00"


@dataclass(eq=False, kw_only=True)
class SkyEnvironment(Environment):
    """Environment map of an analytic sky, which scene files are written with instead of its image."""

    sky: Sky


def moving_sky(scene: Scene) -> Sky | None:
    """Return the scene's sky if its time passes in the frames of an animation."""
    found = scene.environment
    return found.sky if isinstance(found, SkyEnvironment) and found.sky.hours_per_second else None


def with_sky(scene: Scene, old: Sky, new: Sky) -> Scene:
    """Return the scene with its environment, and its sun if that is the first light, as of the new sky."""
    suns, made = old.lights(), new.environment()
    assert isinstance(scene.environment, SkyEnvironment)
    lights = [*new.lights(), *scene.lights[len(suns) :]] if scene.lights[: len(suns)] == suns else scene.lights
    return replace(scene, environment=replace(scene.environment, image=made.image, sky=new), lights=lights)
