"""The sun's position against published values and against Mitsuba's."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta, timezone

import numpy as np
import pytest

from clrt.scene.sky.sun_position import PARALLAX, equatorial_position, sun_position

RNG = np.random.default_rng(25)


def degrees_between(first: tuple[float, float], second: tuple[float, float]) -> float:
    """Return the angle between two positions, each elevation and azimuth in degrees."""
    a, b = (
        np.array([np.cos(up) * np.sin(across), np.cos(up) * np.cos(across), np.sin(up)])
        for up, across in np.radians([first, second])
    )
    return float(np.degrees(np.linalg.norm(a - b)))


def test_the_example_of_the_solar_position_algorithm() -> None:
    """Reda and Andreas (2008), "Solar Position Algorithm for Solar Radiation Applications", NREL/TP-560-34302, appendix
    A.5: the elevation before the correction for refraction."""
    time = datetime(2003, 10, 17, 12, 30, 30, tzinfo=timezone(timedelta(hours=-7)))
    found = sun_position(time, 39.742476, -105.1786)
    assert degrees_between(found, (39.872046, 194.340241)) < 0.01


def test_the_examples_of_astronomical_algorithms() -> None:
    """Meeus (1998), examples 25.a and 12.a: the apparent place, and the apparent sidereal time at Greenwich."""
    right_ascension, declination, _ = equatorial_position(datetime(1992, 10, 13, tzinfo=UTC))
    assert right_ascension % 360 == pytest.approx(198.38083, abs=1e-3)
    assert declination == pytest.approx(-7.78507, abs=1e-3)
    sidereal = equatorial_position(datetime(1987, 4, 10, tzinfo=UTC))[2] % 360
    assert sidereal == pytest.approx(15 * (13 + 10 / 60 + 46.1351 / 3600), abs=2e-4)


@pytest.mark.parametrize(
    ("time", "declination"),
    [
        ("2024-03-20T03:06+00:00", 0.0),
        ("2024-06-20T20:51+00:00", 23.44),
        ("2025-09-22T18:19+00:00", 0.0),
        ("2025-12-21T15:03+00:00", -23.44),
    ],
)
def test_equinoxes_and_solstices(time: str, declination: float) -> None:
    """Times of the U.S. Naval Observatory. At the north pole the sun's elevation is its declination."""
    when = datetime.fromisoformat(time)
    assert sun_position(when, 90.0, 0.0).elevation + PARALLAX == pytest.approx(declination, abs=5e-3)
    assert sun_position(when, -90.0, 77.0).elevation + PARALLAX == pytest.approx(-declination, abs=5e-3)


def test_the_sun_rises_in_the_east_and_culminates_in_the_south() -> None:
    day = [sun_position(datetime(2026, 3, 21, hour, tzinfo=UTC), 50.0, 0.0) for hour in range(7, 18)]
    azimuths = [each.azimuth for each in day]
    assert azimuths == sorted(azimuths) and 90 < azimuths[0] < 120 and 240 < azimuths[-1] < 270
    assert max(day).azimuth == pytest.approx(180, abs=5) and max(day).elevation == pytest.approx(40, abs=0.7)
    south = max(sun_position(datetime(2026, 3, 21, hour, tzinfo=UTC), -50.0, 0.0) for hour in range(7, 18))
    assert min(south.azimuth, 360 - south.azimuth) < 5


@pytest.mark.needs("mitsuba")
def test_mitsubas_sun() -> None:
    """Mitsuba computes with the PSA algorithm, in float32: Blanco-Muriel et al. (2001)."""
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    for _ in range(100):
        year, month, day = (int(RNG.integers(*ends)) for ends in ((1999, 2016), (1, 13), (1, 29)))
        hour, latitude, longitude, zone = (float(RNG.uniform(-end, end)) for end in (12, 85, 180, 12))
        place = {"latitude": latitude, "longitude": longitude, "timezone": zone}
        date = {"year": year, "month": month, "day": day, "hour": 12 + hour}
        south, west, up = mi.traverse(mi.load_dict({"type": "sunsky", **place, **date}))["sun_direction"]
        theirs = float(np.degrees(np.arcsin(up))), float(np.degrees(np.arctan2(-west, -south)))
        time = datetime(year, month, day, tzinfo=UTC) + timedelta(hours=12 + hour - zone)
        assert degrees_between(sun_position(time, latitude, longitude), theirs) < 0.05
