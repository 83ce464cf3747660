"""Light sampling is unbiased for any materials in a scene: a light's probability is 0 only if its contribution is."""

from __future__ import annotations

from functools import cache

import pytest

import clrt
from clrt.bench.numerics.bsdf_cases import variants
from clrt.device.open import Device
from clrt.scene.lights import DirectionalLight, Light, PointLight, SpotLight
from clrt.scene.materials.material import Material
from clrt.scene.materials.material_types import MATERIALS, Dielectric, Diffuse, MetallicRoughness
from clrt.scene.model import Camera, Mesh, Scene, Sphere

from .pictures import quad

pytestmark = pytest.mark.statistics

LIGHTS: list[Light] = [
    DirectionalLight(direction=(0, -1, 0), irradiance=(1, 2, 3)),
    DirectionalLight(direction=(0, -1, -1), irradiance=(1, 1, 1), angle_degrees=10.0),
    PointLight(position=(0, 3, 1), intensity=(4, 3, 2)),
    SpotLight(position=(1, 3, 0), direction=(-1, -3, 0), intensity=(9, 9, 9)),
]
LAMP = Sphere(center=(20, -9, 0), radius=0.1, material=Diffuse(emission=(0.01, 0.01, 0.01)))  # hidden below the floor


def lit_floor(device: Device, lights: list[Light], material: Material, others: list[Material]) -> float:
    """Return the mean radiance of a floor, with spheres of other materials outside the camera's view."""
    floor: Mesh = quad([(-2, 0, 2), (2, 0, 2), (2, 0, -2), (-2, 0, -2)], material)
    shelf = [Sphere(center=(50 + 3 * i, -9, 0), material=other) for i, other in enumerate(others)]
    scene = Scene(
        meshes=[floor],
        spheres=[LAMP, *shelf],
        lights=lights,
        camera=Camera(position=(0, 4, 0), look_at=(0, 0, 0), up=(0, 0, -1), fov_degrees=5),
    )
    image = clrt.render(scene, size=(16, 16), spp=1024, max_depth=2, device=device.info.index)
    return float(image.pixels.mean())


@cache
def sum_of_lights(device: Device, material: Material) -> float:
    """Return the mean radiance of a floor in a scene without other materials, as the sum of images with one light."""
    each = [lit_floor(device, [light], material, []) for light in LIGHTS]
    assert min(each) > 1e-4
    return sum(each)


def assert_light_adds_up(device: Device, material: Material, others: list[Material]) -> None:
    # 262 144 samples, each of which chooses one light of five: a standard error of 0.4 %.
    assert lit_floor(device, LIGHTS, material, others) == pytest.approx(sum_of_lights(device, material), rel=0.02)


@pytest.mark.parametrize("kind", MATERIALS, ids=lambda kind: str(kind.kernel))
def test_light_adds_up_beside_any_material(device: Device, kind: type[Material]) -> None:
    assert_light_adds_up(device, MetallicRoughness(roughness=1.0), list(variants(kind)))


@pytest.mark.parametrize(
    "sheet",
    [
        MetallicRoughness(transmission=0.5, roughness=1.0),
        Dielectric(roughness=1.0, thin=True),
        Dielectric(roughness=1.0),
    ],
    ids=["transmission", "thin", "glass"],
)
def test_light_adds_up_on_what_passes_it_on(device: Device, sheet: Material) -> None:
    assert_light_adds_up(device, sheet, [])
