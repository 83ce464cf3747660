"""Clamped contributions: exact where one contribution is the whole sample, and against the same samples unclamped."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clrt
from clrt.device.open import Device
from clrt.rendering.compile.choices import Choices
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.rendering.film.film import Film
from clrt.scene.materials.material_types import Dielectric, Diffuse, Mirror
from clrt.scene.model import Camera, Environment, RenderSettings, Scene, Sphere
from clrt.scene.render_settings import Integrator

from .checkpoints import renderer, run, same
from .pictures import film
from .test_noise import room
from .test_variants import everything

pytestmark = pytest.mark.statistics

SKY = np.array([1.0, 2.0, 4.0])


def clamped(scene: Scene, direct: float = 0.0, indirect: float = 0.0, **settings: Any) -> Scene:
    return replace(scene, render=replace(scene.render, clamp_direct=direct, clamp_indirect=indirect, **settings))


@pytest.mark.parametrize("lanes", [1, 8])
@pytest.mark.parametrize(
    "balls, edges",
    [
        ([], 1),
        ([Sphere(material=Diffuse(color=(0, 0, 0), emission=(1, 2, 4)))], 1),
        ([Sphere(material=Mirror())], 2),
        ([Sphere(material=Dielectric(ior=1.0))], 3),
    ],
    ids=["sky", "emitter", "mirror", "passage"],
)
def test_light_that_is_all_of_a_sample(device: Device, balls: list[Sphere], edges: int, lanes: int) -> None:
    """A sky seen directly, in a mirror, or through two surfaces: direct up to depth 2, indirect beyond."""
    scene = Scene(
        spheres=balls,
        environment=Environment(color=(1, 2, 4)),
        camera=Camera(fov_degrees=5),
        render=RenderSettings(size=(8, 8), spp=2, max_depth=4),
    )
    for direct, indirect in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (3.0, 0.5), (9.0, 9.0)):
        limit = (direct if edges <= 2 else indirect) or np.inf
        found = film(device, clamped(scene, direct, indirect), lanes=lanes)
        expected = SKY * min(1.0, limit / 4)
        np.testing.assert_allclose(found.mean, np.broadcast_to(expected, (8, 8, 3)), rtol=1e-6)
        assert found.clamped_part == pytest.approx(1 - min(1.0, limit / 4), abs=1e-6)


@pytest.mark.parametrize("lanes", [1, 8])
def test_what_is_left_and_what_was_taken_are_the_picture(device: Device, lanes: int) -> None:
    """Paths are the same with and without clamps: no pixel is brighter, and result plus removed
    light equals the original.
    """

    def grey(found: Film) -> Any:
        return found.mean.mean(axis=2)

    def taken(found: Film) -> Any:
        return found.pixels["clamped"] / np.maximum(found.pixels["count"], 1)

    whole = film(device, everything(), lanes=lanes, direct_light=True)
    for direct, indirect in ((0.5, 0.0), (0.0, 0.05), (0.5, 0.05)):
        found = film(device, clamped(everything(), direct, indirect), lanes=lanes, direct_light=True)
        assert np.all(found.mean <= whole.mean * (1 + 1e-6)) and 0.01 < found.clamped_part < 0.9
        np.testing.assert_allclose(grey(found) + taken(found), grey(whole), rtol=1e-4)
        assert np.array_equal(found.direct, whole.direct) == (direct == 0)
        indirect_light = (found.mean - found.direct, whole.mean - whole.direct)
        assert np.allclose(*indirect_light, rtol=1e-4, atol=1e-6) == (indirect == 0)
    endless = film(device, clamped(everything(), 1e30, 1e30), lanes=lanes, direct_light=True)
    assert np.array_equal(endless.mean, whole.mean) and endless.clamped_part == 0


def test_the_report_names_the_bias(device: Device) -> None:
    """The report has the clamps in force, the removed share of light, and one warning."""
    scene = Scene(spheres=[Sphere(material=Mirror())], environment=Environment(color=(1, 2, 4)))
    chosen: dict[str, Any] = {"size": (8, 8), "spp": 2, "device": device.info.index}
    report = clrt.render(scene, clamp_direct=1.0, **chosen).report
    assert (report["biased_by"], report["clamp_direct"], report["clamp_indirect"]) == (["clamp_direct"], 1.0, 0.0)
    assert report["clamped_part"] == pytest.approx(0.75)
    assert report["warnings"] == [
        "the image is biased by clamp_direct: 75.00% of the light was removed; the "
        "estimated error does not include this bias"
    ]
    others: list[tuple[float, Integrator]] = [(0.0, "path"), (1.0, "local")]
    for clamp, integrator in others:
        report = clrt.render(scene, clamp_direct=clamp, integrator=integrator, **chosen).report
        assert report["biased_by"] == report["warnings"] == [] and "clamped_part" not in report


def test_a_checkpoint_keeps_what_was_removed(device: Device, tmp_path: Path) -> None:
    scene = clamped(room(), 0.5, 0.05)
    at_once = renderer(device, scene)
    expected = run(at_once, spp=16)
    run(renderer(device, scene, checkpoint=tmp_path / "a.ck"), spp=8)
    resumed = renderer(device, scene, checkpoint=tmp_path / "a.ck", resume=True)
    found = run(resumed, spp=16)
    assert same(at_once, resumed)
    assert found.film.clamped_part == expected.film.clamped_part > 0.01


def test_code_for_clamps_is_compiled_where_they_are_in_force() -> None:
    def has_it(**settings: Any) -> bool:
        return "CLAMP" in compile_scene(clamped(everything(), **settings), Choices()).features

    assert has_it(direct=1.0) and has_it(indirect=1.0)
    assert not has_it() and not has_it(direct=1.0, integrator="local")
