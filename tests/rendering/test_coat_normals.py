"""Clearcoats with a normal of their own: float64 formulas, sampling, furnaces and images."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from clrt.bench.kernel_probe import Doubles
from clrt.bench.numerics.bsdf_cases import bsdfs, uniform
from clrt.bench.numerics.scattering import FITTED, FLIP, above
from clrt.bench.significance import chi2_test, mean_test, rejected
from clrt.device.open import Device
from clrt.rendering.compile.choices import Choices
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.scene.lights import DirectionalLight
from clrt.scene.materials.material_types import Dielectric, MetallicRoughness
from clrt.scene.materials.textures import Texture
from clrt.scene.model import Environment, Scene, Sphere

from .ggx import bump_shadowing, masking
from .layers import Below, mean, under_coat
from .test_textures import plain, quad, seen

pytestmark = pytest.mark.statistics

COLOR = (0.8, 0.5, 0.2)
TEXELS = {"right": (200, 128, 230), "up": (110, 190, 220), "steep": (220, 110, 200)}
UP = np.array([0.0, 0.0, 1.0])
#: Cells of the sphere by z and azimuth, and points per cell in each dimension.
CELLS, POINTS = 16, 40


def texture(name: str | None) -> Texture | None:
    return None if name is None else Texture(picture=plain(*TEXELS[name]))


def normal(name: str | None) -> Doubles:
    """Return the bent normal of a map on a surface whose image axes are x and y."""
    if name is None:
        return UP
    bent = 2 * np.array(TEXELS[name]) / 255 - 1
    return np.asarray(bent / np.linalg.norm(bent))


def around(n: Doubles) -> Doubles:
    """Return the rows (3, 3) of a frame whose z is n."""
    s = np.cross([0.0, 1.0, 0.0], n)
    s /= np.linalg.norm(s)
    return np.array([s, np.cross(n, s), n])


def schlick(cosine: Doubles) -> Doubles:
    return np.asarray(0.04 + 0.96 * (1 - np.abs(cosine)) ** 5)


def film(wo: Doubles, wi: Doubles, n: Doubles, alpha: float) -> Doubles:
    """Return F·D·G/(4·cos wo) (k,) of a coat with the normal n, 0 for directions below it."""
    h = (wo + wi) / np.linalg.norm(wo + wi, axis=-1, keepdims=True)
    cos_h, cos_o, cos_i = h @ n, np.broadcast_to(wo @ n, len(wi)), wi @ n
    lit = (cos_o > 0) & (cos_i > 0)
    cos_o, cos_i = np.where(lit, cos_o, 1), np.where(lit, cos_i, 1)
    d = alpha**2 / (np.pi * (1 - cos_h**2 + (alpha * cos_h) ** 2) ** 2)
    g = masking("height_correlated", alpha, cos_o, cos_i)
    return np.where(lit, schlick(np.sum(h * wi, axis=-1)) * d * g / (4 * cos_o), 0)


@pytest.mark.parametrize("metallic", [0.5, 1.0])
@pytest.mark.parametrize("base", [None, "right", "steep"])
@pytest.mark.parametrize("coat", [None, "up", "steep"])
def test_coat_and_base_have_normals_of_their_own(
    device: Device, base: str | None, coat: str | None, metallic: float
) -> None:
    """eval is coat·film plus the attenuated base, each with its own normal's cosines, for wi and its mirror image
    below the surface; 0 below. A base that is not all gloss is compared only where nothing goes to the mirror image.

    A material with both maps is included, so that all cases run the same program.
    """
    bare = MetallicRoughness(color=COLOR, roughness=0.7, metallic=metallic)
    coats = [
        replace(
            bare, clearcoat=0.8, clearcoat_roughness=0.5, normal_map=texture(one), clearcoat_normal_map=texture(other)
        )
        for one, other in ((base, coat), ("right", "up"))
    ]
    f0: Any = tuple(0.04 + metallic * (c - 0.04) for c in COLOR)
    gloss = replace(bare, color=f0, metallic=1.0, multiple_scattering=False)
    both = bsdfs(device, [gloss, *coats])
    base_normal, coat_normal = normal(base), normal(coat)
    wo, wi = above(20_000, 1), above(20_000, 2)
    mirrored = np.maximum((wi * FLIP) @ base_normal, (wi * FLIP) @ coat_normal) > 0
    known = (wo @ base_normal > 1e-3) & (wo @ coat_normal > 1e-3) & ((metallic == 1) | ~mirrored)
    wo, wi = wo[known], wi[known]
    turn, left = around(base_normal).T, under_coat(0.8, 0.5)
    body = Below(COLOR, metallic, 0.7, left)

    def lobes(wi: Doubles) -> Doubles:
        lefts = [left(np.maximum(w @ coat_normal, 1e-6)) for w in (wo, wi)]
        cosines = [np.maximum(w @ base_normal, 0) for w in (wo, wi)]
        below = body.value(both.value(0, wo @ turn, wi @ turn)[0], *cosines, *lefts)
        return np.asarray(below + 0.8 * film(wo, wi, coat_normal, 0.25)[:, None])

    expected = lobes(wi) + lobes(wi * FLIP)
    nearest = np.minimum(np.linalg.norm(wo + wi, axis=1), np.linalg.norm(wo + wi * FLIP, axis=1))
    roundings = (2e-5 / np.minimum(nearest, 1) / (wo @ coat_normal))[:, None] + 2 * FITTED
    sharp = np.min(np.abs([each @ n for each in (wi, wi * FLIP) for n in (base_normal, coat_normal)]), axis=0) > 1e-5
    found = both.value(1, wo, wi)[0]
    assert np.all(np.abs(found - expected)[sharp] <= (roundings * np.abs(expected) + 2e-5)[sharp])
    assert not both.value(1, wo, wi * FLIP)[0].any()
    if metallic == 1 and base and base != coat:
        assert np.count_nonzero((wi @ base_normal < 0) & (found[:, 0] > 0)) > 50  # the film alone


def varied() -> list[MetallicRoughness]:
    """Return coats and bases with different normals, alone and with everything else that a coat can cover."""
    layers: dict[str, Any] = {"sheen_color": (0.4, 0.5, 0.6), "sheen_roughness": 0.5, "transmission": 0.6}
    white: dict[str, Any] = {"color": (1.0, 1.0, 1.0), "roughness": 0.6, "clearcoat": 1.0, "clearcoat_roughness": 0.6}
    maps: list[dict[str, Any]] = [
        {"normal_map": texture("steep")},
        {"clearcoat_normal_map": texture("steep")},
        {"normal_map": texture("right"), "clearcoat_normal_map": texture("up")},
    ]
    return [MetallicRoughness(**white, **bent, **more) for bent in maps for more in ({"metallic": 1.0}, {}, layers)]


def test_samples_follow_the_density_and_make_no_light(device: Device) -> None:
    """Chi-square over cells of the sphere, from density sums over fine points, with one cell for failed samples;
    weights are value over density; the mean weight in a white furnace is at most 1."""
    materials, count = varied(), 1 << 15
    every = bsdfs(device, [*materials])
    fine = (np.arange(CELLS * POINTS) + 0.5) / (CELLS * POINTS)
    z, phi = np.meshgrid(2 * fine - 1, 2 * np.pi * fine, indexing="ij")
    points = np.stack([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z], axis=-1).reshape(-1, 3)
    chi2, energy = {}, {}
    for which, material in enumerate(materials):
        for wo in (np.array([0.0, 0.0, 1.0]), np.array([-0.3, 0.5, np.sqrt(0.66)]), np.array([0.8, 0.0, 0.6])):
            wi, weight, pdf, specular = every.sample(which, wo, uniform(count, which))
            value, density = every.value(which, wo, points)
            expected = density.reshape(CELLS, POINTS, CELLS, POINTS).mean(axis=(1, 3)).ravel() * 4 * np.pi / CELLS**2
            kept = pdf > 0
            assert not specular.any() and not weight[~kept].any() and kept.mean() > 0.3
            rows = np.minimum((wi[kept, 2] + 1) / 2 * CELLS, CELLS - 1).astype(int)
            columns = (np.arctan2(wi[kept, 1], wi[kept, 0]) % (2 * np.pi) / (2 * np.pi) * CELLS).astype(int) % CELLS
            found = np.bincount(rows * CELLS + columns, minlength=CELLS**2)
            name = f"{wo} {material}"
            shares = np.array([*expected, max(1 - expected.sum(), 0)])
            chi2[name] = chi2_test([*found, count - kept.sum()], count * shares + 1e-9)
            there, again = every.value(which, wo, wi[kept])
            sure = np.abs(again / pdf[kept] - 1) < 1e-4  # A few lie on a horizon
            assert sure.mean() > 0.999
            np.testing.assert_allclose((weight[kept] * pdf[kept, None])[sure], there[sure], rtol=2e-4, atol=1e-6)
            assert weight.mean() == pytest.approx(value.mean() * 4 * np.pi, rel=0.03)
            mean = weight.mean(axis=0)
            p = mean_test(mean, np.maximum(weight.var(axis=0), 1e-12), count, 1)
            energy[name] = float(np.where(mean > 1, p / 2, 1).min())
    assert not rejected(chi2) and not rejected(energy)


def test_each_lobe_is_reciprocal(device: Device) -> None:
    """Each lobe is divided by its own normal's cosine: the film over a black base, and the base below a smooth film,
    where neither reflects below the surface."""
    maps: dict[str, Any] = {"normal_map": texture("right"), "clearcoat_normal_map": texture("up"), "clearcoat": 1.0}
    black, body = (
        MetallicRoughness(color=(0.0,) * 3, specular=0.0, clearcoat_roughness=0.7, **maps),
        MetallicRoughness(
            color=COLOR, roughness=0.8, sheen_color=(0.3,) * 3, sheen_roughness=0.6, clearcoat_roughness=0.0, **maps
        ),
    )
    both, wo, wi = bsdfs(device, [black, body]), above(5000, 3), above(5000, 4)
    for which, n in ((0, normal("up")), (1, normal("right"))):
        kept = (np.minimum(wo @ normal("up"), wi @ normal("up")) > 0.02) & (
            np.minimum(wo @ normal("right"), wi @ normal("right")) > 0.02
        )
        h = (wo + wi) / np.linalg.norm(wo + wi, axis=1, keepdims=True)
        kept &= np.maximum((wo * FLIP) @ n, (wi * FLIP) @ n) < 0
        kept &= (h @ normal("up") < 0.98) if which else kept
        assert np.count_nonzero(kept) > 500
        o, i = wo[kept], wi[kept]
        there, back = both.value(which, o, i)[0] / (i @ n)[:, None], both.value(which, i, o)[0] / (o @ n)[:, None]
        np.testing.assert_allclose(there, back, rtol=2e-3, atol=1e-5)


@pytest.mark.parametrize("base, beside", [(None, "glass"), ("right", "nothing")])
def test_highlights_lie_where_the_coat_is_bent_to(device: Device, base: str | None, beside: str) -> None:
    """For a plate seen from above, the highlight follows the coat's normal and the body is lit by its own normal."""
    n, towards_eye, alpha = normal("up"), np.array([[0.0, 0.0, 1.0]]), 0.25**2
    body = replace(MetallicRoughness(color=COLOR, specular=0.0), normal_map=texture(base))
    coated = replace(body, clearcoat=1.0, clearcoat_roughness=0.25, clearcoat_normal_map=texture("up"))
    coat_left = under_coat(1.0, 0.25)
    mirrored = 2 * n[2] * n - UP
    found = []
    for turn in (-0.3, -0.1, 0.0, 0.1, 0.3):
        light = mirrored + turn * np.cross(mirrored, [1.0, 0.0, 0.0])
        light /= np.linalg.norm(light)
        balls = [Sphere(center=(0, 0, -9), radius=1, material=Dielectric())] if beside == "glass" else []
        scene = Scene(
            meshes=[quad(coated)],
            spheres=balls,
            lights=[DirectionalLight(direction=tuple(-light), irradiance=(1, 1, 1))],
        )
        picture = seen(device, scene, size=8, spp=4, max_depth=2).mean(axis=(0, 1))
        gloss = film(towards_eye, light[None], n, alpha) + film(towards_eye, light[None] * FLIP, n, alpha)
        left = np.prod(coat_left(np.array([n[2], light @ n]))) / mean(coat_left)
        left *= bump_shadowing(UP, normal(base), light)
        lambert = left * np.array(COLOR) / np.pi * max(light @ normal(base), 0)
        np.testing.assert_allclose(picture, gloss + lambert, rtol=2 * FITTED)
        found.append(picture[2])
    assert np.argmax(found) == 2 and found[2] > 3 * max(found[0], found[4])


def test_a_smooth_coat_has_no_bumps(device: Device) -> None:
    """In a constant environment the coat reflects 0.04 of it, even if the base's normal map is steep."""
    black = MetallicRoughness(color=(0.0,) * 3, specular=0.0, clearcoat=1.0)
    sky = Environment(color=(1, 1, 1))
    smooth, bent = (
        seen(device, Scene(meshes=[quad(replace(black, normal_map=bumps))], environment=sky), spp=16)
        for bumps in (None, texture("steep"))
    )
    assert smooth.mean() == pytest.approx(0.04, rel=1e-3) and np.abs(bent - smooth).max() < 1e-3


def test_only_coats_over_maps_compile_frames(device: Device) -> None:
    def features(**fields: Any) -> set[str]:
        scene = Scene(meshes=[quad(MetallicRoughness(**fields))])
        return {"COAT_NORMALS", "NORMAL_MAPS"} & set(compile_scene(scene, Choices(device.lanes)).features)

    assert not features(clearcoat=1.0) and not features(clearcoat_normal_map=texture("up"))
    assert features(normal_map=texture("up")) == {"NORMAL_MAPS"}
    assert len(features(normal_map=texture("up"), clearcoat=0.5)) == 2
    assert len(features(clearcoat_normal_map=texture("up"), clearcoat=0.5)) == 2
