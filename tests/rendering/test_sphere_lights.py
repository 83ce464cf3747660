"""Sphere lights from near to far: reflected radiance against the irradiance by a float64 quadrature."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.numerics.bsdf_cases import variants
from clrt.device.open import Device
from clrt.scene.geometry import instancing
from clrt.scene.materials.material_types import MATERIALS, Diffuse, Material
from clrt.scene.model import Camera, Instance, Mesh, RenderSettings, Scene, Sphere
from clrt.scene.render_settings import Integrator

from .lamps import directions
from .pictures import film

pytestmark = pytest.mark.statistics

Doubles = NDArray[np.float64]
ALBEDO, COUNT, KINDS = 0.5, 24, ("flat", "curved", "instance")
QUAD = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
FACES = np.array([[0, 1, 2], [0, 2, 3]], np.int32)


def irradiance(distance: float, radius: float, cosine: float, n: int = 512) -> float:
    """Return E/L of a sphere whose centre is at `distance` in a direction with that cosine to the normal: the clamped
    cosine averaged over the cone that it subtends (midpoint rule; in 1 − cos of the cone's angle)."""
    sine2 = (radius / distance) ** 2
    height = sine2 / (1 + np.sqrt(1 - sine2))
    h, phi = np.meshgrid((np.arange(n) + 0.5) / n * height, (np.arange(n) + 0.5) / n * np.pi)
    cosines = (1 - h) * cosine + np.sqrt(h * (2 - h) * (1 - cosine**2)) * np.cos(phi)
    return float(np.maximum(cosines, 0).mean() * 2 * np.pi * height)


def frame_around(n: Doubles) -> Doubles:
    """Return a rotation (3, 3) whose last column is n."""
    s = np.cross(n, [1.0, 0, 0] if abs(n[0]) < 0.5 else [0, 1.0, 0])
    s /= np.linalg.norm(s)
    return np.column_stack([s, np.cross(n, s), n])


def lit(kind: str, integrator: Integrator, radius: float, gap: float, cosine: float, rng: np.random.Generator) -> Scene:
    """Return a receiver lit by a sphere of some radius at `gap` radii, with its centre at that cosine to the
    normal, seen from half the gap."""
    n, p = directions(rng, 1)[0], rng.uniform(-3, 3, 3) * radius * 10.0 ** rng.uniform(-8, 0)
    turn, distance = frame_around(n), radius * (1 + gap)
    toward = turn @ [np.sqrt(1 - cosine**2), 0, cosine]
    grey, scene = Diffuse(color=(ALBEDO,) * 3), Scene()
    if kind == "curved":
        size = radius * 10.0 ** rng.uniform(-1, 1)
        scene.spheres.append(Sphere(center=tuple((p - size * n).tolist()), radius=size, material=grey))
    elif kind == "instance":
        mesh = Mesh(QUAD, FACES, grey)
        scene.instances.extend(
            Instance(mesh, np.column_stack([10 * radius * turn, p - depth * radius * n])) for depth in (0, 5)
        )
    else:
        scene.meshes.append(Mesh((10 * radius * QUAD @ turn.T + p).astype(np.float32), FACES, grey))
    scene.spheres.append(
        Sphere(
            center=tuple((p + distance * toward).tolist()),
            radius=radius,
            material=Diffuse(color=(0.0, 0.0, 0.0), emission=(1.0, 1.0, 1.0)),
        )
    )
    scene.camera = Camera(
        position=tuple((p + gap * radius / 2 * n).tolist()),
        look_at=tuple(p.tolist()),
        up=tuple(turn[:, 0].tolist()),
        fov_degrees=0.2,
    )
    scene.render = RenderSettings(size=(8, 8), spp=512, max_depth=2, integrator=integrator)
    return scene


@pytest.mark.parametrize("integrator", ["path", "local"])
@pytest.mark.parametrize("kind", KINDS)
def test_near_and_far(device: Device, kind: str, integrator: Integrator, monkeypatch: pytest.MonkeyPatch) -> None:
    """Radii between .01 and 1000, gaps between 1e-4 and 10 radii, some partly below the horizon: to 1 %."""
    monkeypatch.setattr(instancing, "FEW_TRIANGLES", 0)
    rng = np.random.default_rng(KINDS.index(kind))
    for _ in range(COUNT):
        radius, gap, cosine = 10.0 ** rng.uniform(-2, 3), 10.0 ** rng.uniform(-4, 1), rng.uniform(0.1, 1)
        scene = lit(kind, integrator, radius, gap, cosine, rng)
        expected = ALBEDO / np.pi * irradiance(radius * (1 + gap), radius, cosine)
        found = film(device, scene, sampler="sobol").mean.mean()
        assert found == pytest.approx(expected, rel=0.01), (radius, gap, cosine)


#: One variant of each material type with transmission lobes.
PASSED = {
    kind.__name__: next(each for each in variants(kind) if "TRANSMISSION_LOBES" in each.features())
    for kind in MATERIALS
    if any("TRANSMISSION_LOBES" in each.features() for each in variants(kind))
}


@pytest.mark.parametrize("kind", PASSED)
def test_a_sphere_does_not_light_itself(device: Device, kind: str) -> None:
    """It emits outwards and is convex, so its image is its emission for any material, position and size."""
    material, rng = replace(PASSED[kind], emission=(1.0, 2.0, 3.0)), np.random.default_rng(3)
    for _ in range(COUNT // 2):
        radius = 10.0 ** rng.uniform(-2, 3)
        center = directions(rng, 1)[0] * radius * 10.0 ** rng.uniform(-2, 3)
        scene = Scene(
            spheres=[Sphere(center=tuple(center.tolist()), radius=radius, material=material)],
            camera=Camera(position=tuple((center + [0, 0, 3 * radius]).tolist()), look_at=tuple(center.tolist())),
            render=RenderSettings(size=(16, 16), spp=64, max_depth=3),
        )
        shine = film(device, replace(scene, render=replace(scene.render, max_depth=1)))
        np.testing.assert_array_equal(film(device, scene).mean, shine.mean)


@pytest.mark.parametrize("integrator", ["path", "local"])
def test_light_in_part_opaque(device: Device, integrator: Integrator) -> None:
    """It emits only where it is opaque: its light is proportional to its opacity."""
    rng = np.random.default_rng(9)
    for _ in range(4):
        opacity, lamp = rng.uniform(0.1, 0.9), Diffuse(color=(0.0, 0.0, 0.0), emission=(1.0, 1.0, 1.0))
        scene = lit("flat", integrator, 1.0, 10.0 ** rng.uniform(-1, 1), rng.uniform(0.3, 1), rng)
        opaque, clear = (
            film(device, with_lamp(scene, each), sampler="sobol").mean.mean()
            for each in (lamp, replace(lamp, opacity=opacity))
        )
        assert clear == pytest.approx(opacity * opaque, rel=0.01)


def with_lamp(scene: Scene, material: Material) -> Scene:
    """Return the scene with another material for its last sphere."""
    return replace(scene, spheres=[*scene.spheres[:-1], replace(scene.spheres[-1], material=material)])
