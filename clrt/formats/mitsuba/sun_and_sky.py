"""Mitsuba's sun and sky, which are by Hosek and Wilkie as clrt's are. Mitsuba 0.x has them as emitters of their own,
too."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from math import asin, cos, degrees, radians, sin

import numpy as np

from ...errors import ObjectError, SceneError
from ...scene.geometry.transform import unit
from ...scene.lights import DirectionalLight, Light
from ...scene.model import Environment
from ...scene.sky.hosek_wilkie import SUN_DEGREES
from ...scene.sky.sky import Sky
from ...scene.sky.sky_image import sky_image
from ...scene.sky.sun_position import sun_position
from ..images.turned_environment import TURN
from ..scene_parts.notes import Notes
from .values import Doubles, rgb
from .xml import Plugin

KINDS = ("sky", "sun", "sunsky")
#: Mitsuba's default place and time, in Tokyo.
PLACE = {"latitude": 35.6894, "longitude": 139.6917, "timezone": 9.0}
DATE, CLOCK = {"year": 2010, "month": 7, "day": 10}, {"hour": 15.0, "minute": 0.0, "second": 0.0}
#: Parameters without effect on the light.
UNUSED = {"sampling_weight", "resolution"}


def sun_and_sky(plugin: Plugin, notes: Notes) -> tuple[Environment | None, list[Light]]:
    """Read a sky, a sun, or both; neither if the sun is below the horizon."""
    plugin.used |= UNUSED
    turbidity = plugin.value("turbidity", float, 3.0)
    strength = plugin.value("scale", float, 1.0)
    albedo = rgb(plugin.color("albedo", 0.3), bounded=True)
    size = plugin.value("sun_aperture", float, SUN_DEGREES) * plugin.value("sun_radius_scale", float, 1.0)
    turn = _turn(plugin)
    towards, zenith = _direction(plugin, turn), turn[:, 2]
    elevation = asin(min(max(float(towards @ zenith), -1.0), 1.0))
    if plugin.kind != "sky":
        notes.differ(plugin, "its sun is a disc of even radiance, as bright as in Mitsuba 3's spectral variants")
    if elevation < 0:
        notes.differ(plugin, f"its sun is {-degrees(elevation):.3g} degrees below the horizon, so it is black")
        return None, []
    upright = abs(zenith[1] - 1) < TURN
    try:
        sky = Sky(
            sun_direction=tuple(towards.tolist()) if upright else (cos(elevation), sin(elevation), 0.0),
            turbidity=turbidity,
            albedo=albedo,
            ground=False,
            sky_strength=strength * plugin.value("sky_scale", float, 1.0),
            sun_strength=strength * plugin.value("sun_scale", float, 1.0) * (plugin.kind != "sky"),
            sun_angle_degrees=size,
        )
    except ObjectError as error:
        raise SceneError(error.named(f"{plugin.at}: sky")) from None
    if upright:
        return None if plugin.kind == "sun" else sky.environment(), sky.lights()
    x, y, z = (-towards).tolist()
    suns = [replace(sun, direction=(x, y, z)) for sun in sky.lights() if isinstance(sun, DirectionalLight)]
    image = sky_image(towards, zenith, turbidity, albedo)
    return None if plugin.kind == "sun" else Environment(image=image, strength=sky.sky_strength), [*suns]


def _turn(plugin: Plugin) -> Doubles:
    """Return (3, 3): unit vectors of the sky's axes x, y and, to the zenith, z in the scene, as columns."""
    linear = plugin.transform("to_world")[:3, :3]
    lengths = np.linalg.norm(linear, axis=0)
    if not lengths.all():
        plugin.refuse("its to_world is singular", "only rotate it", "sky that is flat")
    return np.asarray(linear / lengths)


def _direction(plugin: Plugin, turn: Doubles) -> Doubles:
    """Return the unit vector to the sun, as given, or by place and time. With these, Mitsuba's +x is south and its +y
    is west, a mirror image of the compass."""
    given = plugin.point("sun_direction")
    if given is not None and any(given):
        return unit(np.array(given))
    latitude, longitude, zone = (plugin.value(name, float, default) for name, default in PLACE.items())
    year, month, day = (plugin.value(name, int, default) for name, default in DATE.items())
    hour, minute, second = (plugin.value(name, float, default) for name, default in CLOCK.items())
    try:
        midnight = datetime(year, month, day, tzinfo=UTC)
        time = midnight + timedelta(hours=hour - zone, minutes=minute, seconds=second)
    except (ValueError, OverflowError) as error:
        raise SceneError(f"{plugin.at}: {year}-{month}-{day} is not a date: {error}; write another") from None
    elevation, azimuth = map(radians, sun_position(time, latitude, longitude))
    return turn @ [-cos(elevation) * cos(azimuth), -cos(elevation) * sin(azimuth), sin(elevation)]
