"""Light sampling against its pdf: emitters of all sizes, environment maps, and the selection among many lights."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...device.open import Device
from ...scene.lights import DirectionalLight, Light, PointLight
from ...scene.materials.material_types import Diffuse
from ...scene.model import Environment, Mesh, Scene, Sphere
from ..kernel_probe import Doubles, Probe
from ..significance import chi2_test
from .warps import triangle_test, uniform_test

LAMP = Diffuse(emission=(1.0, 1.0, 1.0))
UP = (0.0, 1.0, 0.0)
#: Centers and radii of spheres seen from the origin: large, almost touching it, small, tiny and far.
SPHERES = (
    ((0.0, 0.0, 3.0), 2.0),
    ((0.0, 0.0, 1.0001), 1.0),
    ((3.0, -4.0, 12.0), 2.0),
    ((3.0, -4.0, 12.0), 0.05),
    ((0.0, 0.0, 1e4), 1.0),
    ((0.0, 0.0, 10.0), 1e-6),
    ((0.0, 0.0, 1e5 + 1.0), 1e5),
)
#: Vertices of triangles that face the origin: large and near, grazing, a sliver, small and far.
TRIANGLES = (
    ((-2.0, -1.0, 1.0), (0.5, 2.0, 1.5), (3.0, -1.0, 2.0)),
    ((-1.0, 0.01, 1.0), (1.0, 0.01, 1.0), (0.0, 0.012, 3.0)),
    ((-1.0, 0.0, 2.0), (0.0, 1e-4, 2.0), (1.0, 0.0, 2.0)),
    ((-1e-3, -1e-3, 1e2), (0.0, 1e-3, 1e2), (1e-3, -1e-3, 1e2)),
)
#: Cells per texel along each side.
PARTS = 2


class LightTest(NamedTuple):
    """Result of a test. density: p-value of the chi-square test of samples against their pdf; error: the largest
    relative deviation of that pdf from its closed form, or of its integral from 1.
    """

    name: str
    density: float
    error: float


def light_tests(device: Device, samples: int, seed: int) -> list[LightTest]:
    """Test the samples of each light, and the selection among several."""
    return [test for measure in (lamps, picks, skies) for test in measure(device, samples, seed)]


def lamps(device: Device, samples: int, seed: int, changes: Mapping[str, str] | None = None) -> Iterator[LightTest]:
    """Test SPHERES and TRIANGLES; changes: see Probe."""
    for k, (center, radius) in enumerate(SPHERES):
        probe = Probe(device, Scene(spheres=[Sphere(center=center, radius=radius, material=LAMP)]), changes=changes)
        wi, pdf = _sampled(probe, samples, seed + k)
        yield LightTest(f"sphere at {center}, radius {radius:g}", *_cone(wi, pdf, np.array(center), radius))
    for k, corners in enumerate(TRIANGLES, start=len(SPHERES)):
        mesh = Mesh(np.array(corners, np.float32), np.array([[0, 1, 2]], np.int32), LAMP)
        wi, pdf = _sampled(Probe(device, Scene(meshes=[mesh]), changes=changes), samples, seed + k)
        yield LightTest(f"triangle {corners}", *_area(wi, pdf, mesh.vertices.astype(np.float64)))


def _sampled(probe: Probe, samples: int, seed: int) -> tuple[Doubles, Doubles]:
    """Return wi (n, 3) and pdf (n,) of light samples from the origin."""
    origin = probe.compiled.frame.points(np.zeros(3))
    out = probe("light_sample", 12, np.tile([*origin, *UP], (samples, 1)), seed=seed)
    return out[:, :3], out[:, 6]


def _cone(wi: Doubles, pdf: Doubles, center: Doubles, radius: float) -> tuple[float, float]:
    """Test for uniformity in 1 − cos of the angle to the sphere's center, and in the azimuth around it."""
    center = center.astype(np.float32).astype(np.float64)
    sin2_max = (np.float64(np.float32(radius)) / np.linalg.norm(center)) ** 2
    height = sin2_max / (1 + np.sqrt(1 - sin2_max))
    n = center / np.linalg.norm(center)
    s = np.cross(n, [0.0, 1.0, 0.0]) / np.linalg.norm(np.cross(n, [0.0, 1.0, 0.0]))
    x, y, z = wi @ s, wi @ np.cross(n, s), wi @ n
    turn = np.arctan2(y, x) / (2 * np.pi) % 1
    return uniform_test((x * x + y * y) / (1 + z) / height, turn), _off(pdf, 1 / (2 * np.pi * height))


def _area(wi: Doubles, pdf: Doubles, corners: Doubles) -> tuple[float, float]:
    """Test for uniformity over the triangle, where wi intersects its plane; pdf = d²/(cos θ·area)."""
    p0, e1, e2 = corners[0], corners[1] - corners[0], corners[2] - corners[0]
    n = np.cross(e1, e2)
    t = p0 @ n / (wi @ n)
    b = np.linalg.lstsq(np.column_stack([e1, e2]), (t[:, None] * wi - p0).T, rcond=None)[0]
    area = np.linalg.norm(n) / 2
    return triangle_test(*b), _off(pdf, t * t / (np.abs(wi @ n) / (2 * area) * area))


def _off(found: Doubles, exact: Doubles | float) -> float:
    return float(np.max(np.abs(found / exact - 1)))


def skies(device: Device, samples: int, seed: int, changes: Mapping[str, str] | None = None) -> Iterator[LightTest]:
    """Test environment maps over parts of texels, in each of which pdf·sin θ is constant."""
    for k, (name, (image, degrees)) in enumerate(_pictures().items()):
        probe = Probe(device, Scene(environment=Environment(image=image, rotation_degrees=degrees)), changes=changes)
        rows, columns = PARTS * image.shape[0], PARTS * image.shape[1]
        v, u = np.meshgrid((np.arange(rows) + 0.5) / rows, (np.arange(columns) + 0.5) / columns, indexing="ij")
        wi = _direction(u.ravel(), v.ravel(), degrees)
        mass = probe("sky", 4, np.zeros_like(wi), np.tile(UP, (len(wi), 1)), wi)[:, 3] * np.sin(np.pi * v.ravel())
        mass *= 2 * np.pi**2 / v.size
        x, y = _place(_sampled(probe, samples, seed + k)[0], degrees)
        row, column = (np.minimum((a * n).astype(int), n - 1) for a, n in ((y, rows), (x, columns)))
        counts = np.bincount(row * columns + column, minlength=v.size)
        yield LightTest(f"sky: {name}", chi2_test(counts, mass / mass.sum() * samples), float(abs(mass.sum() - 1)))


def _pictures() -> dict[str, tuple[NDArray[np.float32], float]]:
    """Return environment maps (height, width, 3), and their rotations in degrees."""
    rng = np.random.default_rng(1)
    uneven = (rng.uniform(0.1, 2.0, (16, 32, 3)) * rng.random((16, 32, 1)) ** 8).astype(np.float32)
    sun = uneven.copy()
    sun[4, 20] = 1e5
    return {"uneven": (uneven, 0.0), "turned": (uneven, 77.0), "sun": (sun, -130.0), "one row": (uneven[:1], 10.0)}


def _direction(u: Doubles, v: Doubles, degrees: float) -> Doubles:
    """Return (n, 3): u = atan2(x, −z)/2·pi, v = acos(y)/pi, rotated about +Y, counter-clockwise seen from above."""
    sine, phi = np.sin(np.pi * v), 2 * np.pi * u - np.radians(degrees)
    return np.column_stack([sine * np.sin(phi), np.cos(np.pi * v), -sine * np.cos(phi)])


def _place(wi: Doubles, degrees: float) -> tuple[Doubles, Doubles]:
    """Return u and v of directions (n, 3)."""
    x, y, z = wi.T
    return (np.arctan2(x, -z) + np.radians(degrees)) / (2 * np.pi) % 1, np.arctan2(np.hypot(x, z), y) / np.pi


def picks(device: Device, samples: int, seed: int, changes: Mapping[str, str] | None = None) -> Iterator[LightTest]:
    """Test that lights are selected by their reported probabilities, which sum to 1: at the origin, facing up."""
    for k, (name, lights) in enumerate(_lights().items()):
        probe = Probe(device, Scene(lights=lights), changes=changes)
        rows = np.tile([0.0, 0.0, 0.0, *UP], (max(samples, len(lights)), 1))
        mass = probe("light_probability", 1, rows[: len(lights)], np.arange(len(lights)))[:, 0]
        picked = probe("pick_light", 3, rows[:samples], seed=seed + k)[:, 0].astype(int)
        density = chi2_test(np.bincount(picked, minlength=len(lights)), mass / mass.sum() * samples)
        yield LightTest(f"choice of {name}", density, float(abs(mass.sum() - 1)))


def _lights() -> dict[str, list[Light]]:
    """Return point lights in all directions, and infinite lights."""
    rng = np.random.default_rng(7)
    suns: list[Light] = [DirectionalLight(direction=(x, -1.0, 0.5), irradiance=(1.0, 0.5, 1.0)) for x in range(3)]
    return {
        f"{count} lights, {k} infinite": [*_points(rng, count), *suns[:k]]
        for count, k in ((2, 0), (7, 1), (32, 3), (33, 0), (300, 2), (20_000, 0))
    }


def _points(rng: np.random.Generator, count: int) -> list[Light]:
    """Return point lights, about half of them below the surface at the origin, and some at the same position."""
    places = rng.normal(size=(count, 3))
    places[:2, 1], places[: count // 10] = 1.0, places[0]
    return [
        PointLight(position=(x, y, z), intensity=(power, power, power))
        for (x, y, z), power in zip(places.tolist(), rng.pareto(2.0, count).tolist())
    ]
