"""Sun and sky over twelve hours of a day against Mitsuba's `sunsky`: model, map, sun and whole images.

It needs `pip install mitsuba pvlib`. CLRT_SKY_IMAGE: a file for images of every second hour, clrt's above Mitsuba's.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta, timezone
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from clrt.api import load, render
from clrt.output.image import Image
from clrt.scene.sky.hosek_wilkie import SUN_DEGREES, SUN_WAVELENGTHS, WIDTH, SkyRadiance
from clrt.scene.sky.sky import Sky
from clrt.scene.sky.sky_image import ROWS
from clrt.scene.sky.sun_position import sun_position
from clrt.scene.spectra import rgb_of_spectrum

from ..rendering.skies import Doubles, from_uv, lookup

#: Berlin on the day of the equinox, in hours of UTC+1.
DAY, ZONE, HOURS = datetime(2026, 3, 20), 1, np.arange(6.5, 18).tolist()
LATITUDE, LONGITUDE, TURBIDITY = 52.5, 13.4, 3.0
#: Random directions per hour; points on the sun's disc; size, samples per pixel and number of the images.
DIRECTIONS, POINTS, SIZE, SPP, SEEDS = 20_000, 2000, (200, 150), 32, 4
#: Times and places from 1950 to 2050.
PLACES = 3000
#: Mitsuba's radiance is this much more, since it divides by another integral of the color matching function.
SCALE = WIDTH / 106.7502594
#: Sine of the elevation below which the map mixes sky and ground: half a row.
HORIZON = np.sin(np.pi / ROWS / 2)
MODEL = Path(__file__).parents[2] / "scenes" / "models" / "spot.obj"
#: A cow on a floor.
SCENE = """<scene version="3.0.0"><emitter type="sunsky"><vector name="sun_direction" x="{x}" y="{y}" z="{z}"/>
<float name="turbidity" value="{turbidity}"/><float name="sun_scale" value="{sun}"/>
<transform name="to_world"><rotate x="1" angle="-90"/></transform></emitter>
<shape type="obj"><string name="filename" value="{model}"/><bsdf type="twosided"><bsdf type="diffuse">
<rgb name="reflectance" value="0.7 0.65 0.6"/></bsdf></bsdf>
<transform name="to_world"><rotate y="1" angle="200"/><translate y="0.74"/></transform></shape>
<shape type="rectangle"><bsdf type="diffuse"><rgb name="reflectance" value="0.3 0.3 0.3"/></bsdf>
<transform name="to_world"><rotate x="1" angle="-90"/><scale value="400"/></transform></shape>
<sensor type="perspective"><float name="fov" value="48"/><string name="fov_axis" value="x"/>
<transform name="to_world"><lookat origin="1.5, 0.9, 3.6" target="0.2, 1.05, 0" up="0, 1, 0"/></transform>
<film type="hdrfilm"><integer name="width" value="{size[0]}"/><integer name="height" value="{size[1]}"/>
<rfilter type="box"/></film></sensor>
<integrator type="path"><integer name="max_depth" value="6"/></integrator></scene>"""


def trial() -> Iterator[str]:
    """Yield a line per hour, and one for the day. Three numbers are red, green and blue of clrt over Mitsuba."""
    mi: Any = import_module("mitsuba")
    offs, pairs, rng = [], [], np.random.default_rng(0)
    yield f"{DAY:%Y-%m-%d}, UTC+{ZONE}, {LATITUDE} N, {LONGITUDE} E, turbidity {TURBIDITY:g}; Mitsuba {mi.__version__}"
    yield "hour  elevation  sun off  model max  map mean  map max  sun, spectral      sun, rgb           image, no sun"
    for hour in HOURS:
        time = DAY.replace(tzinfo=timezone(timedelta(hours=ZONE))) + timedelta(hours=hour)
        sky = Sky(time=time, latitude=LATITUDE, longitude=LONGITUDE, turbidity=TURBIDITY, ground=False)
        sun, image = np.array(sky.towards_sun), sky.environment().image
        assert image is not None
        mi.set_variant("scalar_rgb")
        towards = from_uv(rng.uniform(0, 1, DIRECTIONS), np.arccos(rng.uniform(HORIZON, 1, DIRECTIONS)) / np.pi)
        theirs = np.maximum(_radiance(mi, _emitter(mi, sun, sun_scale=0.0), towards), 0) / SCALE
        largest = theirs.max(axis=1)
        angles = np.arccos(np.clip(towards @ sun, -1, 1))
        exact = SkyRadiance(sky.position.elevation, TURBIDITY, sky.albedo).at(towards[:, 1], angles)
        model = np.abs(exact - theirs).max(axis=1) / largest
        offs.append(np.abs(lookup(image, towards) - theirs).max(axis=1) / largest)
        direct = _radiance(mi, _emitter(mi, sun, sky_scale=0.0), sun[None])[0] * _disc() / SCALE
        off = _sun_off(mi, hour, sun)
        pairs.append(_images(mi, sun, 1.0))
        ours, other = _images(mi, sun, 0.0)
        yield (
            f"{hour:4g}  {sky.position.elevation:9.2f}  {off:7.3f}  {model.max():9.1e}  {offs[-1].mean():8.1e}"
            f"  {offs[-1].max():7.4f}  {_ratios(np.array(sky.irradiance), _spectral_sun(mi, sun))}"
            f"  {_ratios(np.array(sky.irradiance), direct)}  {_ratios(ours.mean((0, 1)) * SCALE, other.mean((0, 1)))}"
        )
    whole = np.concatenate(offs)
    yield f"the map over the day: mean {whole.mean():.1e}, max {whole.max():.4f} of {whole.size} directions"
    yield _positions()
    if file := os.environ.get("CLRT_SKY_IMAGE"):
        rows = [np.concatenate([pair[which] for pair in pairs[::2]], axis=1) for which in (0, 1)]
        Image(np.maximum(np.concatenate(rows), 0).astype(np.float32)).save(file, exposure=0.5)


def _ratios(ours: Doubles, theirs: Doubles) -> str:
    """Return ours over theirs, without channels of a color outside of Rec. 709."""
    return " ".join(f"{a / b:.3f}" if b > 0 else "    -" for a, b in zip(ours, theirs))


def _emitter(mi: Any, sun: Doubles, **options: Any) -> Any:
    """Return Mitsuba's emitter with its zenith along +y."""
    upright = mi.ScalarTransform4f().rotate([1, 0, 0], -90)
    return mi.load_dict(
        {"type": "sunsky", "sun_direction": sun.tolist(), "turbidity": TURBIDITY, "to_world": upright, **options}
    )


def _radiance(mi: Any, emitter: Any, towards: Doubles) -> Doubles:
    si, found = mi.SurfaceInteraction3f(), np.empty((len(towards), 3))
    for row, direction in enumerate(towards):
        si.wi = mi.Vector3f(*(-direction))
        found[row] = emitter.eval(si)
    return found


def _disc() -> float:
    """Return the disc's projected solid angle."""
    return float(np.pi * np.sin(np.radians(SUN_DEGREES / 2)) ** 2)


def _spectral_sun(mi: Any, sun: Doubles) -> Doubles:
    """Return the irradiance of Mitsuba's spectral sun with its limb, from points on a spiral over the disc."""
    mi.set_variant("scalar_spectral")
    emitter, si = _emitter(mi, sun, sky_scale=0.0, complex_sun=True), mi.SurfaceInteraction3f()
    radii, turns = np.sqrt((np.arange(POINTS) + 0.5) / POINTS), np.arange(POINTS) * np.pi * (3 - np.sqrt(5))
    across = np.cross(sun, [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    offsets = np.cos(turns)[:, None] * across + np.sin(turns)[:, None] * np.cross(sun, across)
    off = (np.sin(np.radians(SUN_DEGREES / 2)) * radii * 0.9999)[:, None]  # inside of the edge despite rounding
    wavelengths = np.minimum(np.append(SUN_WAVELENGTHS, 720), 719.99)  # twelve, four at a time
    spectrum = np.zeros(12)
    for direction in sun * np.sqrt(1 - off**2) + off * offsets:
        si.wi = mi.Vector3f(*(-direction))
        for first in (0, 4, 8):
            si.wavelengths = wavelengths[first : first + 4].tolist()
            spectrum[first : first + 4] += emitter.eval(si)
    irradiance = spectrum[:11] / POINTS * _disc()
    return np.array(rgb_of_spectrum(SUN_WAVELENGTHS.tolist(), irradiance.tolist(), lit=False))


def _sun_off(mi: Any, hour: float, sun: Doubles) -> float:
    """Return by how many degrees Mitsuba's sun differs that is computed from time and place."""
    date = {"year": DAY.year, "month": DAY.month, "day": DAY.day, "hour": hour, "timezone": ZONE}
    emitter = mi.load_dict({"type": "sunsky", "latitude": LATITUDE, "longitude": LONGITUDE, **date})
    south, west, up = mi.traverse(emitter)["sun_direction"]
    return float(np.degrees(np.linalg.norm(sun - [-west, up, south])))


def _positions() -> str:
    """Compare the sun's position with NREL's algorithm (Reda and Andreas 2008), which is accurate to 0.0003 degrees, at
    random times and places."""
    pvlib: Any = import_module("pvlib")
    pandas: Any = import_module("pandas")
    rng, offs = np.random.default_rng(1), []
    for _ in range(PLACES):
        time = datetime(1950, 1, 1, tzinfo=UTC) + timedelta(days=float(rng.uniform(0, 36525)))
        latitude, longitude = float(np.degrees(np.arcsin(rng.uniform(-1, 1)))), float(rng.uniform(-180, 180))
        found = pvlib.solarposition.spa_python(pandas.DatetimeIndex([time]), latitude, longitude, altitude=0).iloc[0]
        (up, across), (other_up, other_across) = np.radians(
            [sun_position(time, latitude, longitude), (found["elevation"], found["azimuth"])]
        )
        cosine = np.sin(up) * np.sin(other_up) + np.cos(up) * np.cos(other_up) * np.cos(across - other_across)
        offs.append(np.degrees(np.arccos(min(cosine, 1.0))))
    return (
        f"the sun against pvlib {pvlib.__version__}: mean {np.mean(offs):.4f}, max {max(offs):.4f} degrees of {PLACES}"
    )


def _images(mi: Any, sun: Doubles, strength: float) -> tuple[Doubles, Doubles]:
    """Return clrt's image and Mitsuba's of the scene. strength: factor of the sun."""
    x, y, z = sun.tolist()
    mi.set_variant("scalar_rgb")
    with tempfile.TemporaryDirectory() as folder:
        (path := Path(folder) / "a.xml").write_text(
            SCENE.format(x=x, y=y, z=z, sun=strength, turbidity=TURBIDITY, model=MODEL, size=SIZE)
        )
        ours, theirs = load(path), mi.load_file(str(path))
    images = [render(ours, spp=SPP, seed=seed).pixels for seed in range(SEEDS)]
    others = [np.array(mi.render(theirs, spp=SPP, seed=seed))[..., :3] for seed in range(SEEDS)]
    return np.mean(images, axis=0), np.mean(others, axis=0)
