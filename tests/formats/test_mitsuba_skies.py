"""Suns and skies of Mitsuba: read where it has them, as bright, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.errors import SceneError
from clrt.formats.load_scene import load
from clrt.scene.lights import DirectionalLight
from clrt.scene.model import Scene
from clrt.scene.sky.hosek_wilkie import WIDTH
from clrt.scene.sky.sky import Sky, SkyEnvironment

from ..rendering.skies import lookup

RNG = np.random.default_rng(39)
#: Mitsuba's integral of the color matching function, by which it divides.
THEIR_WIDTH = 106.7502594
DIRECTION = '<vector name="sun_direction" x="0.3" y="0.5" z="0.6"/>'
UPRIGHT = '<transform name="to_world"><rotate x="1" angle="-90"/></transform>'


def scene(folder: Path, inside: str, kind: str = "sunsky", version: str = "3.0.0") -> Scene:
    """Read a scene with one emitter."""
    (folder / "a.xml").write_text(f'<scene version="{version}"><emitter type="{kind}">{inside}</emitter></scene>')
    return load(folder / "a.xml")


def unit(vector: tuple[float, float, float]) -> NDArray[np.float64]:
    return np.asarray(np.asarray(vector) / np.linalg.norm(vector))


def floats(**values: float) -> str:
    return "".join(
        f'<{"integer" if isinstance(value, int) else "float"} name="{name}" value="{value}"/>'
        for name, value in values.items()
    )


@pytest.mark.needs("mitsuba")
def test_mitsubas_emitter(tmp_path: Path) -> None:
    """At random times, places and rotations: the direction to the sun, and the radiance in random directions that are
    not close to the horizon, where the map is interpolated."""
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    for number in range(8):
        axis = RNG.normal(size=3)
        x, y, z = axis / np.linalg.norm(axis)
        turn = f'<transform name="to_world"><rotate x="{x}" y="{y}" z="{z}" angle="{RNG.uniform(0, 360)}"/></transform>'
        longitude, noon = float(RNG.uniform(-180, 180)), float(RNG.uniform(10, 14))
        inside = floats(
            latitude=float(RNG.uniform(-40, 40)),
            longitude=longitude,
            timezone=longitude / 15,
            year=int(RNG.integers(2000, 2020)),
            month=int(RNG.integers(1, 13)),
            day=int(RNG.integers(1, 29)),
            hour=noon,
            turbidity=float(RNG.uniform(1, 10)),
            sky_scale=float(RNG.uniform(0.5, 2)),
        )
        inside += '<rgb name="albedo" value="0.1 0.5 0.9"/>' + (UPRIGHT if number % 2 else turn)
        read = scene(tmp_path, inside)
        text = f'<scene version="3.0.0"><emitter type="sunsky">{inside}<float name="sun_scale" value="0"/></emitter>'
        emitter = mi.load_string(text + "</scene>").emitters()[0]
        parameters = mi.traverse(emitter)
        (sun,) = read.lights
        assert isinstance(sun, DirectionalLight)
        assert np.linalg.norm(unit(sun.direction) + np.array(parameters["sun_direction"])) < np.radians(0.05)
        assert isinstance(read.environment, SkyEnvironment) == bool(number % 2)
        towards = RNG.normal(size=(200, 3))
        towards /= np.linalg.norm(towards, axis=1)[:, None]
        wanted = []
        for direction in towards:
            si = mi.SurfaceInteraction3f()
            si.wi = mi.Vector3f(*(-direction))
            wanted.append(np.array(emitter.eval(si)))
        image = read.environment.image
        assert image is not None
        found = lookup(image, towards) * read.environment.strength
        zenith = np.array(parameters["to_world"].matrix)[:3, 2]
        theirs = np.maximum(wanted, 0) * THEIR_WIDTH / WIDTH
        off = np.abs(found - theirs).max(axis=1) / theirs.max()
        assert off[np.abs(towards @ zenith) > 0.01].max() < 5e-3  # the sun's position differs by 0.05 degrees


@pytest.mark.parametrize(("version", "zenith"), [("0.6.0", (0, 1, 0)), ("3.0.0", (0, 0, 1))])
def test_axes(tmp_path: Path, version: str, zenith: tuple[int, int, int]) -> None:
    """Mitsuba 0.x's zenith is +y, Mitsuba 3's +z; the map is black below. Noon on the day of the equinox is in the
    south, at 90° − latitude; the morning is in the east."""
    read = scene(tmp_path, DIRECTION, version=version)
    (sun,) = read.lights
    assert isinstance(sun, DirectionalLight) and sun.angle_degrees == pytest.approx(0.5358)
    np.testing.assert_allclose(-unit(sun.direction), np.array([0.3, 0.5, 0.6]) / np.sqrt(0.7), atol=1e-9)
    image = read.environment.image
    assert image is not None
    towards = RNG.normal(size=(500, 3))
    towards = towards[np.abs(towards @ zenith) > 0.05]
    towards /= np.linalg.norm(towards, axis=1)[:, None]
    np.testing.assert_array_equal(lookup(image, towards).max(axis=1) > 0, towards @ zenith > 0)
    place = floats(latitude=40.0, longitude=0.0, timezone=0.0, year=2010, month=3, day=21)
    south, east = ((0, 0, 1), (1, 0, 0)) if version == "0.6.0" else ((1, 0, 0), (0, -1, 0))
    (noon,) = scene(tmp_path, place + floats(hour=12.0, minute=7.0), version=version).lights
    wanted = np.sin(np.radians(50)) * np.array(zenith) + np.cos(np.radians(50)) * np.array(south)
    assert isinstance(noon, DirectionalLight) and -unit(noon.direction) @ wanted > np.cos(np.radians(0.5))
    (morning,) = scene(tmp_path, place + floats(hour=7.0), version=version).lights
    assert isinstance(morning, DirectionalLight) and -unit(morning.direction) @ east > 0.9


def test_the_sky_and_the_sun_of_mitsuba_0(tmp_path: Path) -> None:
    """Apart; the ground's albedo is 0.2 by default."""
    old = scene(tmp_path, DIRECTION + floats(skyScale=2.0, scale=3.0), "sky", "0.6.0")
    assert not old.lights and isinstance(old.environment, SkyEnvironment)
    direction = tuple((np.array([0.3, 0.5, 0.6]) / np.sqrt(0.7)).tolist())
    wanted = Sky(sun_direction=direction, albedo=(0.2,) * 3, ground=False, sky_strength=6.0, sun_strength=0.0)
    assert old.environment.sky == wanted
    alone = scene(tmp_path, DIRECTION + floats(sunRadiusScale=4.0), "sun", "0.6.0")
    (sun,) = alone.lights
    assert isinstance(sun, DirectionalLight) and sun.angle_degrees == pytest.approx(4 * 0.5358)
    assert alone.environment.image is None and not any(alone.environment.color)


def test_a_set_sun_is_black_and_mistakes_are_named(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    night = scene(tmp_path, '<vector name="sun_direction" x="1" y="0" z="-0.1"/>')
    assert not night.lights and night.environment.image is None and not any(night.environment.color)
    assert "its sun is 5.71 degrees below the horizon, so it is black" in caplog.text
    for inside, sentence in (
        (floats(turbidity=11.0), "sky.turbidity: 11.0 is above 10; write at most 10"),
        (floats(month=13), "2010-13-10 is not a date"),
        (floats(stretch=2.0), '"stretch" is not supported; leave it out'),
        (floats(sky_scale=-1.0), "sky.sky_strength: -1.0 is below 0"),
        ('<transform name="to_world"><scale x="0"/></transform>', "its to_world is singular; only rotate it"),
    ):
        with pytest.raises(SceneError, match="line 1: ") as caught:
            scene(tmp_path, inside)
        assert sentence in str(caught.value)
