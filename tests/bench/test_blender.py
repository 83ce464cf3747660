"""`clrt bench blender` without Blender: errors, ratios, and conversions to and from Blender."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

from clrt.bench.renderers.blender import compared, judge
from clrt.bench.renderers.blender_scenes import COLORS, MATERIALS, SCENES, SHAPES, bumps, emissive_square
from clrt.cli.bench_blender import blender_command
from clrt.errors import UsageError


def test_error_names_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "bpy", None)
    with pytest.raises(UsageError, match="pip install bpy"):
        judge(["point"], ["matte"], 4, 2)
    assert "pip install bpy" in str(CliRunner().invoke(blender_command, ["point"]).exception)


@pytest.mark.parametrize(("arguments", "known"), [(["moon"], SCENES), (["point", "--material", "moon"], MATERIALS)])
def test_names_that_are_not_there_are_refused(arguments: list[str], known: dict[str, object]) -> None:
    result = CliRunner().invoke(blender_command, arguments)
    assert result.exit_code != 0 and f"moon: is unknown; choose from {', '.join(known)}" in str(result.exception)


def test_materials_are_of_objects_that_there_are() -> None:
    assert SHAPES.keys() == COLORS.keys() and all(each.keys() <= COLORS.keys() for each in MATERIALS.values())


def test_ratios_are_of_means_over_each_region() -> None:
    """Over seeds only our image varies, by (1, −1, 1, −1)/10: the mean's standard error is √(4/3)/√4/10."""
    left = np.tile(np.arange(6) < 2, (4, 1))
    theirs = np.where(left[..., None], 0.5, 2.0) * np.ones((4, 1, 1, 3))
    ours = theirs * np.where(left, 1.5, 0.75)[..., None] + 0.1 * np.array([1, -1, 1, -1])[:, None, None, None]
    ratios, errors = compared(ours.astype(np.float32), theirs.astype(np.float32), {"left": left, "right": ~left})
    assert ratios == pytest.approx({"left": 1.5, "right": 0.75}, rel=1e-6)
    scatter = 0.1 * np.sqrt(4 / 3) / 2
    assert errors == pytest.approx({"left": scatter / 0.5, "right": scatter / 2}, rel=1e-5)


def test_area_lights_keep_their_power_place_and_side() -> None:
    """A light at Blender's (1, 2, 3) facing −z is at clrt's (1, 3, −2) facing −y. A Lambertian emitter of radiance L
    and area A emits the power πLA."""
    frame = np.eye(4)
    frame[:3, 3] = 1, 2, 3
    mesh = emissive_square(SimpleNamespace(matrix_world=frame, name="area", data=SimpleNamespace(size=0.5, energy=60)))
    a, b, c = mesh.vertices[mesh.faces].astype(np.float64).transpose(1, 0, 2)
    areas = np.cross(b - a, c - a) / 2
    np.testing.assert_allclose(areas.sum(0), [0, -0.25, 0], atol=1e-7)
    np.testing.assert_allclose(mesh.vertices.mean(0), [1, 3, -2], rtol=1e-6)
    assert np.pi * mesh.material.radiance[0] * 0.25 == pytest.approx(60) and not mesh.material.double_sided


def test_normal_map_is_that_of_a_surface() -> None:
    """Normals have unit length, and their slopes are a gradient: mixed periodic differences of the height agree."""
    normal = 2 * bumps() - 1
    np.testing.assert_allclose(np.linalg.norm(normal, axis=2), 1)
    slope = -normal[..., :2] / normal[..., 2:]
    across, along = (np.roll(slope[..., i], -1, axis=i) - np.roll(slope[..., i], 1, axis=i) for i in (0, 1))
    np.testing.assert_allclose(across, along, atol=1e-12)
    assert 0.45 < np.abs(slope).max() <= 0.5
