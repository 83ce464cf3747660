"""Plastics of Mitsuba: the reflectance of coats against closed forms, and of the base against Mitsuba's own BSDFs."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

from clrt.formats.scene_parts.coats import coat
from clrt.output.images import write_image
from clrt.scene.materials.material_types import MetallicRoughness
from clrt.scene.materials.microfacets import albedos
from clrt.scene.materials.textures import Texture

from .test_mitsuba_xml import material


def fresnel(cosine: float, ior: float) -> float:
    """Return the unpolarized reflectance (Born and Wolf, 1.5.2)."""
    sine = np.sqrt(1 - cosine**2) / ior
    across, along = np.sqrt(1 - sine**2), ior * cosine
    s, p = (cosine - ior * across) / (cosine + ior * across), (along - across) / (along + across)
    return float(s**2 + p**2) / 2


@pytest.mark.parametrize("ior", [1.1, 1.3, 1.5, 1.9])
def test_smooth_coats(ior: float) -> None:
    """r follows from reciprocity; the base reflects (1 − mean F)²/(ior²·(1 − r)) of white light, over what E leaves
    to it."""
    inside, scale = coat(ior, 0.0, "ggx")
    outside = quad(lambda cosine: 2 * cosine * fresnel(cosine, ior), 0, 1)[0]
    assert inside == pytest.approx(1 - (1 - outside) / ior**2, abs=1e-3)
    first, grazing = (part[0] for part in albedos(np.array([1.0]), 1e-4, "separable"))
    assert (first, grazing) == pytest.approx((1, 0), abs=1e-4)
    schlick = ((ior - 1) / (ior + 1)) ** 2
    schlick += (1 - schlick) / 21  # the integral of Schlick's (1 − cos)⁵, 2·cos·(1 − cos)⁵ over the cosine
    assert scale == pytest.approx((1 - outside) ** 2 / (ior**2 * (1 - schlick)), rel=3e-3)


def test_colors_and_textures(folder: Path) -> None:
    """color·scale/(1 − color·r) if it is nonlinear, else color·scale/(1 − r); texels to half a step of 8 bits."""
    inside, scale = coat(1.5, 0.04, "ggx")
    text = """<bsdf type="roughplastic"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/>
        <string name="distribution" value="ggx"/><float name="alpha" value="0.04"/>{}</bsdf>"""
    color = np.array([0.1, 0.5, 0.9])
    given = '<rgb name="diffuse_reflectance" value="0.1, 0.5, 0.9"/>'
    linear = material(folder, text.format(given))
    assert isinstance(linear, MetallicRoughness) and (linear.roughness, linear.ior) == (0.2, 1.5)
    np.testing.assert_allclose(linear.color, color * scale / (1 - inside))  # type: ignore[arg-type]
    bent = material(folder, text.format(given + '<boolean name="nonlinear" value="true"/>'))
    assert isinstance(bent, MetallicRoughness)
    np.testing.assert_allclose(bent.color, color * scale / (1 - color * inside))  # type: ignore[arg-type]
    write_image(folder / "a.png", np.tile(np.float32(0.5), (1, 1, 3)))
    image = '<texture type="bitmap" name="diffuse_reflectance"><string name="filename" value="a.png"/></texture>'
    found = material(folder, text.format(image))
    assert isinstance(found, MetallicRoughness) and isinstance(found.color, Texture)
    encoded = found.color.picture.texels[0, 0, 0] / 255
    assert ((encoded + 0.055) / 1.055) ** 2.4 == pytest.approx(0.5 * scale / (1 - inside), abs=5e-3)


@pytest.mark.needs("mitsuba")
@pytest.mark.parametrize("nonlinear", [False, True])
@pytest.mark.parametrize("distribution", ["ggx", "beckmann"])
@pytest.mark.parametrize("alpha", [0.05, 0.2, 0.5])
def test_the_base_reflects_as_much_as_mitsubas(alpha: float, distribution: str, nonlinear: bool) -> None:
    """The mean of its reflectance over diffuse light; the coupling's is color·(1 − mean E)."""
    mitsuba = import_module("mitsuba")
    mitsuba.set_variant("scalar_rgb")
    base, ior = 0.6, 1.5
    bsdf = mitsuba.load_dict(
        {
            "type": "roughplastic",
            "distribution": distribution,
            "alpha": alpha,
            "nonlinear": nonlinear,
            "int_ior": ior,
            "ext_ior": 1.0,
            "diffuse_reflectance": {"type": "rgb", "value": base},
        }
    )
    node, weight = np.polynomial.legendre.leggauss(16)
    cosines, weights = (node + 1) / 2, weight * (node + 1) / 2
    context, hit = mitsuba.BSDFContext(), mitsuba.SurfaceInteraction3f()
    context.component = 1
    theirs = 0.0
    for o, outer in zip(cosines, weights):
        hit.wi = [np.sqrt(1 - o**2), 0, o]
        values = [bsdf.eval(context, hit, [0, np.sqrt(1 - i**2), i])[0] / i for i in cosines]
        theirs += outer * np.pi * float(np.dot(weights, values))
    inside, scale = coat(ior, alpha, distribution)
    first, grazing = albedos(cosines, alpha, "separable")
    ours = (
        base * scale / (1 - (base if nonlinear else 1) * inside) * (1 - weights @ (0.04 * (first - grazing) + grazing))
    )
    assert ours == pytest.approx(theirs, rel=0.01)
