"""Stand-ins for Mitsuba's sun and sky, which are by Hosek and Wilkie: those of Preetham et al. (1999), "A Practical
Analytic Model for Daylight", in W·m⁻²·nm⁻¹, with factors that fit the irradiance of Mitsuba 3.9's within 30 % for
turbidities from 3 to 8 and elevations of the sun from 20° to 70°."""

from __future__ import annotations

from math import asin, cos, pi, radians, sin, tan

import numpy as np

from ...scene.geometry.transform import unit
from ...scene.lights import DirectionalLight
from ...scene.model import Environment, FloatArray
from ...scene.spectra import RGB_FROM_XYZ
from ..scene_parts.notes import Notes
from .values import Doubles
from .xml import Plugin

KINDS = ("sky", "sun", "sunsky")
#: Rows of the environment map.
ROWS = 256
#: cd/m² of a radiance of 1 W·m⁻²·sr⁻¹·nm⁻¹: 683 lm/W times the integral of the color matching function in nm.
LUMINANCE = 683 * 106.857
#: Perez' coefficients A to E of the luminance Y and the chromaticities x and y: slope and offset by turbidity.
PEREZ = np.array(
    [
        [(0.1787, -1.4630), (-0.3554, 0.4275), (-0.0227, 5.3251), (0.1206, -2.5771), (-0.0670, 0.3703)],
        [(-0.0193, -0.2592), (-0.0665, 0.0008), (-0.0004, 0.2125), (-0.0641, -0.8989), (-0.0033, 0.0452)],
        [(-0.0167, -0.2608), (-0.0950, 0.0092), (-0.0079, 0.2102), (-0.0441, -1.6537), (-0.0109, 0.0529)],
    ]
)
#: Chromaticities x and y of the zenith: rows by falling powers of turbidity, columns of the sun's angle from it.
ZENITH = np.array(
    [
        [
            (0.00166, -0.00375, 0.00209, 0),
            (-0.02903, 0.06377, -0.03202, 0.00394),
            (0.11693, -0.21196, 0.06052, 0.25886),
        ],
        [
            (0.00275, -0.00610, 0.00317, 0),
            (-0.04214, 0.08970, -0.04153, 0.00516),
            (0.15346, -0.26756, 0.06670, 0.26688),
        ],
    ]
)
#: Wavelengths of red, green and blue in µm, and the sun's irradiance outside the atmosphere in W·m⁻²·nm⁻¹, fitted.
WAVELENGTHS, SOLAR = np.array([0.611, 0.549, 0.464]), np.array([1.69, 1.49, 1.31])
#: Fitted extinction by aerosols, by slope and offset of turbidity, and fitted factor of the sky's radiance.
AEROSOLS, SKY = (0.0168, -0.0325), 0.57
#: The sun's angular diameter in degrees, and its lowest elevation as a cosine from the zenith.
SUN_DEGREES, LOWEST = 0.5358, 0.02
#: Defaults of Mitsuba: the place and time of the sun, in Tokyo.
PLACE = {"latitude": 35.689, "longitude": 139.6917, "timezone": 9.0}
TIME = {"year": 2010, "month": 7, "day": 10, "hour": 15.0, "minute": 0.0, "second": 0.0}


def sun_and_sky(plugin: Plugin, notes: Notes) -> tuple[Environment | None, DirectionalLight | None]:
    """Read a sky, a sun, or both. Raises UnsupportedError unless they may be replaced."""
    known = "constant, envmap and directional"
    what = f'emitter type "{plugin.kind}" is not supported'
    notes.instead(plugin, what, f"use {known}", "the daylight of Preetham et al. is used")
    plugin.ignore()
    turbidity = min(max(plugin.value("turbidity", float, 3.0), 1.7), 10.0)
    strength = plugin.value("scale", float, 1.0)
    turn = _turn(plugin)
    towards = _direction(plugin, turn)
    sky = sun = None
    if plugin.kind != "sun":
        image = sky_image(towards, turn[:, 2], turbidity)
        sky = Environment(image=image, strength=strength * plugin.value("sky_scale", float, 1.0))
    if plugin.kind != "sky":
        irradiance = (
            strength * plugin.value("sun_scale", float, 1.0) * sun_irradiance(float(towards @ turn[:, 2]), turbidity)
        )
        red, green, blue = irradiance.tolist()
        x, y, z = (-towards).tolist()
        size = plugin.value("sun_aperture", float, SUN_DEGREES) * plugin.value("sun_radius_scale", float, 1.0)
        sun = DirectionalLight(
            direction=(x, y, z), irradiance=(red, green, blue), angle_degrees=min(max(size, 0.0), 90.0)
        )
    return sky, sun


def _turn(plugin: Plugin) -> Doubles:
    """Return (3, 3): unit vectors to the east, the north and the zenith, as columns."""
    linear = plugin.transform("to_world")[:3, :3]
    lengths = np.linalg.norm(linear, axis=0)
    if not lengths.all():
        plugin.refuse("its to_world is singular", "only rotate it", "sky that is flat")
    return np.asarray(linear / lengths)


def _direction(plugin: Plugin, turn: Doubles) -> Doubles:
    """Return the unit vector to the sun, as given, or by place and time to about a degree."""
    given = plugin.point("sun_direction")
    if given is not None and any(given):
        return unit(np.array(given))
    place = {name: plugin.value(name, float, default) for name, default in PLACE.items()}
    hour, minute, second = (plugin.value(name, float, TIME[name]) for name in ("hour", "minute", "second"))
    day = 30.4 * (plugin.value("month", int, 7) - 1) + plugin.value("day", int, 10)
    season = 2 * pi * (day - 81) / 365
    equation = (9.87 * sin(2 * season) - 7.53 * cos(season) - 1.5 * sin(season)) / 60
    solar = hour + minute / 60 + second / 3600 + place["longitude"] / 15 - place["timezone"] + equation
    angle, declination, latitude = radians(15 * (solar - 12)), radians(23.45) * sin(season), radians(place["latitude"])
    up = sin(latitude) * sin(declination) + cos(latitude) * cos(declination) * cos(angle)
    north = cos(latitude) * sin(declination) - sin(latitude) * cos(declination) * cos(angle)
    east = -cos(declination) * sin(angle)
    return np.asarray(turn @ unit(np.array([east, north, up])))


def sky_image(towards: Doubles, zenith: Doubles, turbidity: float) -> FloatArray:
    """Return an environment map (h, w, 3), black below the horizon. towards: unit, to the sun."""
    theta, phi = np.pi * (np.arange(ROWS) + 0.5) / ROWS, np.pi * (np.arange(2 * ROWS) + 0.5) / ROWS
    across = np.sin(theta)[:, None]
    y = np.broadcast_to(np.cos(theta)[:, None], (ROWS, 2 * ROWS))
    world = np.stack([across * np.sin(phi), y, -across * np.cos(phi)], axis=2)
    cosine, from_sun = np.maximum(world @ zenith, 0.01), np.arccos(np.clip(world @ towards, -1, 1))
    sun = np.arccos(np.clip(towards @ zenith, LOWEST, 1))
    a, b, c, d, e = np.moveaxis(PEREZ @ [turbidity, 1], -1, 0)[..., None, None]

    def shape(cosine: Doubles, angle: Doubles) -> Doubles:
        return np.asarray((1 + a * np.exp(b / cosine)) * (1 + c * np.exp(d * angle) + e * np.cos(angle) ** 2))

    bright = tan((4 / 9 - turbidity / 120) * (pi - 2 * sun))
    luminance = 1000 * ((4.0453 * turbidity - 4.9710) * bright - 0.2155 * turbidity + 2.4192) / LUMINANCE * SKY
    colors = ZENITH @ [sun**3, sun**2, sun, 1] @ [turbidity**2, turbidity, 1]
    at_zenith = np.array([max(luminance, 0.0), *colors])[:, None, None]
    big_y, small_x, small_y = at_zenith * shape(cosine, from_sun) / shape(np.ones((1, 1)), np.full((1, 1), sun))
    xyz = np.stack([small_x / small_y, np.ones_like(small_x), (1 - small_x - small_y) / small_y], axis=2)
    rgb = np.maximum(big_y[..., None] * xyz @ RGB_FROM_XYZ.T, 0)
    return np.where((world @ zenith > 0)[..., None], rgb, 0).astype(np.float32)


def sun_irradiance(cosine: float, turbidity: float) -> Doubles:
    """Return the irradiance (3,) of a surface that faces the sun: after Rayleigh scattering and aerosols in the
    relative air mass of Kasten (1966). cosine: of the sun's angle from the zenith."""
    if cosine <= 0:
        return np.zeros(3)
    mass = 1 / (cosine + 0.15 * (np.degrees(asin(min(cosine, 1.0))) + 3.885) ** -1.253)
    clear = np.exp(-0.008735 * WAVELENGTHS**-4.08 * mass)
    return np.asarray(
        SOLAR * clear * np.exp(-max(AEROSOLS[0] * turbidity + AEROSOLS[1], 0.0) * WAVELENGTHS**-1.3 * mass)
    )
