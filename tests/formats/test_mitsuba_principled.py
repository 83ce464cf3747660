"""Mitsuba's principled BSDF: what is read, and its values, densities and albedos beside Mitsuba's own."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clrt.bench.kernel_probe import Doubles
from clrt.bench.numerics.bsdf_cases import bsdfs
from clrt.bench.numerics.furnace import evenly
from clrt.device.open import Device
from clrt.formats.mitsuba.principled import NUMBERS, RATES
from clrt.output.images import write_image
from clrt.scene.materials.material_types import Principled
from clrt.scene.materials.textures import Texture

from ..oracle.scenes import todays_seed
from .test_mitsuba_xml import material, problem, scene

#: Of float32; of luminances, for which Mitsuba's weights have more digits.
FLOAT = 1e-3
MATERIALS, PAIRS = 300, 24
TINTED = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
property float color_r
property float color_g
property float color_b
element face 1
property list uchar int vertex_indices
end_header
0 0 0 0.25 0.5 1
1 0 0 0.25 0.5 1
0 1 0 0.25 0.5 1
3 0 1 2
"""


def unit(w: Doubles) -> Doubles:
    """Return unit vectors, rounded to float32."""
    w = w / np.linalg.norm(w, axis=-1, keepdims=True)
    return np.asarray(w.astype(np.float32), np.float64)


def drawn(rng: np.random.Generator) -> dict[str, Any]:
    """Return random parameters of Mitsuba's, a third of them missing, at an end of their range or inside."""
    given: dict[str, Any] = {
        name: float(rng.choice([0.0, 1.0, rng.random(), rng.random()])) for name in NUMBERS if rng.random() < 0.67
    }
    given |= {"base_color": {"type": "rgb", "value": rng.random(3).tolist()}}
    # Mitsuba's scalar variants, unlike its others, have no sheen where all light is transmitted.
    if given.get("spec_trans") == 1.0:
        given["sheen"] = 0.0
    if rng.random() < 0.5:
        return given | {"specular": float(rng.choice([rng.random(), 0.0], p=[0.9, 0.1]))}
    return given | {"eta": float(rng.choice([rng.uniform(0.4, 0.95), rng.uniform(1.05, 3), 1.0], p=[0.3, 0.6, 0.1]))}


def as_xml(given: dict[str, Any]) -> str:
    """Return the BSDF as XML."""
    numbers = [f'<float name="{name}" value="{value}"/>' for name, value in given.items() if name != "base_color"]
    color = ", ".join(map(str, given["base_color"]["value"]))
    return f'<bsdf type="principled"><rgb name="base_color" value="{color}"/>{"".join(numbers)}</bsdf>'


def values_of(mitsuba: Any, bsdf: Any, wo: Doubles, wi: Doubles) -> Doubles:
    """Return f·|cos wi| (n, 3) of a BSDF of Mitsuba's."""
    context, hit, found = mitsuba.BSDFContext(), mitsuba.SurfaceInteraction3f(), []
    for o, i in zip(wo.tolist(), wi.tolist()):
        hit.wi = o
        found.append(np.array(bsdf.eval(context, hit, i)).ravel())
    return np.array(found)


def cancelled(given: dict[str, Any], wo: Doubles, wi: Doubles) -> Doubles:
    """Return the relative error (n,) of Mitsuba's clearcoat by cancellation in 1 + (alpha² − 1)·cos²."""
    if not given.get("clearcoat"):
        return np.zeros(len(wo))
    alpha, h = 0.1 - 0.099 * given.get("clearcoat_gloss", 0.0), unit(wo + wi)
    return np.asarray(2**-22 / (1 + (alpha**2 - 1) * h[:, 2] ** 2))


@pytest.mark.needs("mitsuba")
def test_values_are_mitsubas(folder: Path, device: Device) -> None:
    """f·|cos| of random materials at random directions, some close to the mirror direction, on both sides."""
    mitsuba = import_module("mitsuba")
    mitsuba.set_variant("scalar_rgb")
    seed = todays_seed()
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    given = [drawn(rng) for _ in range(MATERIALS)]
    shapes = "".join(f'<shape type="rectangle">{as_xml(each)}</shape>' for each in given)
    ours = bsdfs(device, [mesh.material for mesh in scene(folder, shapes).meshes])
    for which, each in enumerate(given):
        theirs = mitsuba.load_dict({"type": "principled", **each})
        wo = unit(rng.normal(size=(PAIRS, 3)) * [1, 1, 0.7])
        wo[:, 2] = np.abs(wo[:, 2])
        mirrored = wo * [-1, -1, 1] + rng.normal(size=(PAIRS, 3)) * 0.1
        wi = unit(np.where(rng.random((PAIRS, 1)) < 0.5, mirrored, rng.normal(size=(PAIRS, 3))))
        for front in (True, False) if each.get("spec_trans") else (True,):
            side = [1.0, 1.0, 1.0 if front else -1.0]
            expected = values_of(mitsuba, theirs, wo * side, wi * side)
            off = np.abs(ours.value(which, wo, wi, front)[0] - expected)
            allowed = (FLOAT + cancelled(each, wo, wi))[:, None] * expected + 1e-6
            assert (off <= allowed).all(), (
                each,
                front,
                wo[(off > allowed).any(axis=1)],
                wi[(off > allowed).any(axis=1)],
            )


@pytest.mark.needs("mitsuba")
@pytest.mark.parametrize("cosine", [0.95, 0.4, 0.1])
def test_albedos_are_mitsubas(device: Device, cosine: float) -> None:
    """What white rough surfaces reflect in a white furnace, by samples here, and by quadrature of Mitsuba's values."""
    mitsuba = import_module("mitsuba")
    mitsuba.set_variant("scalar_rgb")
    some: dict[str, Any] = {"sheen": 1.0, "flatness": 0.5, "clearcoat": 1.0, "metallic": 0.2, "anisotropic": 0.3}
    kinds = [{"roughness": 0.6}, {"roughness": 1.0}, {"roughness": 0.7, **some}, {"roughness": 0.8, "spec_trans": 0.7}]
    ours = bsdfs(device, [Principled(color=(1.0, 1.0, 1.0), **kind) for kind in kinds])
    nodes, weights = np.polynomial.legendre.leggauss(60)
    turns = 2 * np.pi * (np.arange(72) + 0.5) / 72
    z, phi = (each.ravel() for each in np.meshgrid((nodes + 1) / 2, turns, indexing="ij"))
    up = np.column_stack([np.sqrt(1 - z**2) * np.cos(phi), np.sqrt(1 - z**2) * np.sin(phi), z])
    shares = np.repeat(weights / 2, len(turns)) * 2 * np.pi / len(turns)
    wo = np.array([np.sqrt(1 - cosine**2), 0.0, cosine])
    for which, kind in enumerate(kinds):
        theirs = mitsuba.load_dict({"type": "principled", "base_color": 1.0, **kind})
        spread = ours.spread(which)
        wi, weight, _, _ = ours.sample(which, wo, evenly(1 << 16))
        # The quadrature is less accurate beyond the surface, where directions end at the critical angle.
        for side, tolerance in ((1.0, 2e-3), (-1.0, 1e-2)):
            expected = shares @ values_of(mitsuba, theirs, np.tile(wo, (len(up), 1)), up * [1, 1, side])
            there = np.where(wi[:, 2:] * side > 0, weight, 0).mean(axis=0) * (spread if side < 0 else 1)
            np.testing.assert_allclose(there, expected, rtol=tolerance, atol=1e-4, err_msg=f"{kind}, side {side}")


def test_what_is_read(folder: Path) -> None:
    """Names and defaults are Mitsuba's; textures of numbers; colors of a mesh; the index by specular or eta."""
    plain = material(folder, '<bsdf type="principled"/>')
    assert isinstance(plain, Principled) and plain.ior == pytest.approx(1.5)
    assert replace(plain, ior=1.5) == Principled(color=(0.5, 0.5, 0.5), metallic=0.0, roughness=0.5)
    write_image(folder / "map.png", np.full((2, 2, 3), 0.5, np.float32))
    image = """<texture type="bitmap" name="{}"><string name="filename" value="map.png"/>
        <boolean name="raw" value="true"/></texture>"""
    found = material(folder, f'<bsdf type="principled">{"".join(map(image.format, NUMBERS))}</bsdf>')
    assert all(isinstance(getattr(found, name), Texture) for name in NUMBERS)
    (folder / "a.ply").write_text(TINTED)
    text = """<shape type="ply"><string name="filename" value="a.ply"/><bsdf type="principled">
        <texture type="mesh_attribute" name="base_color"><string name="name" value="vertex_color"/></texture>
        </bsdf></shape>"""
    (mesh,) = scene(folder, text).meshes
    assert mesh.material == replace(plain, color=(1.0, 1.0, 1.0)) and mesh.colors is not None
    np.testing.assert_allclose(mesh.colors[:, :3], [[0.25, 0.5, 1]] * 3)
    rates = "".join(f'<float name="{name}" value="0.3"/>' for name in RATES)
    assert material(folder, f'<bsdf type="principled">{rates}</bsdf>') == plain
    for text, ior in (
        ('<float name="eta" value="1.33"/>', 1.33),
        ('<float name="specular" value="0"/>', 1.0),
        ('<float name="specular" value="1"/>', 2 / (1 - 0.08**0.5) - 1),
        ('<float name="eta" value="1"/><float name="spec_trans" value="0.5"/>', 1.001),
        ('<float name="specular" value="0"/><float name="spec_trans" value="0.5"/>', 2 / (1 - 8e-5**0.5) - 1),
    ):
        found = material(folder, f'<bsdf type="principled">{text}</bsdf>')
        assert isinstance(found, Principled) and found.ior == pytest.approx(ior)


def test_what_is_refused(folder: Path) -> None:
    ball = '<shape type="sphere"><bsdf type="principled">{}</bsdf></shape>'
    both = '<float name="eta" value="1.5"/><float name="specular" value="0.5"/>'
    assert "line 1: shape[0].bsdf: has eta and specular; write one" in problem(folder, ball.format(both))
    assert "specular is 2; write a number" in problem(folder, ball.format('<float name="specular" value="2"/>'))
    said = problem(folder, ball.format('<float name="roughness" value="1.5"/>'))
    assert "roughness" in said and "1.5" in said
