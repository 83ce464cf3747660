"""The plastic floor: its float64 model agrees with closed forms, the oracle's material, and clrt."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from clrt.bench.renderers.plastic_floor import MATERIALS, VIEWS, floor_scene, judges, lights, measure_floor
from clrt.bench.renderers.plastic_floor_model import MODELS, Lamp, Plastic, floor_radiance
from clrt.cli.bench_floor import floor_command
from clrt.scene.materials.material_types import MetallicRoughness
from clrt.scene.model import Environment, Scene

from ..oracle.materials.metallic_roughness import CookTorrance
from ..oracle.surface import Surface


def directions(count: int) -> np.ndarray:
    """Return random upward directions."""
    found = np.random.default_rng(2).normal(size=(count, 3))
    found[:, 1] = np.abs(found[:, 1]) + 0.05
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))


@pytest.mark.parametrize("roughness", [0.5, 0.8, 1.0])
def test_model_is_the_oracles(roughness: float) -> None:
    """Directional albedos and BSDFs were implemented independently; the oracle's +z is up."""
    wo, wi = directions(400), directions(800)[400:]
    up, flat = np.tile([0.0, 0.0, 1.0], (400, 1)), np.zeros((400, 3))
    surface = Surface(flat, up, up, np.ones(400, np.bool_), np.zeros((400, 2, 2)), np.ones((400, 4)))
    oracle = CookTorrance(MetallicRoughness(color=(1.0, 1.0, 1.0), roughness=roughness), surface)
    expected = oracle.evaluate(np.roll(wo, 1, axis=1), np.roll(wi, 1, axis=1))[:, 0]
    np.testing.assert_allclose(Plastic(roughness)(wo, wi) * wi[:, 1], expected, rtol=1e-3)


def white_sky(scene: Scene) -> Scene:
    return replace(scene, lights=[], environment=Environment(image=np.full((8, 16, 3), 2, np.float32)))


@pytest.mark.parametrize("name", ["model", "Fresnel"])
@pytest.mark.parametrize("material", [*MATERIALS])
def test_models_keep_the_energy_of_a_white_sky(name: str, material: str) -> None:
    """By reciprocity and energy conservation, a white floor has the environment's radiance from every view."""
    found = floor_radiance(white_sky(floor_scene("point", "75°", material)), MODELS[name])
    assert found.mean == pytest.approx(2, abs=4 * found.error + 2e-3)


def test_layering_by_the_view_keeps_energy_but_is_not_reciprocal() -> None:
    found = floor_radiance(white_sky(floor_scene("point", "75°", "roughness 0.1")), MODELS["by view"])
    assert found.mean == pytest.approx(2, abs=4 * found.error + 2e-3)
    wo, wi = directions(1), np.array([[0.0, 1.0, 0.0]])
    plastic = Plastic(0.1, MODELS["by view"])
    assert plastic(wo, wi)[0] != pytest.approx(plastic(wi, wo)[0], rel=1e-3)


def test_matte_floors_have_closed_forms() -> None:
    """Sun: cos/π. Area light: the irradiance of a polygon (Lambert 1760) at the floor's center."""
    assert floor_radiance(floor_scene("sun at 60°", "75°", "Lambert")).mean == pytest.approx(0.5 / np.pi, rel=1e-6)
    mesh = lights()["low lamp"]["meshes"][0]
    corners = mesh.vertices.astype(float)[::-1] / np.linalg.norm(mesh.vertices, axis=1)[::-1, None]
    irradiance = 0.0
    for a, b in zip(corners, np.roll(corners, -1, axis=0)):
        normal = np.cross(a, b)
        irradiance += np.arccos(a @ b) * normal[1] / np.linalg.norm(normal) / 2 * mesh.material.radiance[0]
    scene = floor_scene("low lamp", "above", "Lambert")
    found = floor_radiance(replace(scene, camera=replace(scene.camera, fov_degrees=0.01)))
    assert found.mean == pytest.approx(abs(irradiance) / np.pi, abs=4 * found.error)


def test_lamps_are_hit_as_densely_as_they_are_drawn() -> None:
    """The pdf over solid angle integrates to 1."""
    lamp, rng = Lamp(lights()["low lamp"]["meshes"][0]), np.random.default_rng(3)
    p = np.tile([0.3, 0.0, 0.2], (1 << 18, 1))
    wi = rng.normal(size=p.shape)
    _, density = lamp.light(p, wi / np.linalg.norm(wi, axis=1, keepdims=True))
    assert 4 * np.pi * density.mean() == pytest.approx(1, rel=0.03)
    assert np.all(lamp.light(p, lamp.draw(p, rng.random((len(p), 2))))[1] > 0)


@pytest.mark.parametrize("view", [*VIEWS])
@pytest.mark.parametrize("light", [*lights()])
def test_clrt_renders_its_model(light: str, view: str) -> None:
    scene = floor_scene(light, view, "roughness 0.5")
    expected, pixels = floor_radiance(scene), judges()[0]["clrt"](scene)(1024, 1).pixels[..., 0]
    assert pixels.mean() == pytest.approx(expected.mean, rel=3e-3, abs=4 * expected.error)


def test_table_names_the_judges_that_are_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    for package in ("mitsuba", "bpy"):
        monkeypatch.setitem(sys.modules, package, None)
    found, missing = judges()
    assert [*found] == ["clrt"] and missing == {
        "mitsuba": "not installed (pip install mitsuba)",
        "bpy": "not installed (pip install bpy)",
    }
    rows = list(measure_floor(found, 4, 2, ["sun above"]))
    assert [row["material"] for row in rows] == [*MATERIALS] * len(VIEWS)
    assert all(set(row["values"]) == {*MODELS, "clrt"} for row in rows)
    assert rows[0]["values"]["clrt"][0] == pytest.approx(1, rel=1e-5)


def test_lights_that_are_not_there_are_refused() -> None:
    result = CliRunner().invoke(floor_command, ["--light", "moon"])
    assert result.exit_code != 0 and "--light moon: is unknown; choose from sun above" in str(result.exception)
