"""What holds for every type of light in LIGHTS, so that a new one is tested without a change here."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, ClassVar, get_type_hints

import numpy as np
import pytest

from clrt.bench.combinations.random_draws import Draws
from clrt.bench.kernel_probe import Doubles, Probe
from clrt.bench.renderers.mitsuba_scene import mitsuba_scene
from clrt.device.open import Device
from clrt.errors import SceneError, UsageError
from clrt.formats.load_scene import load
from clrt.output.scenes import save_scene
from clrt.rendering.compile.lights.light_types import LIGHT_KERNELS, TYPES
from clrt.scene.geometry.scaling import SceneFrame, in_frame
from clrt.scene.lights import (
    LENGTHS,
    LIGHTS,
    STRENGTHS,
    Bounds,
    DirectionalLight,
    DistantBounds,
    Light,
    PointLight,
    fields_of,
)
from clrt.scene.materials.material import Radiance
from clrt.scene.model import Scene

from ..covering import covering

SEEDS = range(4)
#: A power of two: multiplying by it is exact, unless results leave the range of normal floats.
UNIT = 2.0**-7


def random_light(kind: type[Light], seed: int) -> Light:
    """Return a light above the origin, directed at it."""
    draws = Draws(seed, seed, seed)
    x, z = draws.between(-1, 1), draws.between(-1, 1)
    while True:
        with suppress(SceneError):  # of random angles that do not go together
            return draws.record(
                kind,
                **fields_of(
                    kind,
                    {
                        "position": (x, 2.0, z),
                        "direction": (-x, -2.0, -z),
                        "intensity": draws.vector(1.0, 9.0),
                        "irradiance": draws.vector(0.5, 2.0),
                        "radiance": draws.vector(1.0, 9.0),
                        "radius": 0.5,
                        "range": draws.between(3.0, 6.0) if seed % 2 else None,
                    },
                ),
            )


def sampled(probe: Probe, p: Doubles, n: Doubles) -> tuple[Doubles, Doubles, Doubles]:
    """Return directions (n, 3), radiance (n, 3) and densities (n,) of light samples at points p (n, 3)."""
    out = probe("light_sample", 12, p, n, seed=1)
    return out[:, :3], out[:, 3:6], out[:, 6]


def points(count: int) -> tuple[Doubles, Doubles]:
    """Return points around the origin, many of them close to it, and unit normals in all directions."""
    rng = np.random.default_rng(5)
    n = rng.normal(size=(count, 3))
    return rng.normal(size=(count, 3)) * 10 ** rng.uniform(-4, 0.5, (count, 1)), n / np.linalg.norm(n, axis=1)[:, None]


def test_distant_lights_come_last_and_no_kernel_twice() -> None:
    assert len(set(TYPES)) == len(TYPES)
    distant = [name for kind in LIGHTS if kind.distant for name in kind.kernels()]
    assert distant and list(LIGHT_KERNELS[-len(distant) :]) == distant


@pytest.mark.parametrize("kind", LIGHTS)
def test_a_type_is_what_it_says(kind: type[Light]) -> None:
    """Its lights are sampled by one of its kernels, which reads the same names for all of them; they are bounded as it
    says; and fields that have a unit are those known to have one."""
    names: dict[str, set[str]] = {}
    for seed in SEEDS:
        light = random_light(kind, seed)
        assert light.sampled_by in kind.kernels() and not light.is_black
        found = set(light.parameters()) - {"camera_hidden"}
        assert names.setdefault(light.sampled_by, found) == found
        assert isinstance(light.bounds(), DistantBounds if kind.distant else Bounds)
    known = {"position", "direction", "up", "image", "image_of", "falloff", "camera_visible", "light_group"}
    known |= {*STRENGTHS, *LENGTHS}
    assert all(field.name in known or field.name.endswith("_degrees") for field in fields(kind))
    assert {field.name for field in fields(kind)} & set(STRENGTHS)


@pytest.mark.parametrize("kind", LIGHTS)
def test_a_light_without_strength_is_black(kind: type[Light]) -> None:
    light = random_light(kind, 0)
    dark: dict[str, Any] = {name: (0.0, 0.0, 0.0) for name in STRENGTHS if name in vars(light)}
    assert replace(light, **dark).is_black
    blue: dict[str, Any] = dict.fromkeys(dark, (0.0, 0.0, 1.0))
    assert not replace(light, **blue).is_black


@covering("kind, seed", LIGHTS, SEEDS)
def test_lights_scale_with_the_scene(device: Device, kind: type[Light], seed: int) -> None:
    """In another unit of length, directions and irradiances at the same points are the same, digit by digit."""
    scene, (p, n) = Scene(lights=[random_light(kind, seed)]), points(256)
    smaller = in_frame(scene, SceneFrame((0.0, 0.0, 0.0), UNIT))
    assert smaller.lights != scene.lights or kind.distant
    wi, radiance, pdf = sampled(Probe(device, scene), p, n)
    other_wi, other_radiance, other_pdf = sampled(Probe(device, smaller), p * UNIT, n)
    assert np.array_equal(wi, other_wi) and radiance.any()
    np.testing.assert_allclose(other_radiance / other_pdf[:, None], radiance / pdf[:, None], rtol=1e-6)


@covering("kind, seed", LIGHTS, SEEDS)
def test_bounds_leave_out_nothing(device: Device, kind: type[Light], seed: int) -> None:
    """Where a sample of a light arrives above the horizon, the light has a positive probability beside another one."""
    light, (p, n) = random_light(kind, seed), points(4096)
    wi, radiance, _ = sampled(Probe(device, Scene(lights=[light])), p, n)
    lit = radiance.any(axis=1) & (np.sum(wi * n, axis=1) > 1e-3)
    assert np.count_nonzero(lit) > 10
    other = PointLight(position=(0.0, 9.0, 0.0), intensity=(1.0, 1.0, 1.0))
    number = int(TYPES.index("point") < TYPES.index(light.sampled_by))
    both = Probe(device, Scene(lights=[light, other]))
    assert np.all(both("light_probability", 1, p[lit], n[lit], np.full(int(lit.sum()), number)) > 0)


@pytest.mark.parametrize("kind", LIGHTS)
def test_scene_files_keep_lights(tmp_path: Path, kind: type[Light]) -> None:
    lights = [random_light(kind, seed) for seed in SEEDS]
    save_scene(Scene(lights=lights), tmp_path / "lights.toml")
    assert load(tmp_path / "lights.toml").lights == lights


@pytest.mark.parametrize("kind", LIGHTS)
def test_lights_need_a_direction(kind: type[Light]) -> None:
    light = random_light(kind, 0)
    if "direction" in get_type_hints(kind):
        given: dict[str, Any] = {"direction": (0.0, 0.0, 0.0)}
        with pytest.raises(SceneError, match="direction"):
            replace(light, **given)
    Scene(lights=[light])


@pytest.mark.parametrize("kind", LIGHTS)
def test_mitsuba_has_a_counterpart_or_a_message(kind: type[Light]) -> None:
    for seed in SEEDS:
        try:
            assert "type" in mitsuba_scene(Scene(lights=[random_light(kind, seed)]))["light0"]
        except UsageError as error:
            assert kind.kernel in str(error) or "light" in str(error)


@dataclass(frozen=True, kw_only=True)
class Globe(PointLight):
    """A light that is not in LIGHTS, with fields that none of these has."""

    kernel: ClassVar[str] = "globe"
    intensity: Radiance = (0.0, 0.0, 0.0)
    radius: float
    radiance: Radiance


def test_names_of_fields_say_how_they_scale() -> None:
    """Radiance and angles do not depend on the unit of length, lengths do, W/sr by its square."""
    globe = Globe(position=(1.0, 2.0, 3.0), radius=4.0, radiance=(1.0, 2.0, 3.0), range=8.0)
    assert globe.in_unit(0.5) == replace(globe, radius=2.0, range=4.0)
    assert replace(globe, range=None).in_unit(2.0) == replace(globe, radius=8.0, range=None)
    point = PointLight(position=(0.0, 0.0, 1.0), intensity=(4.0, 8.0, 0.0))
    assert point.in_unit(0.5) == replace(point, intensity=(1.0, 2.0, 0.0))
    sun = DirectionalLight(direction=(0.0, -1.0, 0.0), irradiance=(1.0, 1.0, 1.0), angle_degrees=3.0)
    assert sun.in_unit(0.5) == sun
