"""Sheen: the table against the integral that it approximates, and roughness from a texture."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from clrt.device.open import Device
from clrt.device.programs.kernel_files import kernel_folder
from clrt.scene.lights import DirectionalLight
from clrt.scene.materials.material_types import MetallicRoughness
from clrt.scene.materials.textures import Picture, Texture
from clrt.scene.model import Scene

from .sheen import albedo, interpolated
from .test_textures import quad, seen

pytestmark = pytest.mark.statistics

BLACK, WHITE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)


def table() -> Any:
    """Return the kernel's table (12, 8)."""
    rows = re.findall(r"^    \{(.*)\},$", (kernel_folder() / "bsdf" / "sheen.cl").read_text(), re.MULTILINE)
    return np.array([[float(number.rstrip("f")) for number in row.split(",")] for row in rows])


def test_the_table_is_the_integrals_interpolation() -> None:
    """Each coefficient agrees to float32 precision."""
    np.testing.assert_allclose(table(), interpolated(*table().shape), rtol=1e-5, atol=1e-6)


def test_the_table_is_as_near_as_it_says() -> None:
    roughness, cosines = np.linspace(0.1, 1, 37), np.linspace(1e-4, 1, 400)
    x, y = 2 * np.sqrt(cosines) - 1, 1 + 2 * np.log10(roughness)
    off = np.abs(np.polynomial.polynomial.polygrid2d(x, y, table()).T - [albedo(cosines, r**-2) for r in roughness])
    assert off.max() < 2.5e-3 and off[:, cosines > 0.02].max() < 7.1e-4


@pytest.mark.parametrize("factor", [1.0, 0.7])
def test_roughness_comes_from_the_alpha_channel(device: Device, factor: float) -> None:
    """The two halves of a texture equal two sheets with constant roughness."""
    texels = np.zeros((1, 2, 4), np.uint8)
    texels[0, :, 3] = 51, 204
    painted = Texture(picture=Picture(texels), channel="alpha", filter="nearest", factor=factor)

    def sheet(roughness: float | Texture) -> Any:
        cloth = MetallicRoughness(color=BLACK, specular=0.0, sheen_color=WHITE, sheen_roughness=roughness)
        sun = DirectionalLight(direction=(-3, -2, -1), irradiance=(1.0, 1.0, 1.0))
        return seen(device, Scene(meshes=[quad(cloth)], lights=[sun]), size=16, spp=4, filter="box")

    found, left, right = sheet(painted), sheet(0.2 * factor), sheet(0.8 * factor)
    assert left.mean() < 0.8 * right.mean()
    np.testing.assert_allclose(found[:, :8], left[:, :8], rtol=1e-5)
    np.testing.assert_allclose(found[:, 8:], right[:, 8:], rtol=1e-5)
