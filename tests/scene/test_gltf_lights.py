"""Lights in glTF files: where their nodes put them, in our units, and what is wrong with them."""

from __future__ import annotations

import logging
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clrt.errors import SceneError
from clrt.scene.file import load
from clrt.scene.lights import DirectionalLight, PointLight, SpotLight
from clrt.scene.sky import SUN

from .glb import Gltf

NAME = "KHR_lights_punctual"
DOWN = [-math.sqrt(0.5), 0, 0, math.sqrt(0.5)]    # a quarter turn about x: −Z becomes −Y


def lit(*lights: dict[str, Any]) -> Gltf:
    """A triangle, and lights that no node holds yet."""
    gltf = Gltf()
    gltf.mesh(attributes={"POSITION": gltf.accessor(np.eye(3, dtype=np.float32))})
    gltf.document |= {"extensionsUsed": [NAME], "extensionsRequired": [NAME], "extensions": {NAME: {"lights": lights}}}
    return gltf


def held(index: int) -> dict[str, Any]:
    return {NAME: {"light": index}}


def test_lights_stand_where_their_nodes_do(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Position and −Z of a node in the world; scales turn nothing brighter. candela are W/sr, lux W/m²."""
    cone = {"innerConeAngle": math.pi / 12, "outerConeAngle": math.pi / 6}
    gltf = lit({"type": "point", "color": [1, 0.5, 0.25], "intensity": 40, "name": "bulb"},
               {"type": "directional", "intensity": 3}, {"type": "spot", "intensity": 100, "spot": cone},
               {"type": "spot"}, {"type": "point", "name": "not in the scene"})
    inner = gltf.node(root=False, translation=[0, 0, 2], extensions=held(2))
    gltf.node(children=[inner], translation=[1, 2, 3], rotation=DOWN, scale=[2, 2, -2])
    gltf.node(translation=[0, 5, 0], scale=[9, 9, 9], extensions=held(0))
    gltf.node(rotation=DOWN, extensions=held(1))
    gltf.node(extensions=held(3))
    scene = load(gltf.write(tmp_path / "lamps.glb"))
    spot, point, sun, default = scene.lights
    assert isinstance(spot, SpotLight) and isinstance(sun, DirectionalLight)
    assert point == PointLight(position=(0, 5, 0), intensity=(40, 20, 10))
    np.testing.assert_allclose(sun.direction, (0, -1, 0), atol=1e-12)
    assert sun.irradiance == (3.0, 3.0, 3.0)
    np.testing.assert_allclose(spot.position, (1, -2, 3), atol=1e-12)   # −2·2 along the turned z, which is +y
    np.testing.assert_allclose(spot.direction, (0, 1, 0), atol=1e-12)
    assert spot.intensity == (100.0, 100.0, 100.0)
    assert (spot.inner_degrees, spot.outer_degrees) == pytest.approx((15, 30))
    assert default == SpotLight(position=(0, 0, 0), direction=(0, 0, -1), intensity=(1, 1, 1))
    assert not caplog.records


def test_models_without_lights_have_the_sun(tmp_path: Path) -> None:
    assert load(lit({"type": "point"}).write(tmp_path / "dark.glb")).lights == [SUN]


def test_cones_of_one_width_are_sharp(tmp_path: Path) -> None:
    """Against the specification, but exporters write them; half a turn is float32's."""
    wide = float(np.float32(math.pi / 2))
    gltf = lit({"type": "spot", "spot": {"innerConeAngle": wide, "outerConeAngle": wide}})
    gltf.node(extensions=held(0))
    spot, = load(gltf.write(tmp_path / "spot.gltf")).lights
    assert isinstance(spot, SpotLight) and 89.9 < spot.inner_degrees < spot.outer_degrees == 90


def test_ranges_are_left_out_and_said_so(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    gltf = lit({"type": "point", "range": 4.0})
    gltf.node(extensions=held(0), scale=[0, 0, 0])
    path = gltf.write(tmp_path / "near.glb")
    with caplog.at_level(logging.WARNING):
        assert len(load(path).lights) == 1
    assert [record.getMessage() for record in caplog.records] == [f"{path}: left out: ranges of lights"]


@pytest.mark.parametrize(("light", "words"), [
    ({"type": "area"}, r"extensions.KHR_lights_punctual.lights\[0\].type: "),
    ({"type": "point", "intensity": -1}, r"lights\[0\].intensity: .*greater than or equal to 0"),
    ({"type": "point", "color": [1, 1]}, r"lights\[0\].color"),
    ({"type": "spot", "spot": {"outerConeAngle": 2}}, r"lights\[0\].spot.outerConeAngle: "),
    ({"type": "point", "intensity": 1e39}, r"light\[0\].intensity: .* is beyond the range of float32")])
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
