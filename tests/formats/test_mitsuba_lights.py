"""Mitsuba's spots with an image and projectors: what arrives at random points is what Mitsuba itself samples there."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.kernel_probe import Probe
from clrt.bench.renderers.mitsuba_renderer import native
from clrt.bench.renderers.mitsuba_scene import mitsuba_scene
from clrt.device.open import Device
from clrt.formats.load_scene import load
from clrt.output.images import write_image, write_texels
from clrt.output.scenes import save_scene
from clrt.scene.light_images import LightImage
from clrt.scene.lights import Light, ProjectorLight, SpotLight
from clrt.scene.model import Scene

from ..covering import others
from .test_mitsuba_xml import problem, scene

Doubles = NDArray[np.float64]
SEEDS = range(24)
POINTS = 200


def scalar_mitsuba() -> Any:
    mitsuba = import_module("mitsuba")
    mitsuba.set_variant("scalar_rgb")
    return mitsuba


def arriving(device: Device, light: Light, points: Doubles) -> Doubles:
    """Return the irradiance (n, 3) that a light gives surfaces that face it at points (n, 3)."""
    normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    return Probe(device, Scene(lights=[light]))("light_sample", 12, points, normals, seed=1)[:, 3:6]


def mitsubas(mitsuba: Any, emitter: Any, points: Doubles) -> Doubles:
    """Return what an emitter of Mitsuba's scalar variant gives at points (n, 3)."""
    found = []
    for point in points.tolist():
        at = mitsuba.SurfaceInteraction3f()
        at.p = point
        found.append(np.array(emitter.sample_direction(at, [0.5, 0.5], True)[1]))
    return np.array(found)


def points_before(light: Light, rng: np.random.Generator) -> Doubles:
    """Return points (n, 3) near a light, most of them in front of it."""
    assert isinstance(light, (SpotLight, ProjectorLight))
    forward = np.array(light.direction) / np.linalg.norm(light.direction)
    directions = forward + rng.uniform(-1, 1, (POINTS, 3)) * rng.uniform(0, 1, (POINTS, 1))
    return np.asarray(light.position + directions * rng.uniform(0.5, 3, (POINTS, 1)))


def bitmap(rng: np.random.Generator, folder: Path, name: str) -> str:
    """Write a random image, and return the text of a texture that shows it somehow."""
    size = rng.integers(1, 7, 2).tolist()
    file = str(rng.choice(["image.png", "image.exr"]))
    if file == "image.png":
        write_texels(folder / file, rng.integers(0, 256, (*size, 4), np.uint8))
    else:
        write_image(folder / file, rng.uniform(0, 5, (*size, 3)).astype(np.float32))
    x, y, u, v = rng.uniform(-2, 2, 4)
    placed = f"""<transform name="to_uv"><scale x="{x}" y="{y}"/><rotate z="1" angle="{rng.uniform(-180, 180)}"/>
        <translate x="{u}" y="{v}"/></transform>"""
    return f"""<texture type="bitmap" name="{name}"><string name="filename" value="{file}"/>
        <boolean name="raw" value="{rng.choice(["true", "false"])}"/>
        <string name="filter_type" value="{rng.choice(["bilinear", "nearest"])}"/>
        <string name="wrap_mode" value="{rng.choice(["repeat", "mirror", "clamp"])}"/>
        {rng.choice(["", placed])}</texture>"""


def checkerboard(rng: np.random.Generator, folder: Path, name: str) -> str:
    return f"""<texture type="checkerboard" name="{name}"><rgb name="color0" value="{rng.uniform(0, 1)}, 0.3, 1"/>
        <transform name="to_uv"><scale x="{rng.uniform(1, 6)}" y="4"/></transform></texture>"""


def constant(rng: np.random.Generator, folder: Path, name: str) -> str:
    return f'<rgb name="{name}" value="{rng.uniform(0, 4)}, 1, 2"/>' if name == "irradiance" else ""


def emitter(kind: str, rng: np.random.Generator, folder: Path) -> str:
    """Return the text of a random emitter."""
    look = [" ".join(map(str, row)) for row in rng.normal(size=(3, 3))]
    place = f'<lookat origin="{look[0]}" target="{look[1]}" up="{look[2]}"/>'
    shape = str(rng.choice([f'<scale value="{rng.uniform(0.3, 3)}"/>', '<scale x="-1"/>', ""]))
    to_world = f'<transform name="to_world">{shape}{place}</transform>'
    image = rng.choice(np.array([bitmap, bitmap, bitmap, checkerboard, constant]))
    if kind == "spot":
        outer = rng.uniform(10, 80)
        return f"""<emitter type="spot"><float name="cutoff_angle" value="{outer}"/>
            <rgb name="intensity" value="1, 2, 3"/><float name="beam_width" value="{outer * rng.uniform(0.3, 0.9)}"/>
            {image(rng, folder, "texture")}{to_world}</emitter>"""
    axis = rng.choice(["x", "y", "diagonal", "smaller", "larger"])
    angle = f'<float name="fov" value="{rng.uniform(10, 100)}"/><string name="fov_axis" value="{axis}"/>'
    lens = str(rng.choice([angle, '<string name="focal_length" value="35mm"/>', ""]))
    scale = str(rng.choice([f'<float name="scale" value="{rng.uniform(0.1, 9)}"/>', ""]))
    return f'<emitter type="projector">{lens}{scale}{image(rng, folder, "irradiance")}{to_world}</emitter>'


@pytest.mark.needs("mitsuba")
@pytest.mark.parametrize("kind", ["spot", "projector"])
@pytest.mark.parametrize("seed", [*SEEDS[:2], *others(*SEEDS[2:])])
def test_lights_are_mitsubas(device: Device, folder: Path, kind: str, seed: int) -> None:
    """All formats, filters, wrap modes, transforms of the image and of the light, angles; read, and saved."""
    mitsuba, rng = scalar_mitsuba(), np.random.default_rng(seed)
    read = scene(folder, emitter(kind, rng, folder))
    (light,) = read.lights
    points = points_before(light, rng)
    (theirs,) = mitsuba.load_file(str(folder / "scene.xml")).emitters()
    expected = mitsubas(mitsuba, theirs, points)
    assert np.count_nonzero(expected.any(axis=1)) > 10
    found = arriving(device, light, points)
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-4 * np.median(expected[expected > 0]))
    save_scene(read, folder / "saved.toml")
    (again,) = load(folder / "saved.toml").lights
    np.testing.assert_allclose(arriving(device, again, points), found, rtol=1e-6)


@pytest.mark.needs("mitsuba")
@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("kind", [SpotLight, ProjectorLight])
def test_lights_become_mitsubas(device: Device, kind: type[SpotLight | ProjectorLight], seed: int) -> None:
    """Lights of clrt are exported for `clrt bench agree`."""
    mitsuba, rng = scalar_mitsuba(), np.random.default_rng(seed)
    image = LightImage(
        pixels=rng.uniform(0, 2, (*rng.integers(2, 6, 2).tolist(), 3)).astype(np.float32),
        scale=(rng.uniform(-2, 2), rng.uniform(-2, 2)),
        offset=(rng.uniform(-1, 1), 0.3),
        rotation_degrees=rng.uniform(-180, 180),
        wrap=(("repeat", "repeat"), ("mirror", "mirror"), None)[seed % 3],
        filter=("linear", "nearest")[seed % 2],
    )
    place, direction, up = rng.normal(size=(3, 3)).tolist()
    light = kind(position=place, direction=direction, up=up, intensity=(3, 2, 1), image=image)
    if isinstance(light, SpotLight):
        outer = rng.uniform(20, 80)  # near the axis the arc cosine of Mitsuba's float32 has few digits
        light = replace(light, falloff="angle", inner_degrees=outer / 2, outer_degrees=outer)
    points = points_before(light, rng)
    theirs = mitsuba.load_dict(native(mitsuba, mitsuba_scene(Scene(lights=[light]))["light0"]))
    expected = mitsubas(mitsuba, theirs, points)
    found = arriving(device, light, points)
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-4 * np.median(expected[expected > 0]))


def test_mistakes_are_named(folder: Path) -> None:
    text = '<emitter type="projector">{}<transform name="to_world"><scale {}/></transform></emitter>'
    assert "line 1: emitter[0]: its to_world" in (said := problem(folder, text.format("", 'x="2"'))), said
    assert "stretches" in said and "scale uniformly" in said
    missing = '<texture name="irradiance" type="bitmap"><string name="filename" value="no.png"/></texture>'
    assert "no.png: no such picture file" in problem(folder, text.format(missing, 'x="1"'))
    wood = '<texture name="irradiance" type="wood"/>'
    assert "wood" in (said := problem(folder, text.format(wood, 'x="1"'))) and "bitmap or checkerboard" in said
