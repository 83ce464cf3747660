"""Plastics of Mitsuba: what is read, and the model's values beside Mitsuba's own BSDFs."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

from clrt.bench.numerics.bsdf_cases import bsdfs
from clrt.device.open import Device
from clrt.formats.scene_parts.coats import coat as coat_under
from clrt.scene.materials.plastic import Distribution, Plastic, coat_of

from ..covering import covering
from .test_mitsuba_xml import material, problem

#: Of float32, of both quadratures over facets, and of Mitsuba's r of smooth coats, a fit.
QUADRATURE, FITTED = 1.5e-3, 3e-3


def fresnel(cosine: float, ior: float) -> float:
    """Return the unpolarized reflectance (Born and Wolf, 1.5.2)."""
    sine = np.sqrt(1 - cosine**2) / ior
    across, along = np.sqrt(1 - sine**2), ior * cosine
    s, p = (cosine - ior * across) / (cosine + ior * across), (along - across) / (along + across)
    return float(s**2 + p**2) / 2


@pytest.mark.parametrize("ior", [1.1, 1.3, 1.5, 1.9])
def test_smooth_coats(ior: float) -> None:
    """What they transmit of diffuse light is 1 − mean F; what they reflect inside follows by reciprocity."""
    coat = coat_of(ior, 0.0, "ggx")
    outside = quad(lambda cosine: 2 * cosine * fresnel(cosine, ior), 0, 1)[0]
    assert coat.mean == pytest.approx(1 - outside, abs=1e-3)
    assert coat.inside == pytest.approx(1 - (1 - outside) / ior**2, abs=1e-3)
    inside, scale = coat_under(ior, 0.0, "ggx")
    schlick = ((ior - 1) / (ior + 1)) ** 2
    schlick += (1 - schlick) / 21  # the integral of Schlick's (1 − cos)⁵, 2·cos·(1 − cos)⁵ over the cosine
    assert inside == coat.inside and scale == pytest.approx((1 - outside) ** 2 / (ior**2 * (1 - schlick)), rel=3e-3)


def test_what_is_read(folder: Path) -> None:
    given = """<bsdf type="roughplastic"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/>
        <float name="alpha" value="0.04"/><rgb name="diffuse_reflectance" value="0.1, 0.5, 0.9"/>
        <rgb name="specular_reflectance" value="0.5"/>{}</bsdf>"""
    expected = Plastic(color=(0.1, 0.5, 0.9), roughness=0.2, specular=(0.5,) * 3, distribution="beckmann")
    assert material(folder, given.format("")) == expected
    ggx = '<string name="distribution" value="ggx"/><boolean name="nonlinear" value="true"/>'
    found = material(folder, given.format(ggx))
    assert isinstance(found, Plastic) and (found.distribution, found.nonlinear) == ("ggx", True)
    smooth = material(folder, '<bsdf type="plastic"/>')
    assert isinstance(smooth, Plastic) and smooth.roughness == 0 and smooth.ior == pytest.approx(1.49 / 1.000277)
    said = problem(
        folder, '<shape type="sphere"><bsdf type="plastic"><float name="int_ior" value="0.9"/></bsdf></shape>'
    )
    assert "less dense" in said


@pytest.mark.needs("mitsuba")
@covering("roughness, distribution, nonlinear", [0.0, 0.2, 0.45, 0.7], ["ggx", "beckmann"], [False, True])
def test_values_are_mitsubas(device: Device, roughness: float, distribution: Distribution, nonlinear: bool) -> None:
    """f·cos at random directions; for a smooth coat that of the base, off the mirror direction."""
    mitsuba = import_module("mitsuba")
    mitsuba.set_variant("scalar_rgb")
    ours = Plastic(
        color=(0.6, 0.3, 0.1),
        specular=(1.0, 0.5, 0.2),
        roughness=roughness,
        distribution=distribution,
        nonlinear=nonlinear,
    )
    given = {
        "type": "roughplastic" if roughness else "plastic",
        "int_ior": 1.5,
        "ext_ior": 1.0,
        "nonlinear": nonlinear,
        "diffuse_reflectance": {"type": "rgb", "value": [0.6, 0.3, 0.1]},
        "specular_reflectance": {"type": "rgb", "value": [1.0, 0.5, 0.2]},
    }
    theirs = mitsuba.load_dict(given | ({"distribution": distribution, "alpha": roughness**2} if roughness else {}))
    w = np.random.default_rng(int(100 * roughness)).normal(size=(2, 100, 3))
    w[..., 2] = np.abs(w[..., 2]) + 0.02
    wo, wi = (w / np.linalg.norm(w, axis=2, keepdims=True)).astype(np.float32).astype(np.float64)
    context, hit, expected = mitsuba.BSDFContext(), mitsuba.SurfaceInteraction3f(), []
    for o, i in zip(wo.tolist(), wi.tolist()):
        hit.wi = o
        expected.append(np.array(theirs.eval(context, hit, i)).ravel())
    value = bsdfs(device, [ours]).value(0, wo, wi)[0]
    np.testing.assert_allclose(value, expected, rtol=QUADRATURE if roughness else FITTED)
