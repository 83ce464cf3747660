"""Lights in glTF files: position and units, and errors."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clrt.errors import SceneError
from clrt.formats.load_scene import load
from clrt.formats.model_choice import ModelChoice
from clrt.output.scenes import save_scene
from clrt.scene.axes_and_units import LightUnit
from clrt.scene.default_sky import SUN
from clrt.scene.lights import DirectionalLight, PointLight, SpotLight
from clrt.scene.studio import KEY

from .glb import Gltf

NAME = "KHR_lights_punctual"
DOWN = [-math.sqrt(0.5), 0, 0, math.sqrt(0.5)]  # A quarter turn about x: −Z becomes −Y


def lit(*lights: dict[str, Any]) -> Gltf:
    """Return a triangle, and lights that no node uses yet."""
    gltf = Gltf()
    gltf.mesh(attributes={"POSITION": gltf.accessor(np.eye(3, dtype=np.float32))})
    gltf.document |= {"extensionsUsed": [NAME], "extensionsRequired": [NAME], "extensions": {NAME: {"lights": lights}}}
    return gltf


def held(index: int) -> dict[str, Any]:
    return {NAME: {"light": index}}


def test_lights_stand_where_their_nodes_do(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """They have the world position and −Z of their nodes; scales do not affect intensity."""
    cone = {"innerConeAngle": math.pi / 12, "outerConeAngle": math.pi / 6}
    gltf = lit(
        {"type": "point", "color": [1, 0.5, 0.25], "intensity": 40, "name": "bulb"},
        {"type": "directional", "intensity": 3},
        {"type": "spot", "intensity": 100, "spot": cone},
        {"type": "spot"},
        {"type": "point", "name": "not in the scene"},
    )
    inner = gltf.node(root=False, translation=[0, 0, 2], extensions=held(2))
    gltf.node(children=[inner], translation=[1, 2, 3], rotation=DOWN, scale=[2, 2, -2])
    gltf.node(translation=[0, 5, 0], scale=[9, 9, 9], extensions=held(0))
    gltf.node(rotation=DOWN, extensions=held(1))
    gltf.node(extensions=held(3))
    scene = load(gltf.write(tmp_path / "lamps.glb"), choice=ModelChoice(light_unit="radiometric"))
    spot, point, sun, default = scene.lights
    assert isinstance(spot, SpotLight) and isinstance(sun, DirectionalLight)
    assert point == PointLight(position=(0, 5, 0), intensity=(40, 20, 10))
    np.testing.assert_allclose(sun.direction, (0, -1, 0), atol=1e-12)
    assert sun.irradiance == (3.0, 3.0, 3.0)
    np.testing.assert_allclose(spot.position, (1, -2, 3), atol=1e-12)  # −2·2 along the rotated z, which is +y
    np.testing.assert_allclose(spot.direction, (0, 1, 0), atol=1e-12)
    assert spot.intensity == (100.0, 100.0, 100.0)
    assert (spot.inner_degrees, spot.outer_degrees) == pytest.approx((15, 30))
    assert default == SpotLight(position=(0, 0, 0), direction=(0, 0, -1), intensity=(1, 1, 1))
    assert not caplog.records


def blender_lights(mode: str, sun: float, watts: float, energy: float = 1.0) -> list[dict[str, Any]]:
    """Return what Blender's exporter writes for a sun, a point and a spot light, in W/m² and W: its __gather_intensity
    in the lighting modes SPEC, COMPAT and RAW. energy: a factor to all of them."""
    lumens = 683 if mode == "SPEC" else 1
    solid_angle = 1 if mode == "RAW" else 4 * math.pi
    strengths = {
        "directional": sun * lumens,
        "point": watts * lumens / solid_angle,
        "spot": watts * lumens / solid_angle,
    }
    return [{"type": kind, "intensity": energy * strength} for kind, strength in strengths.items()]


def one_of_each(lights: list[dict[str, Any]], generator: str) -> Gltf:
    """Return a scene 8 wide with a sun, and with a point and a spot light 3 above it."""
    gltf = Gltf()
    corners = np.array([[-4, 0, -4], [4, 0, -4], [0, 0, 4]], np.float32)
    gltf.mesh(attributes={"POSITION": gltf.accessor(corners)})
    gltf.document["asset"]["generator"] = generator
    gltf.document |= {"extensionsUsed": [NAME], "extensions": {NAME: {"lights": lights}}}
    for index in range(len(lights)):
        gltf.node(translation=[0, 3, 0], rotation=DOWN, extensions=held(index))
    return gltf


@pytest.mark.parametrize(
    ("mode", "generator", "choice"),
    [
        ("SPEC", "Khronos glTF Blender I/O v4.2.57", None),
        ("COMPAT", "Khronos glTF Blender I/O v4.2.57", None),
        ("RAW", "Khronos glTF Blender I/O v4.2.57", "blender"),
        ("RAW", "Khronos glTF Blender I/O v3.5.30", None),
        ("RAW", "Khronos glTF Blender I/O v1.6.16", None),
        ("RAW", "Khronos Blender glTF 2.0 I/O", None),
    ],
)
@pytest.mark.parametrize("energy", [0.1, 1, 10])
def test_blenders_lights_have_blenders_strength(
    tmp_path: Path, mode: str, generator: str, choice: LightUnit | None, energy: float
) -> None:
    """By default a sun of 0.3 to 30 W/m², and lights of 100 W to 10 kW within the scene."""
    gltf = one_of_each(blender_lights(mode, 3, 1000, energy), generator)
    scene = load(gltf.write(tmp_path / "lights.glb"), choice=ModelChoice(light_unit=choice))
    sun, point, spot = scene.lights
    assert isinstance(sun, DirectionalLight) and isinstance(point, PointLight) and isinstance(spot, SpotLight)
    assert sun.irradiance == pytest.approx([3 * energy] * 3)
    assert point.intensity == spot.intensity == pytest.approx([1000 * energy / (4 * math.pi)] * 3)


@pytest.mark.parametrize(
    ("lights", "size", "unit"),
    [
        ([("point", 15), ("point", 80), ("point", 180)], 0.5, "photometric"),  # a room's lamp, by RapidCompact
        ([("directional", 100_000)], 8, "photometric"),
        ([("directional", 3)], 8, "radiometric"),  # as three.js and Babylon.js have suns
        ([("point", 5), ("spot", 10), ("directional", 1)], 8, "radiometric"),
        ([("point", 20_000)], 200, "radiometric"),
    ],
)
def test_bright_lights_are_in_candela_and_lux(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, lights: list[tuple[str, float]], size: float, unit: LightUnit
) -> None:
    """Bright for the size of the scene; one line says so, unless the unit was given."""
    gltf = lit(*({"type": kind, "intensity": strength} for kind, strength in lights))
    gltf.document["nodes"][0]["scale"] = [size] * 3
    for index in range(len(lights)):
        gltf.node(rotation=DOWN, extensions=held(index))
    file = gltf.write(tmp_path / "lights.glb")
    found = load(file).lights
    assert len(caplog.records) == (unit == "photometric")
    assert not caplog.records or "candela and lux" in caplog.text and "--light-unit radiometric" in caplog.text
    caplog.clear()
    expected = [strength / (683 if unit == "photometric" else 1) for _, strength in lights]
    strengths = [
        light.irradiance if isinstance(light, DirectionalLight) else vars(light)["intensity"] for light in found
    ]
    assert [strength[0] for strength in strengths] == pytest.approx(expected)
    assert load(file, choice=ModelChoice(light_unit=unit)).lights == found
    assert not caplog.records


def test_units_of_scene_files(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """A message says how lights were converted if they are used and no unit was given."""
    gltf = lit({"type": "directional", "intensity": 6830})
    gltf.node(rotation=DOWN, extensions=held(0))
    gltf.write(tmp_path / "sun.glb")
    scene = tmp_path / "scene.toml"
    for unit, irradiance in {None: 10, "photometric": 10, "radiometric": 6830, "blender": 6830}.items():
        line = "" if unit is None else f'light_unit = "{unit}"\n'
        scene.write_text(f'[[mesh]]\nfile = "sun.glb"\nlights = true\n{line}')
        caplog.clear()
        (sun,) = load(scene).lights
        assert isinstance(sun, DirectionalLight) and sun.irradiance == pytest.approx([irradiance] * 3)
        assert ('candela and lux, and divided by 683 lm/W; light_unit = "radiometric"' in caplog.text) == (unit is None)
    caplog.clear()
    scene.write_text('[[mesh]]\nfile = "sun.glb"\n')
    assert load(scene).lights == [] and not caplog.records
    scene.write_text('[[mesh]]\nfile = "sun.glb"\nlight_unit = "lumen"\n')
    with pytest.raises(SceneError, match=r'light_unit: "lumen".*photometric'):
        load(scene)


def test_models_without_lights_have_those_of_the_look(tmp_path: Path) -> None:
    dark = lit({"type": "point"}).write(tmp_path / "dark.glb")
    assert load(dark, look="sky").lights == [SUN] and load(dark).lights == [KEY]


def test_cones_of_one_width_are_sharp(tmp_path: Path) -> None:
    """The specification forbids equal angles, but exporters write them; the limit pi/2 is that of float32."""
    wide = float(np.float32(math.pi / 2))
    gltf = lit({"type": "spot", "spot": {"innerConeAngle": wide, "outerConeAngle": wide}})
    gltf.node(extensions=held(0))
    (spot,) = load(gltf.write(tmp_path / "spot.gltf")).lights
    assert isinstance(spot, SpotLight) and 89.9 < spot.inner_degrees < spot.outer_degrees == 90


def test_ranges_are_those_of_the_file(tmp_path: Path) -> None:
    """Scales do not change them; directional lights have none."""
    gltf = lit({"type": "point", "range": 4.0}, {"type": "spot", "range": 0.5}, {"type": "directional", "range": 1.0})
    for index in range(3):
        gltf.node(extensions=held(index), scale=[9, 9, 9])
    point, spot, sun = load(gltf.write(tmp_path / "near.glb")).lights
    assert isinstance(point, PointLight) and isinstance(spot, SpotLight) and isinstance(sun, DirectionalLight)
    assert (point.range, spot.range) == (4.0, 0.5)


def test_a_scene_file_asks_for_a_models_lights(tmp_path: Path) -> None:
    """They are transformed with the mesh, and written only once."""
    gltf = lit({"type": "point", "range": 4.0}, {"type": "spot"}, {"type": "directional"})
    for index in range(3):
        gltf.node(translation=[1, 0, 0], extensions=held(index))
    gltf.write(tmp_path / "lamps.glb")
    scene = tmp_path / "scene.toml"
    scene.write_text(
        '[[mesh]]\nfile = "lamps.glb"\nlights = true\nscale = 2\nrotate_degrees = [0, 90, 0]\ntranslate = [0, 5, 0]\n'
    )
    point, spot, sun = load(scene).lights
    assert isinstance(point, PointLight) and isinstance(spot, SpotLight) and isinstance(sun, DirectionalLight)
    np.testing.assert_allclose(point.position, (0, 5, -2), atol=1e-6)  # A quarter turn about +y takes +x to −z
    np.testing.assert_allclose(spot.position, (0, 5, -2), atol=1e-6)
    for light in (spot, sun):
        np.testing.assert_allclose(light.direction, (-1, 0, 0), atol=1e-6)
    assert (point.range, point.intensity) == (4.0, (1.0, 1.0, 1.0))
    save_scene(load(scene), tmp_path / "again.toml")
    assert load(tmp_path / "again.toml").lights == [point, spot, sun]
    scene.write_text('[[mesh]]\nfile = "lamps.glb"\n')
    assert load(scene).lights == []


@pytest.mark.parametrize(
    ("light", "words"),
    [
        ({"type": "area"}, r"extensions.KHR_lights_punctual.lights\[0\].type: "),
        ({"type": "point", "intensity": -1}, r"lights\[0\].intensity: .*greater than or equal to 0"),
        ({"type": "point", "color": [1, 1]}, r"lights\[0\].color"),
        ({"type": "spot", "spot": {"outerConeAngle": 2}}, r"lights\[0\].spot.outerConeAngle: "),
        ({"type": "point", "intensity": 1e42}, r"PointLight.intensity: .* is outside the range of float32"),
    ],
)
def test_mistakes_are_named(tmp_path: Path, light: dict[str, Any], words: str) -> None:
    gltf = lit(light)
    gltf.node(extensions=held(0))
    with pytest.raises(SceneError, match=f"bad.glb: .*{words}"):
        load(gltf.write(tmp_path / "bad.glb"))


def test_a_light_that_is_not_there(tmp_path: Path) -> None:
    gltf = lit()
    gltf.node(extensions=held(1))
    with pytest.raises(SceneError, match="a node uses light 1, but the file has 0"):
        load(gltf.write(tmp_path / "bad.glb"))
