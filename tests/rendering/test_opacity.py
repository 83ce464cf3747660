"""Opacity: what is visible behind partly opaque surfaces and the light they transmit, in closed form."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.significance import chi2_test
from clrt.device.open import Device
from clrt.rendering.compile.choices import Lanes
from clrt.rendering.renderer import Renderer
from clrt.scene.lights import DirectionalLight
from clrt.scene.materials.material_types import Diffuse, Material, Mirror
from clrt.scene.materials.textures import Picture, Texture
from clrt.scene.model import Camera, Mesh, RenderSettings, Scene, Sphere

pytestmark = pytest.mark.statistics

QUAD = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
FACES = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
UV = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
BLACK = (0.0, 0.0, 0.0)
SPP = 64


def quad(material: Material, z: float = 0.0, **corners: Any) -> Mesh:
    """Return [-1, 1]² at height z, facing +z."""
    return Mesh((QUAD + (0, 0, z)).astype(np.float32), FACES, material, **{"uv": UV, **corners})


def lamp(red: float, green: float, blue: float) -> Diffuse:
    return Diffuse(color=BLACK, emission=(red, green, blue))


def seen(device: Device, *meshes: Mesh, lanes: Lanes | None = None, spp: int = SPP, **rest: Any) -> NDArray[np.float64]:
    """Return the image (16, 16, 3) of [-1, 1]² from far above."""
    angle = float(np.degrees(2 * np.arctan(1 / 1000)))
    scene = Scene(
        meshes=list(meshes),
        camera=Camera(position=(0, 0, 1000), look_at=(0, 0, 0), fov_degrees=angle),
        render=RenderSettings(size=(16, 16), max_depth=2),
        **rest,
    )
    for state in Renderer(scene, spp=spp, device=device.info.index, lanes=lanes).passes(spp=spp):
        pass
    return state.film.mean


def test_layers_show_what_is_behind_as_far_as_they_are_clear(device: Device) -> None:
    """Three partly opaque emitters over a light: each channel is attenuated by those above it.
    Each sample sees one layer.
    """
    opacities = [0.25, 0.5, 0.75]
    veils = [
        quad(replace(lamp(*(16.0 * row for row in np.eye(3)[i])), opacity=opacity), 3.0 - i)
        for i, opacity in enumerate(opacities)
    ]
    found = seen(device, *veils, quad(lamp(16, 16, 16)))
    left = np.cumprod([1, *(1 - opacity for opacity in opacities)])
    chances = [*(left[:-1] * opacities), left[-1]]
    count = SPP * 256
    bottom = 16 * chances[3]
    for channel in range(3):
        assert found[..., channel].mean() == pytest.approx(16 * chances[channel] + bottom, rel=0.02)
    seen_layers = [found[..., channel].sum() * SPP / 16 for channel in range(3)]
    whole = (sum(seen_layers) - count) / 2  # samples of the bottom count in all three channels
    counts = [*(layer - whole for layer in seen_layers), whole]
    assert np.abs(np.array(counts) - np.round(counts)).max() < 0.05
    # Low-discrepancy samples scatter less than the test expects: only too much scatter would be wrong.
    assert chi2_test(np.round(counts), count * np.array(chances)) > 1e-3


@pytest.mark.parametrize("cutoff, visible", [(None, None), (0.4, True), (0.6, False)])
def test_a_cutoff_makes_it_all_or_nothing(device: Device, cutoff: float | None, visible: bool | None) -> None:
    found = seen(device, quad(replace(lamp(1, 0, 0), opacity=0.5, alpha_cutoff=cutoff), 1), quad(lamp(0, 1, 0)))
    if visible is None:
        assert found[..., 0].mean() == pytest.approx(0.5, abs=0.01)
    else:
        assert np.array_equal(found, np.broadcast_to([1.0, 0, 0] if visible else [0, 1.0, 0], found.shape))


def test_a_picture_cuts_holes(device: Device) -> None:
    """A texture's alpha channel with holes, and vertex colours with an alpha gradient."""
    texels = np.zeros((4, 4, 4), np.uint8)
    texels[..., 3] = np.random.default_rng(1).integers(0, 2, (4, 4)) * 255
    holes = Picture(texels)
    opacity = Texture(picture=holes, channel="alpha", filter="nearest")
    found = seen(device, quad(replace(lamp(1, 0, 0), opacity=opacity), 0.01), quad(lamp(0, 1, 0)))
    solid = np.kron(holes.texels[..., 3] > 0, np.ones((4, 4)))
    assert np.abs(found - np.stack([solid, 1 - solid, 0 * solid], axis=2)).max() < 1.5 / SPP
    fading = np.ones((4, 4), np.float32)
    fading[:, 3] = UV[:, 0]
    found = seen(device, quad(lamp(1, 0, 0), 1, colors=fading), quad(lamp(0, 1, 0)))
    assert np.abs(found[..., 0].mean(axis=0) - (np.arange(16) + 0.5) / 16).max() < 0.02
    cut = replace(lamp(1, 0, 0), alpha_cutoff=0.5)
    found = seen(device, quad(cut, 1, colors=fading), quad(lamp(0, 1, 0)))
    assert found[:, :8, 0].max() == 0 and found[:, 8:, 0].min() == 1


@pytest.mark.parametrize(
    "other",
    [Diffuse(), Diffuse(opacity=0.5), Mirror(opacity=0.5), Mirror(one_sided=True)],
    ids=["diffuse", "clear diffuse", "clear mirror", "one-sided mirror"],
)
@pytest.mark.parametrize("one_sided", [False, True])
@pytest.mark.parametrize("cutoff", [None, 0.5])
def test_opaque_materials_stop_all_light(
    device: Device, other: Material, one_sided: bool, cutoff: float | None
) -> None:
    """For any other materials in the scene."""
    top = quad(replace(lamp(1, 0, 0), one_sided=one_sided, alpha_cutoff=cutoff), 1, colors=np.ones((4, 4), np.float32))
    found = seen(device, top, quad(lamp(0, 1, 0)), spheres=[Sphere(center=(0, 0, -9), radius=0.01, material=other)])
    assert (found == [1, 0, 0]).all()


@pytest.mark.parametrize("lanes", [1, 8])
def test_shadows_of_veils(device: Device, lanes: Lanes) -> None:
    """Shadows have the transmitted light, without noise; a one-sided surface stops no ray from behind."""
    ground = quad(Diffuse(color=(0.5, 0.5, 0.5)))
    sun = DirectionalLight(direction=(1, 0, -1), irradiance=(2, 2, 2))
    expected = 0.5 / np.pi * 2 * np.sqrt(0.5)
    veil = quad(Diffuse(color=BLACK, opacity=0.25), 50)
    veil.vertices = veil.vertices - np.array([50, 0, 0], np.float32)
    one_sided = replace(veil, material=Diffuse(one_sided=True))
    for other, passes in [(veil, 0.75), (one_sided, 1.0), (replace(one_sided, faces=FACES[:, ::-1].copy()), 0.0)]:
        found = seen(device, ground, other, lanes=lanes, lights=[sun])
        assert found == pytest.approx(expected * passes, rel=1e-5)
    ball = Sphere(center=(-50, 0, 50), radius=5, material=Diffuse(opacity=0.5))
    found = seen(device, ground, lanes=lanes, lights=[sun], spheres=[ball])
    assert found == pytest.approx(expected * 0.25, rel=1e-5)  # in and out


def test_a_clear_lamp_gives_less_light(device: Device) -> None:
    """A light of opacity 0.5 equals one of half the radiance, by light samples and by BSDF samples."""
    down = QUAD[[0, 3, 2, 1]] * (3, 3, 0) + (0, 0, 1)
    ground = quad(Diffuse(color=(0.8, 0.8, 0.8)))
    pictures = []
    for material in (
        Diffuse(color=BLACK, emission=(4.0, 4.0, 4.0), opacity=0.5, one_sided=True),
        Diffuse(color=BLACK, emission=(2.0, 2.0, 2.0), one_sided=True),
    ):
        pictures.append(seen(device, ground, Mesh(down.astype(np.float32), FACES, material), spp=1024))
    assert pictures[1].mean() > 0.5
    assert np.mean(pictures[0]) == pytest.approx(np.mean(pictures[1]), rel=5e-3)


def test_opaque_scenes_have_no_code_for_it(device: Device) -> None:
    plain = Renderer(Scene(meshes=[quad(Diffuse())]), device=device.info.index).compiled
    clear = Renderer(Scene(meshes=[quad(Diffuse(opacity=0.5))]), device=device.info.index).compiled
    assert "visibility/opaque.cl" in plain.files and "surface/opacity.cl" not in plain.files
    assert {"visibility/layers.cl", "surface/opacity.cl"} <= set(clear.files)
