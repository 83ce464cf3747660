"""Rough metal and glass of Mitsuba: the values of what is read beside Mitsuba's own BSDFs."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from clrt.bench.numerics.bsdf_cases import bsdfs
from clrt.device.open import Device
from clrt.scene.materials.material_types import Conductor, Dielectric, Material

from ..covering import covering
from .test_mitsuba_xml import material

#: Of float32, most of it by the cancellation in half vectors of refraction, and in the exponent of Beckmann's.
FLOAT = 1e-3
GLASS = '<float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/>'
TINTS = """<rgb name="specular_reflectance" value="0.9, 0.5, 0.2"/>
    <rgb name="specular_transmittance" value="0.3, 0.6, 0.8"/>"""
METAL = '<rgb name="eta" value="0.2, 0.9, 1.1"/><rgb name="k" value="3.9, 2.4, 2.1"/>'
BRUSHED = '<float name="alpha_u" value="0.5"/><float name="alpha_v" value="0.15"/>'
CASES = {"roughdielectric": GLASS + TINTS, "roughconductor": METAL, "roughconductor, brushed": METAL + BRUSHED}


@pytest.mark.needs("mitsuba")
@covering("kind, distribution, alpha", CASES, ["ggx", "beckmann"], [0.1, 0.3, 0.6])
def test_values_are_mitsubas(folder: Path, device: Device, kind: str, distribution: str, alpha: float) -> None:
    """f·|cos| at random directions on both sides, for light from both sides of glass."""
    mitsuba = import_module("mitsuba")
    mitsuba.set_variant("scalar_rgb")
    given = "" if BRUSHED in CASES[kind] else f'<float name="alpha" value="{alpha}"/>'
    text = f"""<bsdf type="{kind.partition(",")[0]}"><string name="distribution" value="{distribution}"/>
        {given}{CASES[kind]}</bsdf>"""
    theirs = mitsuba.load_string(text.replace("<bsdf ", '<bsdf version="3.0.0" ', 1))
    read = material(folder, text)
    assert isinstance(read, Conductor | Dielectric)
    ours = bsdfs(device, [read])
    w = np.random.default_rng(int(100 * alpha)).normal(size=(2, 600, 3))
    wo, wi = (w / np.linalg.norm(w, axis=2, keepdims=True)).astype(np.float32).astype(np.float64)
    wo[:, 2] = np.abs(wo[:, 2]) + 0.02
    wo = (wo / np.linalg.norm(wo, axis=1, keepdims=True)).astype(np.float32).astype(np.float64)
    context, hit = mitsuba.BSDFContext(), mitsuba.SurfaceInteraction3f()
    for front in (True, False) if kind == "roughdielectric" else (True,):
        side = np.array([1.0, 1.0, 1.0 if front else -1.0])
        expected = []
        for o, i in zip((wo * side).tolist(), (wi * side).tolist()):
            hit.wi = o
            expected.append(np.array(theirs.eval(context, hit, i)).ravel())
        bright = np.array(expected) > 1e-5
        assert bright.any(axis=1).sum() > 10
        value = ours.value(0, wo, wi, front)[0]
        np.testing.assert_allclose(value[bright], np.array(expected)[bright], rtol=FLOAT, atol=1e-6)


@pytest.mark.parametrize("kind", ["dielectric", "thindielectric"])
def test_tints_of_smooth_glass(folder: Path, device: Device, kind: str) -> None:
    """Reflected light is multiplied by specular_reflectance, refracted light by specular_transmittance."""
    read = material(
        folder, f'<bsdf type="{kind}">{GLASS}<rgb name="specular_reflectance" value="0.5, 0.2, 0.1"/></bsdf>'
    )
    assert isinstance(read, Material)
    wo = np.array([0.6, 0.0, 0.8])
    numbers = np.random.default_rng(3).integers(1 << 24, size=(500, 3)) / (1 << 24)
    wi, weight, _, _ = bsdfs(device, [read]).sample(0, wo, numbers)
    up = wi[:, 2] > 0
    assert up.any() and not up.all()
    np.testing.assert_allclose(weight[up] / weight[up].max(), np.tile([1, 0.4, 0.2], (up.sum(), 1)), rtol=1e-5)
    np.testing.assert_allclose(weight[up][:, 0], 0.5, rtol=1e-5)
    np.testing.assert_allclose(weight[~up], 1, rtol=1e-5)
