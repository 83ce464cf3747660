"""Stacks of partly transparent surfaces, apart and coincident: n of transmittance T transmit T^n, in any BVH."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import binomtest

from clrt.accel.traversal_kernels import TREES
from clrt.device.open import Device
from clrt.scene.geometry import instancing
from clrt.scene.lights import DirectionalLight
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Camera, Instance, Mesh, RenderSettings, Scene, Sphere
from clrt.scene.render_settings import Integrator

from .pictures import film

pytestmark = pytest.mark.statistics

Doubles = NDArray[np.float64]
QUAD = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
FACES = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
BLACK = (0.0, 0.0, 0.0)
SUN = DirectionalLight(direction=(1.0, 0.3, -1.0), irradiance=(2.0, 2.0, 2.0))
#: Radiance of the ground in the sun, and the transmittance of all stacks.
RADIANCE, STACK = 0.5 / np.pi * 2 / np.sqrt(2.09), 0.5
UPRIGHT = np.eye(3)
#: A rotation after which no plane is axis-aligned.
TURNED = np.linalg.qr(np.random.default_rng(7).normal(size=(3, 3)))[0]
TURNED *= np.linalg.det(TURNED)


@pytest.fixture(autouse=True)
def keep_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep instances of small meshes as instances."""
    monkeypatch.setattr(instancing, "FEW_TRIANGLES", 0)


def nth(count: int) -> Diffuse:
    """Return a black material of which `count` surfaces transmit STACK."""
    return Diffuse(color=BLACK, opacity=float(-np.expm1(np.log(STACK) / count)))


def quad(half: float, height: float, material: Diffuse) -> Mesh:
    return Mesh((half * QUAD + [0, 0, height]).astype(np.float32), FACES, material)


def stack(kind: str, count: int, apart: float) -> Scene:
    """Return surfaces from a height of 10 up, `apart` from each other, about 100 across: "quads" of a mesh each,
    "instances" of one, or "triangles" of one mesh, of different sizes."""
    heights = 10 + apart * np.arange(count)
    if kind == "triangles":
        rng = np.random.default_rng(count)
        plan = 60 * rng.uniform(0.7, 1.0, (count, 1, 1)) * [[-2, -1], [2, -1], [0, 3]]
        plan += rng.uniform(-5, 5, (count, 1, 2))
        corners = np.column_stack([plan.reshape(-1, 2), np.repeat(heights, 3)]).astype(np.float32)
        return Scene(meshes=[Mesh(corners, np.arange(3 * count, dtype=np.int32).reshape(-1, 3), nth(count))])
    if kind == "instances":
        mesh = quad(60, 0.0, nth(count))
        return Scene(instances=[Instance(mesh, np.column_stack([UPRIGHT, [0, 0, height]])) for height in heights])
    return Scene(meshes=[quad(60, height, nth(count)) for height in heights])


def over_ground(
    scene: Scene, integrator: Integrator, rotation: Doubles = UPRIGHT, sun: DirectionalLight = SUN
) -> Scene:
    """Return the scene above a sunlit ground, seen from below the stack; everything is rotated."""
    ground = quad(5, 0.0, Diffuse(color=(0.5, 0.5, 0.5)))
    camera = Camera(
        position=tuple((rotation @ [0, 0, 5.0]).tolist()),
        look_at=(0.0, 0.0, 0.0),
        up=tuple((rotation @ [0, 1.0, 0]).tolist()),
        fov_degrees=30.0,
    )
    return replace(
        scene,
        camera=camera,
        lights=[replace(sun, direction=tuple((rotation @ sun.direction).tolist()))],
        meshes=[
            replace(mesh, vertices=(mesh.vertices @ rotation.T).astype(np.float32)) for mesh in [*scene.meshes, ground]
        ],
        instances=[replace(each, to_world=rotation @ each.to_world) for each in scene.instances],
        render=RenderSettings(size=(8, 8), spp=1, max_depth=2, integrator=integrator),
    )


@pytest.mark.parametrize("apart", [0.0, 0.01])
@pytest.mark.parametrize("kind", ["quads", "triangles", "instances"])
@pytest.mark.parametrize("integrator", ["path", "local"])
def test_shadow_rays(device: Device, integrator: Integrator, kind: str, apart: float) -> None:
    """Transmittance has no noise. A coincident stack costs each ray the square of its size."""
    for count in (10, 300 if apart == 0 else 1000):
        for rotation in (UPRIGHT, TURNED):
            found = film(device, over_ground(stack(kind, count, apart), integrator, rotation)).mean
            assert found == pytest.approx(STACK * RADIANCE, rel=3e-4), (count, rotation is TURNED)


@pytest.mark.parametrize("layout", TREES)
def test_layouts(device: Device, layout: str) -> None:
    """Coincident triangles of different sizes do not share a leaf, and their t differ by rounding."""
    for count in (10, 60 if layout == "packs" else 300):
        found = film(device, over_ground(stack("triangles", count, 0.0), "path", TURNED), layout=layout).mean
        assert found == pytest.approx(STACK * RADIANCE, rel=3e-4), count


@pytest.mark.parametrize("count", [1, 10, 40])
@pytest.mark.parametrize("integrator", ["path", "local"])
def test_spheres(device: Device, integrator: Integrator, count: int) -> None:
    """A ray enters and leaves each, concentric or coincident; up to 16 are not in the BVH."""
    sun = replace(SUN, direction=(-1.0, -0.3, -1.0))
    for step in (0.0, 0.01):
        spheres = [
            Sphere(center=(100.0, 30.0, 100.0), radius=70 + step * i, material=nth(2 * count)) for i in range(count)
        ]
        found = film(device, over_ground(Scene(spheres=spheres), integrator, sun=sun)).mean
        assert found == pytest.approx(STACK * RADIANCE, rel=3e-4), step


@pytest.mark.parametrize("apart", [0.0, 0.01])
@pytest.mark.parametrize("integrator", ["path", "direct", "local", "raster"])
def test_camera_rays(device: Device, integrator: Integrator, apart: float) -> None:
    """Each sample sees the light behind the whole stack or a black surface: their number is binomial."""
    light = quad(300, -100.0, Diffuse(color=BLACK, emission=(1.0, 1.0, 1.0)))
    camera = Camera(position=(3.0, 0.0, 30.0), look_at=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), fov_degrees=20.0)
    settings, samples = RenderSettings(size=(8, 8), spp=32, max_depth=1, integrator=integrator), 2048
    for count in (10, 300 if apart == 0 else 1000):
        scene = stack("quads", count, -apart)
        found = film(device, replace(scene, meshes=[*scene.meshes, light], camera=camera, render=settings)).mean
        assert binomtest(round(float(found[..., 0].sum()) * 32), samples, STACK).pvalue > 1e-4, count
