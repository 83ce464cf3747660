"""Denoiser guides: albedo and normals of visible surfaces, also through mirrors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.device.open import Device
from clrt.rendering.accumulation import per_pixel_kernel
from clrt.rendering.accumulation.denoiser_guides import render_guides
from clrt.scene.materials.material_types import Dielectric, Diffuse, Material, MetallicRoughness, Mirror, Principled
from clrt.scene.model import Camera, Environment, Mesh, RenderSettings, Scene, Sphere

from .pictures import film, frame, quad, session, view_rays
from .test_variants import everything

Doubles = NDArray[np.float64]
Floats = NDArray[np.float32]
RED, GREY = (0.7, 0.2, 0.1), (0.5, 0.5, 0.5)
#: Camera that sees only the back of a box of 2 units around the origin.
INSIDE = Camera(position=(0.0, 0.0, 0.9), look_at=(0.0, 0.0, -1.0), fov_degrees=20)
FLAT = RenderSettings(size=(6, 4), spp=1)
SKY = Environment(color=(0.5, 1.0, 4.0))
#: Materials, and how far their albedo may be from a furnace of a million samples: the energy that GGX of alpha 0.01
#: loses between microfacets, and noise. A rough metal matches only if it is white and has multiple scattering.
FURNACE: dict[Material, float] = {
    Diffuse(color=RED): 1e-5,
    MetallicRoughness(color=RED, metallic=1.0, roughness=0.1): 5e-4,
    MetallicRoughness(color=RED, metallic=0.0, roughness=0.1): 5e-4,
    MetallicRoughness(color=RED, metallic=0.5, roughness=0.1): 5e-4,
    MetallicRoughness(preset="diamond", color=(1.0, 1.0, 1.0), roughness=0.1): 5e-4,
    MetallicRoughness(metallic=1.0, color=(1.0, 1.0, 1.0), roughness=0.9, multiple_scattering=True): 4e-3,
    Principled(color=RED, metallic=0.3, roughness=0.1): 1e-3,
    Principled(color=RED, roughness=0.2, spec_tint=1.0, flatness=1.0): 1e-3,
    Principled(color=RED, roughness=0.2, sheen=1.0, clearcoat=1.0): 1e-3,
    Principled(color=RED, roughness=0.2, clearcoat=1.0, clearcoat_gloss=0.8): 1e-3,
}


def with_specks(scene: Scene) -> Scene:
    """Return the scene with specks of all materials, and a smooth one, too small and far away to be seen,
    so that all scenes use one program."""
    specks = [
        Sphere(center=(30.0, 30.0, 30.0 + i), radius=1e-3, material=material)
        for i, material in enumerate([*FURNACE, Mirror(), Dielectric()])
    ]
    smooth = quad([(30, 30, 29), (30.001, 30, 29), (30.001, 30.001, 29), (30, 30.001, 29)], Diffuse())
    smooth.normals = np.tile(np.array([0.0, 0.0, 1.0], np.float32), (4, 1))
    return replace(scene, meshes=[*scene.meshes, smooth], spheres=[*scene.spheres, *specks])


def guides(device: Device, scene: Scene, samples: int = 4, lanes: int | None = None) -> dict[str, Floats]:
    chosen = {} if lanes is None else {"lanes": lanes}
    return render_guides(session(device, with_specks(scene), "sobol", **chosen), samples)


def back(material: Material, z: float = -1.0) -> Mesh:
    """Return a wall of 4 by 4 units across the z axis that faces +z."""
    return quad([(-2, -2, z), (2, -2, z), (2, 2, z), (-2, 2, z)], material)


def front(material: Material, z: float = 1.0) -> Mesh:
    """Return the same wall, facing −z."""
    return quad([(-2, -2, z), (-2, 2, z), (2, 2, z), (2, -2, z)], material)


def everywhere(picture: Floats, expected: tuple[float, ...]) -> None:
    """Assert that each pixel is `expected`, to the roundings of a mean."""
    np.testing.assert_allclose(picture, np.broadcast_to(expected, picture.shape), rtol=1e-6, atol=1e-7)


@pytest.mark.programs
@pytest.mark.parametrize("material, tolerance", FURNACE.items(), ids=range(len(FURNACE)))
def test_albedo_is_what_a_furnace_shows(device: Device, material: Material, tolerance: float) -> None:
    """Seen head on under a white sky, an unoccluded surface is as bright as its albedo."""
    scene = Scene(
        meshes=[back(material)],
        environment=Environment(color=(1.0, 1.0, 1.0)),
        camera=replace(INSIDE, fov_degrees=1e-2),
        render=RenderSettings(size=(16, 16), max_depth=2),
    )
    shown = film(device, with_specks(scene), 4096, sampler="sobol").mean.mean(axis=(0, 1))
    np.testing.assert_allclose(guides(device, scene)["albedo"].mean(axis=(0, 1)), shown, atol=tolerance)


@pytest.mark.programs
def test_normals_of_a_sphere(device: Device) -> None:
    """In pixels that the sphere covers: the mean over the pixel, by quadrature in float64."""
    camera, size, center, radius = Camera(position=(3.0, 2.0, 4.0)), (20, 15), np.array([0.2, -0.1, 0.0]), 1.3
    scene = Scene(
        spheres=[Sphere(center=tuple(center.tolist()), radius=radius, material=Diffuse(color=RED))],
        camera=camera,
        render=RenderSettings(size=size),
    )
    nodes, weights = np.polynomial.legendre.leggauss(6)
    place = (nodes + 1) / 2
    columns, rows = (np.add.outer(np.arange(n), place).ravel() for n in size)
    w = view_rays(camera, size, *np.meshgrid(columns, rows))
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    to_center = center - camera.position
    along = w @ to_center
    inside = radius**2 - to_center @ to_center + along**2
    normals = (w * (along - np.sqrt(np.maximum(inside, 0)))[..., None] - to_center) / radius
    cells = (size[1], 6, size[0], 6)
    expected = np.einsum("hiwjk,i,j->hwk", normals.reshape(*cells, 3), weights / 2, weights / 2)
    covered = inside.reshape(cells).min(axis=(1, 3)) > 0.05 * radius**2
    found = guides(device, scene, 1024)
    assert covered.sum() > 50
    np.testing.assert_allclose(found["normal"][covered], expected[covered], atol=2e-4)
    colors = np.broadcast_to(RED, expected.shape)[covered]
    np.testing.assert_allclose(found["albedo"][covered], colors, rtol=1024 * 2**-24)


@pytest.mark.programs
def test_normals_face_the_camera(device: Device) -> None:
    """Also those of a wall that is seen from behind, and of one with tilted shading normals."""
    everywhere(guides(device, Scene(meshes=[back(Diffuse())], camera=INSIDE, render=FLAT))["normal"], (0, 0, 1))
    behind = replace(INSIDE, position=(0.0, 0.0, -3.0))
    everywhere(guides(device, Scene(meshes=[back(Diffuse())], camera=behind, render=FLAT))["normal"], (0, 0, -1))
    leaning = back(Diffuse())
    leaning.normals = np.tile(np.array([0.6, 0.0, 0.8], np.float32), (4, 1))
    everywhere(guides(device, Scene(meshes=[leaning], camera=INSIDE, render=FLAT))["normal"], (0.6, 0, 0.8))


@pytest.mark.programs
def test_sky_is_its_radiance_up_to_one_without_a_normal(device: Device) -> None:
    found = guides(device, Scene(environment=Environment(color=(2.0, 0.5, 0.25)), render=FLAT))
    everywhere(found["albedo"], (1.0, 0.5, 0.25))
    everywhere(found["normal"], (0, 0, 0))
    black = guides(device, Scene(render=FLAT))
    assert not black["albedo"].any() and not black["normal"].any()


def test_mirrors_are_followed(device: Device) -> None:
    """To the wall behind the camera, tinted, and to the sky; through two mirrors; and no deeper than `max_depth`."""
    tinted, behind = Mirror(color=(0.9, 0.8, 0.5)), front(Diffuse(color=RED))
    wall = Scene(
        meshes=[back(tinted), behind],
        environment=SKY,
        camera=INSIDE,
        render=replace(FLAT, max_depth=4),
    )
    found = guides(device, wall)
    everywhere(found["albedo"], (0.63, 0.16, 0.05))
    everywhere(found["normal"], (0, 0, -1))
    found = guides(device, replace(wall, meshes=[back(tinted), front(Diffuse(color=RED), 99.0)]))
    everywhere(found["albedo"], (0.45, 0.8, 0.5))
    everywhere(found["normal"], (0, 0, 0))
    twice = [back(tinted), front(Mirror(color=GREY)), back(Diffuse(color=RED), -0.5)]
    found = guides(device, replace(wall, meshes=twice, camera=replace(INSIDE, look_at=(0.0, 0.0, 2.0))))
    everywhere(found["albedo"], (0.35, 0.1, 0.05))
    for depth, seen in ((1, False), (2, True)):
        found = guides(device, replace(wall, render=replace(FLAT, max_depth=depth)))
        assert found["albedo"].all() == found["normal"].any() == seen


@pytest.mark.programs
def test_glass_is_looked_through(device: Device) -> None:
    """Tinted at both faces; if more is reflected than refracted, the reflection is used."""
    glass, wall = Dielectric(color=(0.9, 0.8, 0.5)), back(Diffuse(color=RED))
    side = quad([(1.9, -2, 0.5), (1.9, -2, 2), (1.9, 2, 2), (1.9, 2, 0.5)], Diffuse(color=GREY))
    pane = Scene(meshes=[front(glass, -0.5), back(glass, 0.5), wall, side], environment=SKY, camera=INSIDE, render=FLAT)
    found = guides(device, pane)
    everywhere(found["albedo"], (0.7 * 0.9**2, 0.2 * 0.8**2, 0.1 * 0.5**2))
    everywhere(found["normal"], (0, 0, 1))
    grazing = replace(INSIDE, position=(-1.9, 0.0, 0.51), look_at=(1.9, 0.0, 0.49), fov_degrees=0.1)
    found = guides(device, replace(pane, camera=grazing))
    everywhere(found["albedo"], GREY)
    everywhere(found["normal"], (-1, 0, 0))


@pytest.mark.programs
def test_glass_absorbs(device: Device) -> None:
    """What is seen through a pane 1 unit thick is tinted by its transmittance, also the sky."""
    glass = Dielectric(color=(0.9, 0.8, 0.5), attenuation_color=(0.49, 0.25, 0.04), attenuation_distance=2.0)
    pane = Scene(
        meshes=[front(glass, -0.5), back(glass, 0.5), back(Diffuse(color=RED))],
        render=FLAT,
        environment=Environment(color=(0.5, 0.5, 0.5)),
        camera=replace(INSIDE, fov_degrees=1e-3),
    )
    tint = 0.9**2 * 0.7, 0.8**2 * 0.5, 0.5**2 * 0.2
    everywhere(guides(device, pane)["albedo"], (0.7 * tint[0], 0.2 * tint[1], 0.1 * tint[2]))
    sky = guides(device, replace(pane, meshes=pane.meshes[:2]))
    everywhere(sky["albedo"], (0.5 * tint[0], 0.5 * tint[1], 0.5 * tint[2]))


def test_edges_are_shares_of_the_pixel(device: Device) -> None:
    """A wall that covers half of the middle column: half its albedo and the sky's, half its normal."""
    half = quad([(-2, -2, -1), (0, -2, -1), (0, 2, -1), (-2, 2, -1)], Diffuse(color=RED))
    scene = Scene(meshes=[half], environment=SKY, camera=INSIDE, render=RenderSettings(size=(5, 3)))
    found = guides(device, scene, 64)
    seen = np.minimum(SKY.color, 1)
    np.testing.assert_allclose(found["albedo"][:, 2], np.tile(np.add(RED, seen) / 2, (3, 1)), rtol=0.04)
    np.testing.assert_allclose(found["normal"][:, 2], [[0, 0, 0.5]] * 3, atol=0.02)
    everywhere(found["albedo"][:, 3:], tuple(seen.tolist()))
    everywhere(found["albedo"][:, :2], RED)
    assert not found["normal"][:, 3:].any()


@pytest.mark.combinations
def test_lanes_agree(device: Device) -> None:
    """Results agree to float rounding, except for samples on an edge, which rounding may flip."""
    pictures = [guides(device, everything(), lanes=lanes) for lanes in (8, 1)]
    for name, picture in pictures[1].items():
        assert np.mean(np.abs(picture - pictures[0][name]).max(axis=2) > 1e-5) < 1e-3, name


def test_launches_agree(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """They are equal bit for bit however the work is split into launches."""
    meshes = [back(Mirror()), front(Diffuse(color=RED))]
    scene = Scene(meshes=meshes, environment=SKY, camera=INSIDE, render=RenderSettings(size=(60, 40)))
    whole = guides(device, scene)
    monkeypatch.setattr(per_pixel_kernel, "FIRST_LAUNCH_SAMPLES", 1)
    monkeypatch.setattr(per_pixel_kernel, "FEWEST_TILES", 2)
    for name, picture in guides(device, scene).items():
        assert picture.tobytes() == whole[name].tobytes(), name


@pytest.mark.combinations
def test_they_are_in_range(device: Device) -> None:
    """For all kinds of surfaces, lights and materials. Normals face the camera."""
    found = guides(device, everything(), 16)
    assert all(picture.dtype == np.float32 and picture.shape == (33, 45, 3) for picture in found.values())
    assert found["albedo"].min() >= 0 and found["albedo"].max() <= 1
    assert np.linalg.norm(found["normal"], axis=2).max() <= 1 + 1e-6
    assert frame(everything().camera)[0] @ found["normal"][20, 22] < 0
