"""Disney's principled BSDF beside its float64 implementation, and what of it is compiled."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from clrt.bench.kernel_probe import Doubles
from clrt.bench.numerics.bsdf_cases import bsdfs
from clrt.bench.numerics.scattering import above
from clrt.device.open import Device
from clrt.scene.materials.material_types import Conductor, Material, Principled
from clrt.scene.materials.principled import PARTS
from clrt.scene.materials.textures import Picture, Texture
from clrt.scene.model import Mesh

from ..oracle.draws import Draws, random_material
from ..oracle.materials import scattering_of
from ..oracle.scenes import todays_seed
from ..oracle.surface import Surface
from .test_anisotropy import SQUARE, UV, lit


def seen(count: int, front: bool) -> Surface:
    """Return plain surfaces."""
    up, none = np.tile([0.0, 0.0, 1.0], (count, 1)), np.zeros((count, 2, 2))
    return Surface(np.zeros((count, 3)), up, up, np.full(count, front), none, np.ones((count, 4)))


@pytest.mark.statistics
def test_values_are_those_of_the_oracle(device: Device) -> None:
    """f·|cos| of random materials at random directions on both sides."""
    seed = todays_seed()
    print(f"seed {seed}")
    given = [random_material(Draws(seed, number, 0), Principled, opaque=True) for number in range(60)]
    materials: list[Material] = [replace(each.without_textures(), emission=(0.0, 0.0, 0.0)) for each in given]
    found, wo, wi = bsdfs(device, materials), above(400, seed), above(400, seed + 1)
    wi[::3, 2] *= -1
    for which, material in enumerate(materials):
        for front in (True, False):
            value = found.value(which, wo, wi, front)[0]
            expected = scattering_of(material, seen(len(wo), front)).evaluate(wo, wi)
            np.testing.assert_allclose(value, expected, rtol=2e-3, atol=1e-6, err_msg=f"{material}, front: {front}")


@pytest.mark.parametrize("part", PARTS)
def test_lobes_that_are_not_used_are_not_compiled(part: str) -> None:
    """Each strength adds its own feature, also as a texture; the others add none."""
    assert not Principled(metallic=0.5, clearcoat_gloss=1.0, sheen_tint=1.0).features()
    texture = Texture(picture=Picture(np.full((1, 1, 4), 128, np.uint8)))
    for value in (0.5, texture):
        given: dict[str, Any] = {PARTS[part][0]: value}
        features = Principled(**given).features()
        assert {each for each in features if each in PARTS} == {part}
        assert ("TRANSMISSION" in features) == (part == "PRINCIPLED_TRANSMISSION")
        assert Principled(**given).without_textures().features() == features


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_it_is_brushed_along_u(device: Device, side: float, turned: bool) -> None:
    """White metal is brushed metal that reflects all light, with alpha over and times √(1 − 0.9·anisotropic)."""
    aspect = np.sqrt(1 - 0.9 * 0.8)
    alphas = 0.4**2 / aspect, 0.4**2 * aspect
    along, across = np.sqrt(alphas).tolist()
    perfect: dict[str, Any] = {"eta": (0.01,) * 3, "k": (100.0,) * 3, "smith": "separable"}
    metals = [
        Principled(color=(1.0, 1.0, 1.0), metallic=1.0, roughness=0.4, anisotropic=0.8),
        Conductor(roughness=along, roughness_across=across, **perfect),
    ]
    v, light = unit([0.3, 0.5, side]), unit([0.4, -0.2, side])
    for uv in (np.roll(UV, 1, axis=0) if turned else UV, None):
        meshes = [Mesh(SQUARE, np.array([[0, 1, 2], [0, 2, 3]], np.int32), metal, uv=uv) for metal in metals]
        shown = [lit(device, mesh, tuple(5 * v), tuple(light)) for mesh in meshes]
        np.testing.assert_allclose(shown[0], shown[1], rtol=2e-3)


def unit(w: list[float]) -> Doubles:
    return np.asarray(np.array(w) / np.linalg.norm(w))
