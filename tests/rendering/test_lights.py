"""Sampling of lights at a position: means match closed forms, and both densities agree.

Irradiance E at a point with normal n is the mean of radiance·cos/pdf over the samples.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.kernel_probe import Probe
from clrt.bench.significance import mean_test, sidak
from clrt.device.open import Device
from clrt.scene.lights import DirectionalLight, PointLight
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Mesh, Scene, Sphere

pytestmark = pytest.mark.statistics


Doubles = NDArray[np.float64]
COUNT, FAMILY = 1 << 18, 1e-3
RADIANCE = np.array([17.0, 12.0, 4.0])
LAMP = Diffuse(emission=(17.0, 12.0, 4.0))
POINTS = np.array([[0.0, 0.0, 0.0], [0.5, -0.5, 1.0], [-2.0, -1.0, 0.3]])
UP = np.array([0.0, 1.0, 0.0])


def irradiances(probe: Probe, points: Doubles, normal: Doubles = UP) -> tuple[Doubles, Doubles]:
    """Return mean and variance, (m, 3) each, of COUNT samples' radiance·cos/pdf at points (m, 3)."""
    parts = []
    for seed, point in enumerate(probe.compiled.frame.points(points)):
        out = probe("light_sample", 12, np.tile(np.concatenate([point, normal]), (COUNT, 1)), seed=seed)
        parts.append(out[:, 3:6] * (np.maximum(out[:, :3] @ normal, 0) / out[:, 6])[:, None])
    return np.mean(parts, axis=1), np.var(parts, axis=1)


def assert_mean(probe: Probe, points: Doubles, expected: Doubles) -> None:
    mean, variance = irradiances(probe, points)
    # In addition to the noise there are a dozen roundings of float32, 1e-6 of the mean, which do not average out.
    p = mean_test(mean, variance + COUNT * (1e-6 * expected) ** 2, COUNT, expected)
    assert p.min() > sidak(FAMILY, p.size), (mean, expected)


def sphere_irradiance(center: Doubles, radius: float, points: Doubles) -> Doubles:
    """Return E = pi L (r/d)² cos θ of a sphere that is entirely above the horizon."""
    d = center - points
    distance2 = np.sum(d * d, axis=1)
    return np.outer(np.pi * radius**2 * d[:, 1] / distance2**1.5, RADIANCE)


def rectangle_irradiance(x0: float, x1: float, z0: float, z1: float, height: float, points: Doubles) -> Doubles:
    """Return E = pi L F, F the form factor of a rectangle parallel to the receiver, summed over corners (Howell,
    B-3)."""

    def corner(x: Doubles, z: Doubles) -> Doubles:
        h = height - points[:, 1]
        a, b = x - points[:, 0], z - points[:, 2]
        p, q = np.sqrt(h * h + a * a), np.sqrt(h * h + b * b)
        return np.asarray((a / p * np.arctan(b / p) + b / q * np.arctan(a / q)) / (2 * np.pi))

    ones = np.ones(len(points))
    corners = (x1, z1, 1), (x0, z1, -1), (x1, z0, -1), (x0, z0, 1)
    form = sum(sign * corner(x * ones, z * ones) for x, z, sign in corners)
    return np.outer(np.pi * form, RADIANCE)


def rectangle(x0: float, x1: float, z0: float, z1: float, height: float) -> Mesh:
    """Return a rectangle that faces down."""
    corners = [[x, height, z] for x, z in ((x0, z0), (x1, z0), (x1, z1), (x0, z1))]
    return Mesh(np.array(corners, np.float32), np.array([[0, 1, 2], [0, 2, 3]], np.int32), LAMP)


@pytest.mark.parametrize(
    ("center", "radius"), [((0.3, 3.0, 0.2), 1.5), ((1.0, 2.0, -1.0), 0.01), ((0.0, 1e4, 3e3), 1.0)]
)
def test_sphere(device: Device, center: tuple[float, float, float], radius: float) -> None:
    probe = Probe(device, Scene(spheres=[Sphere(center=center, radius=radius, material=LAMP)]))
    assert_mean(probe, POINTS, sphere_irradiance(np.array(center), radius, POINTS))


def test_inside_a_sphere_light_is_darkness(device: Device) -> None:
    probe = Probe(device, Scene(spheres=[Sphere(radius=2.0, material=LAMP)]))
    inside = np.array([[0.1, 0.2, 0.3], [0.0, 0.0, 0.0], [1.9, 0.0, 0.0]])
    assert not probe("light_sample", 12, inside, np.tile(UP, (3, 1)), seed=0)[:, 3:6].any()


@pytest.mark.parametrize(
    "side", [(-1.0, 0.7, -0.4, 1.5), (0.25, 0.25 + 2.0**-10, -0.5, 2.0**-10 - 0.5)], ids=["large", "tiny"]
)
def test_rectangle(device: Device, side: tuple[float, float, float, float]) -> None:
    probe = Probe(device, Scene(meshes=[rectangle(*side, 2.0)]))
    assert_mean(probe, POINTS, rectangle_irradiance(*side, 2.0, POINTS))


def test_behind_a_rectangle_is_darkness(device: Device) -> None:
    probe = Probe(device, Scene(meshes=[rectangle(-1, 1, -1, 1, -3.0)]))
    assert not irradiances(probe, POINTS, -UP)[0].any()


def test_point(device: Device) -> None:
    """Every sample is the same: E = I cos θ/d²."""
    position, intensity = np.array([1.5, 4.0, 3.0]), np.array([60.0, 58.0, 50.0])
    probe = Probe(device, Scene(lights=[PointLight(position=(1.5, 4.0, 3.0), intensity=(60.0, 58.0, 50.0))]))
    d = position - POINTS
    expected = np.outer(d[:, 1] / np.sum(d * d, axis=1) ** 1.5, intensity)
    mean, variance = irradiances(probe, POINTS)
    np.testing.assert_allclose(mean, expected, rtol=1e-6)
    assert np.all(variance < 1e-20)


def test_directional(device: Device) -> None:
    """E = irradiance·cos θ; samples are flagged as infinitely distant and as a single direction."""
    probe = Probe(device, Scene(lights=[DirectionalLight(direction=(1.0, -2.0, 0.5), irradiance=(3.0, 2.0, 1.0))]))
    cosine = 2 / np.sqrt(1 + 4 + 0.25)
    mean, _ = irradiances(probe, POINTS)
    np.testing.assert_allclose(mean, np.tile([3 * cosine, 2 * cosine, cosine], (3, 1)), rtol=1e-6)
    assert np.all(probe("light_sample", 12, POINTS, np.tile(UP, (3, 1)), seed=0)[:, 10:] == 1)


def test_all_together(device: Device) -> None:
    """E is the sum over all lights, each chosen with its probability."""
    side = (1.0, 2.0, -2.0, -1.0)
    scene = Scene(
        meshes=[rectangle(*side, 3.0)],
        spheres=[Sphere(center=(-1.0, 4.0, 1.0), radius=0.5, material=LAMP)],
        lights=[
            PointLight(position=(0.0, 5.0, 0.0), intensity=(5.0, 50.0, 10.0)),
            DirectionalLight(direction=(0.0, -1.0, 0.0), irradiance=(1.0, 2.0, 3.0)),
        ],
    )
    d = np.array([0.0, 5.0, 0.0]) - POINTS
    expected = (
        rectangle_irradiance(*side, 3.0, POINTS)
        + sphere_irradiance(np.array([-1.0, 4.0, 1.0]), 0.5, POINTS)
        + np.outer(d[:, 1] / np.sum(d * d, axis=1) ** 1.5, [5.0, 50.0, 10.0])
        + np.array([1.0, 2.0, 3.0])
    )
    assert_mean(Probe(device, scene), POINTS, expected)


def test_a_met_lamp_has_the_density_of_its_samples(device: Device) -> None:
    """A ray along a sample's direction hits the emitter and finds the density and radiance that the sample reported."""
    probe = Probe(device, scattered_lamps())
    points, normals = points_and_normals(1 << 16)
    sample = probe("light_sample", 12, points, normals, seed=1)
    met = probe("emitter", 5, points, normals, sample[:, :3])
    # A sample at an emitter's edge may round past it.
    hit = met[:, 4] >= 0
    assert np.mean(~hit) < 1e-4
    np.testing.assert_allclose(met[hit, 3], sample[hit, 6], rtol=1e-4)
    assert np.all(met[hit, :3] == sample[hit, 3:6])


def test_shadow_rays_end_before_their_lamp(device: Device) -> None:
    """Nothing lies between a point and the target of its light sample, and the emitter does not shadow itself."""
    probe = Probe(device, scattered_lamps())
    points, normals = points_and_normals(1 << 18)
    sample = probe("light_sample", 12, points, normals, seed=2)
    to_target = sample[:, 7:10] - points
    assert not probe("any_hit", 1, points, to_target, np.ones(len(points))).any()


@pytest.mark.parametrize("kind", ["sphere", "quad", "triangle"])
def test_shadow_rays_end_before_a_lamp_near_by(device: Device, kind: str) -> None:
    """At distances of 1e-4 to 10 times its size, for any position of emitter and points: a q close to 0
    does not bound its rounding error."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        size, turn = 10.0 ** rng.uniform(-2, 3), np.linalg.qr(rng.normal(size=(3, 3)))[0]
        normal, gaps = turn[:, 2], size * 10.0 ** rng.uniform(-4, 1, (1 << 14, 1))
        place = size * 10.0 ** rng.uniform(-8, 0) * rng.uniform(-1, 1, 3)  # of its frontmost point or centre
        corners = (np.array([[-1, -1], [-1, 1], [1, 1], [1, -1]]) @ turn[:, :2].T * size + place).astype(np.float32)
        faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)[: 2 if kind == "quad" else 1]
        if np.cross(corners[1] - corners[0], corners[2] - corners[0]) @ normal < 0:
            faces = faces[:, ::-1].copy()
        center = tuple((place - size * normal).tolist())
        scene = (
            Scene(spheres=[Sphere(center=center, radius=size, material=LAMP)])
            if kind == "sphere"
            else Scene(meshes=[Mesh(corners, faces, LAMP)])
        )
        points = (place + gaps * normal).astype(np.float32).astype(np.float64)
        probe = Probe(device, scene, layout="bvh8")
        sample = probe("light_sample", 12, points, np.tile(-normal, (len(points), 1)), seed=4)
        assert sample[:, 3:6].all()
        to_target = sample[:, 7:10] - points
        assert not probe("any_hit", 1, points, to_target, np.ones(len(points))).any(), (size, place)


def points_and_normals(count: int) -> tuple[Doubles, Doubles]:
    """Return points in the unit cube, exact in float32, and random unit normals, (count, 3) each."""
    rng = np.random.default_rng(0)
    points, normals = rng.uniform(-1, 1, (count, 3)).astype(np.float32).astype(np.float64), rng.normal(size=(count, 3))
    return points, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def scattered_lamps() -> Scene:
    """Return emitters that do not occlude each other seen from the unit cube."""
    return Scene(
        meshes=[rectangle(3.0, 5.0, -1.0, 1.0, 3.0)],
        spheres=[
            Sphere(center=(-4.0, 2.0, 1.0), radius=0.5, material=LAMP),
            Sphere(center=(0.0, 5000.0, 2000.0), radius=20.0, material=LAMP),
            Sphere(center=(0.0, 20.0, -60.0), radius=0.1, material=LAMP),
        ],
    )
