"""pbrt's materials and textures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import clrt
from clrt.output.images import write_image
from clrt.scene.materials.material_types import Conductor, Dielectric, Diffuse, MetallicRoughness
from clrt.scene.materials.presets import F0_PRESETS
from clrt.scene.materials.textures import Texture

from ..covering import others
from .pbrt_files import TRIANGLE, material, scene


def test_materials(folder: Path) -> None:
    assert material(folder, "") == Diffuse(color=(0.5, 0.5, 0.5))
    glass = material(folder, 'Material "dielectric" "float eta" 1.33 "float roughness" 0.0625')
    assert isinstance(glass, Dielectric) and glass.ior == 1.33 and not glass.multiple_scattering
    assert glass.roughness == pytest.approx(0.5)  # alpha = √roughness = roughness² of clrt
    raw = material(folder, 'Material "dielectric" "float roughness" 0.25 "bool remaproughness" false')
    assert raw.roughness == pytest.approx(0.5)
    flint = material(folder, 'Material "dielectric" "spectrum eta" "glass-F11"')
    assert flint.ior == pytest.approx(1.78472, abs=1e-4) and flint.dispersion == pytest.approx(20 / 25.76, rel=5e-3)
    assert material(folder, 'Material "thindielectric"').thin
    metal = material(folder, 'Material "conductor" "spectrum eta" "metal-Cu-eta" "spectrum k" "metal-Cu-k"')
    eta, k = np.array(metal.eta), np.array(metal.k)
    copper = ((eta - 1) ** 2 + k**2) / ((eta + 1) ** 2 + k**2)
    np.testing.assert_allclose(copper, F0_PRESETS["copper"][0], atol=0.02)
    given_ = material(folder, 'Material "conductor" "rgb reflectance" [.9 .5 .1]')
    k = np.array(given_.k)
    np.testing.assert_allclose(k**2 / (4 + k**2), (0.9, 0.5, 0.1), rtol=1e-6)
    old = material(folder, 'Material "metal" "float roughness" 0.05')
    x = np.log(0.05)
    alpha = 1.62142 + 0.819955 * x + 0.1734 * x**2 + 0.0171201 * x**3 + 0.000640711 * x**4
    assert isinstance(old, Conductor) and old.roughness == pytest.approx(np.sqrt(alpha))


def test_a_white_coated_base_reflects_all_light(folder: Path) -> None:
    """A smooth coat loses nothing between its layers."""
    found = material(folder, 'Material "coateddiffuse" "rgb reflectance" [1 1 1]')
    assert isinstance(found, MetallicRoughness) and not isinstance(found.color, Texture)
    assert found.color[0] == pytest.approx(1, abs=0.01)


COAT = """Material "dielectric" "float roughness" {roughness}
Shape "bilinearmesh" "point3 P" [-9 .001 -9  -9 .001 9  9 .001 -9  9 .001 9]
Material "diffuse" "rgb reflectance" [{base} {base} {base}]
Shape "bilinearmesh" "point3 P" [-9 0 -9  -9 0 9  9 0 -9  9 0 9]"""


COATED = """Material "coateddiffuse" "float roughness" {roughness} "rgb reflectance" [{base} {base} {base}]
Shape "bilinearmesh" "point3 P" [-9 0 -9  -9 0 9  9 0 -9  9 0 9]"""


@pytest.mark.parametrize("roughness", [0.01, 0.09, *others(0.0)])
def test_a_coated_base_looks_like_glass_above_a_diffuse_surface(folder: Path, roughness: float) -> None:
    """The light that the base adds, from 45 degrees under a white sky, with both surfaces as geometry."""
    before = """Film "rgb" "integer xresolution" 16 "integer yresolution" 16 Integrator "path" "integer maxdepth" 60
    LookAt 0 2 2  0 0 0  0 1 0  Camera "orthographic" "float screenwindow" [-1 1 -1 1]"""

    def mean(world: str, base: float) -> float:
        text = f'LightSource "infinite"\n{world.format(roughness=roughness, base=base)}'
        return float(clrt.render(scene(folder, text, before), spp=1024).pixels.mean())

    layers, one = ([mean(world, base) for base in (0.0, 0.7)] for world in (COAT, COATED))
    assert one[1] - one[0] == pytest.approx(layers[1] - layers[0], rel=0.03)
    assert one[1] == pytest.approx(layers[1], abs=0.015)  # Schlick's Fresnel term is off by .01


def test_mixtures_and_alpha(folder: Path) -> None:
    named = """MakeNamedMaterial "a" "string type" "diffuse" "rgb reflectance" [.2 .2 .2]
    MakeNamedMaterial "b" "string type" "diffuse" "rgb reflectance" [.6 .6 .6]
    MakeNamedMaterial "none" "string type" "interface"\n"""
    mix = 'Material "mix" "string materials" ["{}" "{}"] "float amount" {}'
    assert material(folder, named + mix.format("a", "b", 0.25)).color == pytest.approx((0.3, 0.3, 0.3))
    assert material(folder, named + mix.format("a", "b", 1)) == Diffuse(color=(0.6, 0.6, 0.6))
    assert material(folder, named + mix.format("a", "none", 0.25)) == Diffuse(color=(0.2, 0.2, 0.2), opacity=0.75)
    assert not scene(folder, f'Material "interface"\n{TRIANGLE}').meshes
    assert scene(folder, f'{TRIANGLE} "float alpha" .3').meshes[0].material.opacity == pytest.approx(0.3)


def test_translucent_surfaces(folder: Path) -> None:
    """Reflectance and transmittance, of which clrt's fraction and colors are the products."""
    found = material(
        folder,
        'Material "diffusetransmission" "rgb reflectance" [.3 .2 .1] "rgb transmittance" [.1 .4 .5] "float scale" .8',
    )
    share = found.diffuse_transmission
    np.testing.assert_allclose((1 - share) * np.array(found.color), np.array((0.3, 0.2, 0.1)) * 0.8)
    np.testing.assert_allclose(share * np.array(found.diffuse_transmission_color), np.array((0.1, 0.4, 0.5)) * 0.8)
    assert found.specular == 0


def test_images_are_upright_and_checks_begin_with_the_first_color(folder: Path) -> None:
    """(0, 0) is the lower left corner; the check at s, t has the first color if ⌊s⌋ + ⌊t⌋ is even."""
    write_image(folder / "wood.png", np.random.default_rng(0).random((4, 4, 3), np.float32))
    mapping = '"float uscale" 2 "float vscale" 3 "float udelta" .1 "float vdelta" .2'
    image = f'Texture "t" "spectrum" "imagemap" "string filename" "wood.png" {mapping}\n'
    picture = material(folder, f'{image}Material "diffuse" "texture reflectance" "t"').color
    u, v = 0.3, 0.15
    np.testing.assert_allclose(picture.to_picture @ (u, v, 1), (2 * u + 0.1, 1 - (3 * v + 0.2)))
    checks = f'Texture "t" "spectrum" "checkerboard" "rgb tex1" [.8 .8 .8] "rgb tex2" [.1 .1 .1] {mapping}\n'
    board = material(folder, f'{checks}Material "diffuse" "texture reflectance" "t"').color
    for u, v in np.random.default_rng(4).random((50, 2)) * 3:
        x, y = board.to_picture @ (u, v, 1) % 1
        texel = board.picture.texels[int(y * 2), int(x * 2), 0]
        is_first = (np.floor(2 * u + 0.1) + np.floor(3 * v + 0.2)) % 2 == 0
        assert texel == (board.picture.texels[..., 0].max() if is_first else board.picture.texels[..., 0].min())


def test_textures_of_textures(folder: Path) -> None:
    write_image(folder / "wood.png", np.full((2, 2, 3), 0.25, np.float32))
    textures = """Texture "wood" "spectrum" "imagemap" "string filename" "wood.png"
    Texture "half" "float" "constant" "float value" .5
    Texture "dark" "spectrum" "scale" "texture tex" "wood" "float scale" .5
    Texture "pale" "spectrum" "mix" "texture tex1" "wood" "rgb tex2" [1 1 1] "texture amount" "half"
    """
    dark = material(folder, f'{textures}Material "diffuse" "texture reflectance" "dark"').color
    assert np.broadcast_to(dark.factor, 3) == pytest.approx((0.5, 0.5, 0.5))
    pale = material(folder, f'{textures}Material "diffuse" "texture reflectance" "pale"').color
    level = pale.picture.texels[0, 0, 0] / 255
    assert ((level + 0.055) / 1.055) ** 2.4 == pytest.approx(0.5 * 0.25 + 0.5, abs=0.01)


def test_absorbing_glass(folder: Path) -> None:
    medium = """MakeNamedMedium "tea" "string type" "homogeneous" "rgb sigma_a" [1 2 4] "rgb sigma_s" [0 0 0]
    "float scale" .5 MediumInterface "tea" "" """
    glass = material(folder, medium + 'Material "dielectric"')
    np.testing.assert_allclose(-np.log(glass.attenuation_color) / glass.attenuation_distance, [0.5, 1, 2])
