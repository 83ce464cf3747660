"""The renderer against the oracle, and the oracle against itself."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from clrt.bench.kernel_probe import choices
from clrt.device.open import Device
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.scene.materials.material import Material
from clrt.scene.materials.material_types import MATERIALS, Dielectric, Diffuse, MetallicRoughness
from clrt.scene.model import Camera, Mesh, RenderSettings, Scene, Sphere
from clrt.scene.validation.validate import scene_problems

from .compare import ROUNDS, verdict
from .draws import DRAWERS, Draws, random_material
from .geometry import Geometry
from .materials import SCATTERINGS, scattering_of
from .materials.scattering import mirrored_below
from .paths import Paths
from .scenes import BATCH, SIZE, random_scene, todays_seed
from .surface import Surface
from .vectors import Doubles

FILM: dict[str, Any] = {"clearcoat": 1.0, "clearcoat_roughness": 0.3}
FIBRES: dict[str, Any] = {"sheen_color": (0.9, 0.9, 0.9), "sheen_roughness": 0.35}
#: Scenes of the test suite, each from another batch.
SCENES = range(0, 3 * BATCH, BATCH)


@pytest.mark.parametrize("number", SCENES)
def test_images_of_random_scenes_agree(device: Device, number: int) -> None:
    """`python -m tests.oracle` compares hundreds of them."""
    seed = todays_seed()
    print(f"seed {seed}")
    found = verdict(device, random_scene(seed, number), seed)
    assert not found.is_off(len(SCENES)), (
        f"`python -m tests.oracle --seed {seed} --first {number} --scenes 1` compares this again: {found}"
    )


def lamp_over_floor(emission: float) -> Scene:
    """Return a sphere light above a grey square."""
    corners = np.array([(-3, 0, 3), (3, 0, 3), (3, 0, -3), (-3, 0, -3)], np.float32)
    floor = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32), Diffuse(color=(0.6, 0.6, 0.6)))
    lamp = Sphere(center=(0.0, 2.0, 0.0), radius=0.8, material=Diffuse(emission=(emission,) * 3))
    return Scene(
        meshes=[floor],
        spheres=[lamp],
        camera=Camera(position=(0.0, 2.0, 5.0)),
        render=RenderSettings(size=SIZE, max_depth=4),
        name="lamp",
    )


@pytest.mark.parametrize("share, off", [(1.0, False), (0.95, True)])
def test_five_percent_too_much_light_is_found(
    device: Device, monkeypatch: pytest.MonkeyPatch, share: float, off: bool
) -> None:
    rounds, other = (ROUNDS[0], ROUNDS[0]._replace(suspect=0.0)), Paths(lamp_over_floor(4.0 * share))
    monkeypatch.setattr("tests.oracle.compare.ROUNDS", rounds)
    monkeypatch.setattr("tests.oracle.compare.Paths", lambda _: other)
    found = verdict(device, lamp_over_floor(4.0))
    assert found.is_off() == off and found.rounds == 1 + off
    assert abs(found.ratio * share - 1) < 5 * found.error < 0.03


def test_all_materials_are_drawn() -> None:
    """A new material needs an implementation in the oracle, from its publication."""
    assert set(MATERIALS) == set(DRAWERS) == set(SCATTERINGS)


@pytest.mark.parametrize("kind", DRAWERS)
def test_directions_are_drawn_by_their_density(kind: type[Material]) -> None:
    """The mean weight of sampled directions, above and below the surface, is the integral of f·|cos|."""
    rng = np.random.default_rng(7)
    for number in range(6):
        material = random_material(Draws(3, number, 0), kind)
        wo, at = view(0.2 + 0.15 * number, 200_000)
        scattering = scattering_of(material, at)
        uniform = rng.normal(size=wo.shape)
        uniform /= np.linalg.norm(uniform, axis=1, keepdims=True)
        integrand, sample = 4 * np.pi * scattering.evaluate(wo, uniform), scattering.sample(wo, rng)
        if not integrand.any():  # specular directions
            assert sample.weight.max() <= 1 / 0.25**2
            continue
        for up in (True, False):
            sides = [
                np.where((wi[:, 2:] > 0) == up, weight, 0)
                for wi, weight in ((uniform, integrand), (sample.wi, sample.weight))
            ]
            error = np.sqrt(sum(each.var(axis=0) for each in sides) / len(wo))
            assert (abs(sides[0].mean(axis=0) - sides[1].mean(axis=0)) <= 4.5 * error).all(), (material, up)


@pytest.mark.parametrize("roughness", [0.3, 1.0])
@pytest.mark.parametrize("metallic", [0.0, 0.5, 1.0])
def test_white_keeps_energy(roughness: float, metallic: float) -> None:
    """With the default options, within the precision of the tables of directional albedos."""
    white = MetallicRoughness(color=(1.0, 1.0, 1.0), roughness=roughness, metallic=metallic)
    wo, at = view(0.4, 200_000)
    weight = scattering_of(white, at).sample(wo, np.random.default_rng(1)).weight[:, 0]
    assert abs(weight.mean() - 1) < 0.001 + 4.5 * weight.std() / np.sqrt(len(wo))


@pytest.mark.parametrize("layers", [FILM, FIBRES, FILM | FIBRES, FILM | FIBRES | {"transmission": 0.7}])
@pytest.mark.parametrize("roughness", [0.3, 0.8])
@pytest.mark.parametrize("metallic", [0.0, 0.6, 1.0])
def test_white_under_layers_keeps_energy(roughness: float, metallic: float, layers: dict[str, Any]) -> None:
    """Total reflection and transmission is 1, by quadrature in √cos and the root of the azimuth from the mirrored
    wo."""
    white = MetallicRoughness(color=(1.0, 1.0, 1.0), roughness=roughness, metallic=metallic, **layers)
    x, weights = np.polynomial.legendre.leggauss(64)
    u = (x + 1) / 2
    root, turn = (each.ravel() for each in np.meshgrid(u, np.pi * u**2, indexing="ij"))
    across = np.sqrt(1 - root**4)
    wi = np.column_stack([-across * np.cos(turn), across * np.sin(turn), root**2])
    area = 2 * np.pi * np.outer(weights * u, weights * u).ravel()
    for cosine in (0.15, 0.6, 1.0):
        wo, at = view(cosine, len(wi))
        scattering = scattering_of(white, at)
        leaving = sum(area @ scattering.evaluate(wo, each) for each in (wi, mirrored_below(wi)))
        np.testing.assert_allclose(leaving, 1, atol=1e-3)


@pytest.mark.parametrize("roughness", [0.3, 1.0])
@pytest.mark.parametrize("ior", [0.7, 1.5, 2.0])
@pytest.mark.parametrize("front", [False, True])
@pytest.mark.parametrize("thin", [False, True])
def test_clear_glass_keeps_energy(roughness: float, ior: float, front: bool, thin: bool) -> None:
    """Radiance over the square of the index is conserved."""
    glass = Dielectric(color=(1.0, 1.0, 1.0), ior=ior, roughness=roughness, thin=thin)
    wo, at = view(0.4, 200_000)
    sample = scattering_of(glass, replace(at, front=np.full(len(wo), front))).sample(wo, np.random.default_rng(1))
    beyond = 1.0 if thin else ior if front else 1 / ior
    flux = sample.weight[:, 0] * np.where(sample.wi[:, 2] > 0, 1, beyond**2)
    assert abs(flux.mean() - 1) < 0.002 + 4.5 * flux.std() / np.sqrt(len(wo))


def view(cosine: float, n: int) -> tuple[Doubles, Surface]:
    """Return a direction, n times, and a surface that it leaves."""
    wo, up = np.array([np.sqrt(1 - cosine**2), 0.0, cosine]), np.array([0.0, 0.0, 1.0])
    rows = np.tile(up, (n, 1))
    return np.tile(wo, (n, 1)), Surface(
        np.zeros((n, 3)), rows, rows.copy(), np.ones(n, bool), np.full((n, 2, 2), 0.3), np.ones((n, 4))
    )


def test_scenes_are_valid_and_share_programs(device: Device) -> None:
    for first in SCENES:
        scenes = [random_scene(5, first + number) for number in range(BATCH)]
        assert not any(scene_problems(scene) for scene in scenes)
        assert len({compile_scene(scene, choices(device), device=device).source for scene in scenes}) == 1
        assert len({scene.camera.position for scene in scenes}) == BATCH


def test_mirrored_instances_keep_what_their_corners_have() -> None:
    """Each corner keeps its own texture coordinates under mirroring, for either winding."""
    scene = next(scene for number in range(0, 99 * BATCH, BATCH) if (scene := random_scene(1, number)).instances)
    mesh, mirrored = scene.instances[0].mesh, replace(scene.instances[0], to_world=np.diag([-1.0, 1.0, 1.0, 1.0])[:3])
    geometry = Geometry(replace(scene, meshes=[], spheres=[], instances=[mirrored]))
    assert mesh.uv is not None
    placed = {tuple(uv): p for p, uv in zip(mesh.vertices * [-1, 1, 1], mesh.uv.astype(float))}
    for p, uv in zip(geometry.corners.reshape(-1, 3), geometry.uv.reshape(-1, 2)):
        np.testing.assert_allclose(p, placed[tuple(uv)], atol=1e-6)
    outward = geometry.corners.mean(axis=1)
    assert (np.einsum("ni,ni->n", geometry.normal, outward) > 0).all()
