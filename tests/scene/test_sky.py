"""The analytic sky against Mitsuba's, its energy by quadrature, and what is wrong with its parameters."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta, timezone
from typing import Any
from zoneinfo import ZoneInfo

import numpy as np
import pytest
from numpy.typing import NDArray

import clrt
from clrt.errors import SceneError
from clrt.scene.animation import Animation, Keyframe
from clrt.scene.lights import DirectionalLight, PointLight
from clrt.scene.model import Scene
from clrt.scene.sky.hosek_wilkie import SUN_DEGREES, SUN_WAVELENGTHS, WIDTH, SkyRadiance, sun_irradiance
from clrt.scene.sky.sky import Sky, SkyEnvironment
from clrt.scene.sky.sky_image import horizontal_irradiance, sky_image
from clrt.scene.spectra import rgb_of_spectrum

from ..rendering.skies import from_uv, irradiance, lookup

Doubles = NDArray[np.float64]
RNG = np.random.default_rng(2012)
UP = np.array([0.0, 1.0, 0.0])
#: Mitsuba's integral of the color matching function, by which it divides.
THEIR_WIDTH = 106.7502594
#: Radiance of Mitsuba 3.9.1's `sunsky` in the variant scalar_rgb: elevation of the sun, turbidity, albedo, cosine from
#: the zenith, azimuth from the sun.
SKIES = [
    (56.0, 1.0, (0.9, 0.78, 0.23), 0.314, 157, (0.0843120, 0.1409136, 0.1693556)),
    (1.5, 1.6, (0.82, 0.8, 0.47), 0.317, 50, (0.0307221, 0.0321531, 0.0253493)),
    (23.4, 2.3, (0.45, 0.5, 0.55), 0.996, 143, (0.0130928, 0.0278923, 0.0567650)),
    (55.8, 3.0, (0.99, 0.22, 0.16), 0.62, 8, (0.1237808, 0.1430357, 0.1965357)),
    (4.1, 4.4, (0.51, 0.47, 0.92), 0.637, 93, (0.0174814, 0.0242351, 0.0294186)),
    (44.7, 6.5, (0.25, 0.01, 0.19), 0.698, 36, (0.1835059, 0.1894307, 0.2231703)),
    (33.5, 8.8, (0.0, 0.83, 0.15), 0.282, 158, (0.0589003, 0.1323537, 0.1179544)),
    (45.9, 10.0, (0.85, 0.64, 0.74), 0.11, 97, (0.2388218, 0.1990658, 0.2096310)),
]
#: Irradiance by the sun in scalar_spectral with `complex_sun`, integrated over the disc: elevation, turbidity.
SUNS = [
    (0.5, 2.0, (0.14513, 0.02511, 0.0)),
    (4.0, 1.0, (0.70212, 0.28573, 0.02668)),
    (12.5, 3.0, (1.04532, 0.67053, 0.29124)),
    (30.0, 5.3, (1.17519, 0.89436, 0.59676)),
    (55.5, 2.7, (1.42787, 1.16487, 0.88112)),
    (88.0, 10.0, (0.97580, 0.77734, 0.62240)),
]


def sunny(elevation: float, azimuth: float = 0.0) -> tuple[float, float, float]:
    """Return the direction to a sun; angles in degrees, the azimuth from −Z to +X."""
    up, across = np.radians([elevation, azimuth])
    return float(np.cos(up) * np.sin(across)), float(np.sin(up)), float(-np.cos(up) * np.cos(across))


def theirs(mi: Any, elevation: float, **options: Any) -> Any:
    """Return Mitsuba's emitter, whose zenith is +z."""
    up = np.radians(elevation)
    return mi.load_dict({"type": "sunsky", "sun_direction": [np.cos(up), 0, np.sin(up)], **options})


def radiance(mi: Any, emitter: Any, towards: Doubles) -> Doubles:
    """Return Mitsuba's radiance (n, 3) or, in a spectral variant, (n, 11) at the sun's wavelengths."""
    found = []
    for direction in towards:
        si = mi.SurfaceInteraction3f()
        si.wi = mi.Vector3f(*(-direction))
        values: list[float] = []
        for four in ((0,),) if "rgb" in mi.variant() else ((0, 1, 2, 3), (4, 5, 6, 7), (8, 9, 10, 10)):
            if len(four) == 4:  # the last wavelength is just outside of Mitsuba's range
                si.wavelengths = [min(SUN_WAVELENGTHS[index], 719.99) for index in four]
            values += list(emitter.eval(si))
        found.append(values[:11])
    return np.array(found)


def test_values_of_mitsuba() -> None:
    for elevation, turbidity, albedo, cosine, azimuth, wanted in SKIES:
        up, across = np.radians([elevation, azimuth])
        angle = np.arccos(cosine * np.sin(up) + np.sqrt(1 - cosine**2) * np.cos(up) * np.cos(across))
        found = SkyRadiance(elevation, turbidity, albedo).at(np.array(cosine), np.array(angle))
        np.testing.assert_allclose(found, np.array(wanted) * THEIR_WIDTH / WIDTH, rtol=2e-5)
    for elevation, turbidity, wanted in SUNS:
        np.testing.assert_allclose(sun_irradiance(elevation, turbidity), wanted, rtol=2e-3, atol=2e-5)


@pytest.mark.needs("mitsuba")
def test_mitsubas_sky() -> None:
    """Random directions, turbidities, colors of the ground and elevations of the sun."""
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    for turbidity in [1.0, 10.0, *RNG.uniform(1, 10, 30)]:
        elevation, albedo = RNG.uniform(0.1, 89.9), RNG.uniform(0, 1, 3).tolist()
        emitter = theirs(mi, elevation, turbidity=turbidity, sun_scale=0.0, albedo={"type": "rgb", "value": albedo})
        towards = RNG.normal(size=(50, 3))
        towards[:, 2] = np.abs(towards[:, 2])
        towards /= np.linalg.norm(towards, axis=1)[:, None]
        sun = np.array([np.cos(np.radians(elevation)), 0, np.sin(np.radians(elevation))])
        ours = SkyRadiance(elevation, turbidity, albedo).at(towards[:, 2], np.arccos(np.clip(towards @ sun, -1, 1)))
        wanted = np.maximum(radiance(mi, emitter, towards), 0) * THEIR_WIDTH / WIDTH
        assert (np.abs(ours - wanted) / wanted.max(axis=1, keepdims=True)).max() < 2e-5


@pytest.mark.needs("mitsuba")
def test_mitsubas_sun() -> None:
    """The sun's irradiance is that of Mitsuba's spectral sun with its limb, by quadrature over the disc."""
    import mitsuba as mi

    mi.set_variant("scalar_spectral")
    nodes, weights = np.polynomial.legendre.leggauss(16)
    edge = np.sin(np.radians(SUN_DEGREES / 2))
    for elevation in [0.4, 1.0, *RNG.uniform(2, 89, 8)]:
        turbidity = RNG.uniform(1, 10)
        emitter = theirs(mi, elevation, turbidity=turbidity, sky_scale=0.0, complex_sun=True)
        up, turns = np.radians(elevation), 2 * np.pi * (np.arange(32) + 0.5) / 32
        sun, across = np.array([np.cos(up), 0, np.sin(up)]), np.array([-np.sin(up), 0, np.cos(up)])
        spectrum = np.zeros(11)
        for node, weight in zip((nodes + 1) / 2, weights / 2):
            off = edge * np.sqrt(1 - node**2) * 0.9999  # inside of the edge despite rounding
            ring = np.cos(turns)[:, None] * across + np.sin(turns)[:, None] * [0, 1, 0]
            values = radiance(mi, emitter, sun * np.sqrt(1 - off**2) + off * ring)
            spectrum += 2 * np.pi * edge**2 * node * weight * values.mean(axis=0)
        wanted = rgb_of_spectrum(SUN_WAVELENGTHS.tolist(), spectrum.tolist(), lit=False)
        np.testing.assert_allclose(sun_irradiance(elevation, turbidity), wanted, rtol=2e-3, atol=1e-4)


@pytest.mark.needs("mitsuba")
def test_the_map_and_the_disc_have_the_light_of_mitsubas_sun_and_sky() -> None:
    """The irradiance of the ground by Mitsuba's whole emitter is that by the map and the sun: none is lost, and none is
    in both. Both quadratures are Gauss and Legendre's; Mitsuba's disc, of even radiance, is done apart."""
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    nodes, weights = np.polynomial.legendre.leggauss(64)
    heights, weights = (nodes + 1) / 2, weights / 2
    turns = 2 * np.pi * (np.arange(64) + 0.5) / 64
    for elevation, turbidity in ((4.0, 3.0), (31.0, 2.2), (66.0, 7.5)):
        both = theirs(mi, elevation, turbidity=turbidity)
        sky = theirs(mi, elevation, turbidity=turbidity, sun_scale=0.0)
        across = np.sqrt(1 - heights**2)[:, None]
        grid = np.stack([across * np.cos(turns), across * np.sin(turns), np.repeat(heights[:, None], 64, 1)], axis=2)
        halves = radiance(mi, sky, grid.reshape(-1, 3)).reshape(64, 64, 3)
        by_sky = 2 * np.pi * (weights * heights) @ halves.mean(axis=1)
        up = np.radians(elevation)
        center = np.array([[np.cos(up), 0, np.sin(up)]])
        disc = (radiance(mi, both, center) - radiance(mi, sky, center))[0]
        by_sun = disc * np.pi * np.sin(np.radians(SUN_DEGREES / 2)) ** 2 * np.sin(up)

        ours = Sky(sun_direction=sunny(elevation), turbidity=turbidity, ground=False)
        (sun,) = ours.lights()
        assert isinstance(sun, DirectionalLight)
        image = ours.environment().image
        assert image is not None
        found = horizontal_irradiance(image)
        np.testing.assert_allclose(found, by_sky * THEIR_WIDTH / WIDTH, rtol=1e-4)
        # Mitsuba's rgb variants weigh the sun's spectrum by eleven values of the color matching functions, not by their
        # integrals, and its table of irradiances has steps of 3 degrees.
        np.testing.assert_allclose(np.multiply(sun.irradiance, np.sin(up)), by_sun, rtol=0.1, atol=0.002)
        np.testing.assert_allclose(image[len(image) // 2 :], 0)


def test_the_map_is_the_model_between_its_texels() -> None:
    """Interpolated at random directions, away from the horizon by half a texel; near the horizon the model bends."""
    for _ in range(5):
        elevation, azimuth, turbidity = RNG.uniform(0, 90), RNG.uniform(0, 360), RNG.uniform(1, 10)
        sun = np.array(sunny(elevation, azimuth))
        image = sky_image(sun, UP, turbidity, (0.2, 0.3, 0.4))
        towards = from_uv(RNG.uniform(0, 1, 20000), np.arccos(RNG.uniform(np.pi / 1000, 1, 20000)) / np.pi)
        model = SkyRadiance(elevation, turbidity, (0.2, 0.3, 0.4))
        wanted = model.at(towards[:, 1], np.arccos(np.clip(towards @ sun, -1, 1)))
        off = np.abs(lookup(image, towards) - wanted).max(axis=1) / wanted.max(axis=1)
        assert off.mean() < 2e-4 and off.max() < 0.02 and off[towards[:, 1] > 0.05].max() < 2e-3


def test_the_irradiance_of_the_ground() -> None:
    """The closed form for rows equals the midpoint rule on the interpolated map, and a sky of radiance 1 gives pi."""
    assert horizontal_irradiance(np.ones((64, 128, 3), np.float32)) == pytest.approx(np.pi)
    image = sky_image(np.array(sunny(20, 50)), UP, 3.0, (0.3, 0.3, 0.3), rows=64)
    np.testing.assert_allclose(horizontal_irradiance(image), irradiance(image, UP, steps=8), rtol=2e-3)


def test_the_ground_is_lit_by_sky_and_sun() -> None:
    sky = Sky(sun_direction=sunny(25, 110), albedo=(0.1, 0.5, 1.0), turbidity=4.0)
    image = sky.environment().image
    dark = Sky(sun_direction=sunny(25, 110), albedo=(0.1, 0.5, 1.0), turbidity=4.0, ground=False).environment().image
    assert image is not None and dark is not None
    total = horizontal_irradiance(dark) + np.sin(np.radians(25)) * np.array(sky.irradiance)
    np.testing.assert_allclose(image[-1, 7], np.array([0.1, 0.5, 1.0]) * total / np.pi, rtol=1e-5)
    assert (image[len(image) // 2 :] == image[-1, 7]).all() and (
        image[: len(image) // 2] == dark[: len(dark) // 2]
    ).all()


def test_strengths_and_size() -> None:
    """The sun's size does not change its irradiance; strengths are factors, and 0 leaves a part out."""
    plain = Sky(sun_direction=(1, 2, 3), ground=False)
    bright = Sky(sun_direction=(1, 2, 3), ground=False, sky_strength=2.0, sun_strength=3.0, sun_angle_degrees=4.0)
    (sun,), (other,) = plain.lights(), bright.lights()
    assert isinstance(sun, DirectionalLight) and isinstance(other, DirectionalLight)
    np.testing.assert_allclose(other.irradiance, np.multiply(3, sun.irradiance))
    assert (sun.angle_degrees, other.angle_degrees) == (SUN_DEGREES, 4.0)
    first, second = plain.environment().image, bright.environment().image
    assert first is not None and second is not None
    np.testing.assert_allclose(second, 2 * first, rtol=1e-6)
    assert not Sky(sun_direction=(0, 1, 0), sun_strength=0).lights()
    black = Sky(sun_direction=(0, 1, 0), sky_strength=0, ground=False).environment().image
    assert black is not None and not black.any()


def test_a_low_sun_is_red_and_weak_and_haze_dims_it() -> None:
    low, high = sun_irradiance(3, 3.0), sun_irradiance(60, 3.0)
    assert (low < high).all() and low[2] / low[0] < 0.2 < high[2] / high[0]
    assert (sun_irradiance(40, 9.0) < sun_irradiance(40, 2.0)).all()
    # The extraterrestrial irradiance is 1.9 W·m⁻²·nm⁻¹ at 500 nm, of which clear air transmits three quarters.
    assert 1.0 < high[1] < 1.6
    assert 80_000 < 683 * WIDTH * (high @ [0.2126, 0.7152, 0.0722]) < 120_000  # lux


def test_the_compass() -> None:
    """North is −Z and east +X, turned as environment maps are."""
    noon, morning = datetime(2026, 3, 21, 12, tzinfo=UTC), datetime(2026, 3, 21, 7, tzinfo=UTC)
    place: dict[str, Any] = {"latitude": 45.0, "longitude": 0.0}
    np.testing.assert_allclose(Sky(time=noon, **place).towards_sun, [0, np.sqrt(0.5), np.sqrt(0.5)], atol=0.04)
    east = Sky(time=morning, **place).towards_sun
    assert east[0] > 0.9 and 0 < east[1] < 0.2
    turned = Sky(time=morning, rotation_degrees=90.0, **place)
    np.testing.assert_allclose(turned.towards_sun, [east[2], east[1], -east[0]], atol=1e-12)
    turned = Sky(time=noon, rotation_degrees=130.0, **place)
    image = turned.environment().image
    assert image is not None
    (row, column), (x, _, z) = np.unravel_index(image.sum(axis=2).argmax(), image.shape[:2]), turned.towards_sun
    brightest = from_uv(np.array([(column + 0.5) / image.shape[1]]), np.array([(row + 0.5) / image.shape[0]]))[0]
    assert np.arctan2(brightest[0], brightest[2]) == pytest.approx(np.arctan2(x, z), abs=0.02)  # at the horizon


def test_directions_have_any_length() -> None:
    for length in (1e-300, 1e-20, 1.0, 5e37):
        sky = Sky(sun_direction=(0, 3 * length, -4 * length))
        np.testing.assert_allclose(sky.towards_sun, [0, 0.6, -0.8], rtol=1e-12)
        np.testing.assert_allclose(sky.position, [np.degrees(np.arcsin(0.6)), 0.0], rtol=1e-12)


def test_time_zones_are_offsets() -> None:
    place: dict[str, Any] = {"latitude": 52.5, "longitude": 13.4}
    named = Sky(time=datetime(2026, 6, 21, 12, tzinfo=ZoneInfo("Europe/Berlin")), **place)
    assert named == Sky(time=datetime(2026, 6, 21, 12, tzinfo=timezone(timedelta(hours=2))), **place)
    assert hash(named) == hash(Sky(time=named.time, **place))
    np.testing.assert_allclose(named.position, Sky(time=datetime(2026, 6, 21, 10, tzinfo=UTC), **place).position)


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({}, "Sky: has no sun; write time, latitude and longitude, or sun_direction"),
        ({"latitude": 3}, "Sky: time and longitude are missing; add what is"),
        ({"sun_direction": (0, 1, 0), "latitude": 0}, "Sky: has both a sun_direction and latitude; keep one of them"),
        ({"sun_direction": (0, 1, 0), "rotation_degrees": 3}, "both a sun_direction and rotation_degrees; keep one"),
        ({"sun_direction": (0, 1, 0), "hours_per_second": 3}, "both a sun_direction and hours_per_second; keep one"),
        ({"sun_direction": (0, 0, 0)}, "Sky.sun_direction: [0, 0, 0] is not a direction; write the one towards"),
        (
            {"sun_direction": (3, -4, 0)},
            "[3, -4, 0] is 53.1 degrees below the horizon, where the model ends; write one above",
        ),
        ({"time": datetime(2026, 6, 21, 12), "latitude": 1, "longitude": 2}, "12:00:00 has no offset from UTC; write"),
        (
            {"time": datetime(2026, 6, 21, tzinfo=UTC), "latitude": 50, "longitude": 0},
            "Sky.time: at 2026-06-21T00:00:00+00:00 the sun is",
        ),
        ({"time": "noon", "latitude": 50, "longitude": 0}, 'Sky.time: "noon" is not a date and time; write one'),
        ({"sun_direction": (0, 1, 0), "turbidity": 0.5}, "Sky.turbidity: 0.5 is below 1; write at least 1"),
        ({"sun_direction": (0, 1, 0), "turbidity": 11}, "Sky.turbidity: 11 is above 10; write at most 10"),
        ({"sun_direction": (0, 1, 0), "albedo": (0, 0, 1.5)}, "Sky.albedo[2]: 1.5 is above 1; write at most 1"),
        ({"sun_direction": (0, 1, 0), "sky_strength": -1}, "Sky.sky_strength: -1 is below 0; write at least 0"),
        ({"sun_direction": (0, float("nan"), 0)}, "Sky.sun_direction[1]: nan is not a finite number; write one"),
    ],
)
def test_mistakes(values: dict[str, Any], sentence: str) -> None:
    with pytest.raises(SceneError) as caught:
        clrt.Sky(**values)
    (problem,) = caught.value.problems
    assert sentence in problem and problem.startswith("Sky")


def test_the_sun_moves_in_frames() -> None:
    """Frames are as under skies at their times; the camera, other lights and the map's own rotation stay."""
    start = datetime(2026, 6, 21, 6, tzinfo=UTC)
    sky = Sky(time=start, latitude=50, longitude=5, hours_per_second=2.0)
    lamp = PointLight(position=(0, 1, 2), intensity=(1, 1, 1))
    scene = Scene(
        environment=replace(sky.environment(), rotation_degrees=20.0),
        lights=[*sky.lights(), lamp],
        animation=Animation(fps=4.0, keyframes=(Keyframe(time=3.0), Keyframe(time=5.0))),
    )
    found = dict(clrt.frames(scene, [0, 3, 8]))
    for number, still in found.items():
        now = replace(sky, time=start + timedelta(hours=number / 2))
        assert still.lights == [*now.lights(), lamp] and still.camera == scene.camera
        assert isinstance(still.environment, SkyEnvironment) and still.environment.rotation_degrees == 20
        np.testing.assert_array_equal(still.environment.image, now.environment().image)
    without = dict(clrt.frames(replace(scene, lights=[lamp]), [8]))[8]
    assert without.lights == [lamp] and without.environment.image is not None
    turning = dict(clrt.frames(clrt.turntable(scene, 12, fps=4.0), [8]))[8]
    assert turning.lights == found[8].lights and turning.camera != scene.camera


def test_frames_at_night_are_refused_before_the_first() -> None:
    sky = Sky(time=datetime(2026, 6, 21, 12, tzinfo=UTC), latitude=50, longitude=5, hours_per_second=2.0)
    scene = clrt.turntable(Scene(environment=sky.environment(), lights=sky.lights()), 24, fps=4.0)
    with pytest.raises(
        SceneError, match="Sky.time: at 2026-06-21T20:00:00.00:00 the sun is .* degrees below the horizon"
    ):
        clrt.frames(scene)
    assert next(clrt.frames(scene, range(15)))[0] == 0
    fast = replace(sky, hours_per_second=1e30)
    with pytest.raises(SceneError, match="lead to no date after 0.25 s; write a smaller number"):
        clrt.frames(replace(scene, environment=fast.environment()))
