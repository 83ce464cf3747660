"""Position of the sun in the sky by time and place."""

from __future__ import annotations

from datetime import UTC, datetime
from math import asin, atan2, cos, degrees, radians, sin
from typing import NamedTuple

#: The epoch J2000.0, from which the formulas count, and the days of a Julian century.
EPOCH, CENTURY = datetime(2000, 1, 1, 12, tzinfo=UTC), 36525.0
#: The sun's horizontal parallax in degrees: seen from the ground it is this much lower than from the Earth's center.
PARALLAX = 0.00244


class SunPosition(NamedTuple):
    """The sun's center in degrees, without refraction. elevation: above the horizon; azimuth: from north through
    east."""

    elevation: float
    azimuth: float


def sun_position(time: datetime, latitude: float, longitude: float) -> SunPosition:
    """Return where the sun is.

    time: with an offset from UTC. latitude: degrees, north above 0; longitude: degrees, east above 0. Accurate to 0.01
    degrees from 1950 to 2050 (Meeus 1998, "Astronomical Algorithms", chapters 12, 13 and 25); a few hundredths more in
    the centuries around.
    """
    right_ascension, declination, sidereal = equatorial_position(time)
    hour, declination, place = radians(sidereal + longitude - right_ascension), radians(declination), radians(latitude)
    up = sin(place) * sin(declination) + cos(place) * cos(declination) * cos(hour)
    north = cos(place) * sin(declination) - sin(place) * cos(declination) * cos(hour)
    east = -cos(declination) * sin(hour)
    elevation = degrees(asin(min(max(up, -1.0), 1.0)))
    return SunPosition(elevation - PARALLAX * cos(radians(elevation)), degrees(atan2(east, north)) % 360)


def equatorial_position(time: datetime) -> tuple[float, float, float]:
    """Return the sun's apparent right ascension and declination, and the apparent sidereal time at Greenwich, all in
    degrees. Terrestrial time is taken to be UTC: a minute changes the ecliptic longitude by 0.0007 degrees."""
    days = (time - EPOCH).total_seconds() / 86400
    t = days / CENTURY
    anomaly = radians(357.52911 + (35999.05029 - 0.0001537 * t) * t)
    center = (1.914602 - (0.004817 + 0.000014 * t) * t) * sin(anomaly)
    center += (0.019993 - 0.000101 * t) * sin(2 * anomaly) + 0.000289 * sin(3 * anomaly)
    node = radians(125.04 - 1934.136 * t)  # of the Moon's orbit, with which the Earth's axis nutates
    nutation = -0.00478 * sin(node)
    longitude = radians(280.46646 + (36000.76983 + 0.0003032 * t) * t + center - 0.00569 + nutation)
    obliquity = radians(23.439291 - 0.0130042 * t + 0.00256 * cos(node))
    sidereal = 280.46061837 + 360.98564736629 * days + 0.000387933 * t**2 + nutation * cos(obliquity)
    right_ascension = degrees(atan2(cos(obliquity) * sin(longitude), cos(longitude)))
    return right_ascension, degrees(asin(sin(obliquity) * sin(longitude))), sidereal
