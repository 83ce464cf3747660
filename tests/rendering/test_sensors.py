"""Radiance along rays and irradiance at points: closed forms, and relations between the two."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import binom, t

import clrt
from clrt.device.open import Device
from clrt.errors import UsageError
from clrt.rendering.light_meter import Measurement
from clrt.rendering.sensors import SensorOptions
from clrt.scene.ray_list import REPLICAS
from clrt.scene.render_settings import Sampler

from ..covering import others
from ..oracle.scenes import todays_seed

Doubles = NDArray[np.float64]
Color = tuple[float, float, float]
SCENES = Path(__file__).parents[2] / "scenes"
BLACK = clrt.Environment(color=(0, 0, 0))
#: Probability that an error exceeds three standard errors.
BEYOND = 2 * float(t.sf(3, REPLICAS - 1))


def check_within_three_standard_errors(measured: Measurement, expected: Doubles) -> None:
    """Assert that no more values lie beyond three standard errors than chance explains, and none beyond twelve."""
    error = np.abs(measured.value - expected)[:, 0]
    allowed = 3 * measured.standard_error[:, 0] + 3e-6 * np.abs(expected).max()
    assert np.count_nonzero(error > allowed) <= binom.isf(1e-6, len(error), BEYOND)
    assert (error <= 4 * allowed).all()


def quad(corner: Doubles, e1: Doubles, e2: Doubles, color: Color = (0, 0, 0), emission: Color = (0, 0, 0)) -> clrt.Mesh:
    """Return a parallelogram whose front is on the side of e1 x e2."""
    corners = np.array([corner, corner + e1, corner + e1 + e2, corner + e2], np.float32)
    material = clrt.Diffuse(color=color, emission=emission)
    return clrt.Mesh(vertices=corners, faces=np.array([[0, 1, 2], [0, 2, 3]], np.int32), material=material)


def lambert(points: Doubles, normals: Doubles, corners: Doubles) -> Doubles:
    """Return the irradiance (n,) at points under a polygon (k, 3) of unit radiance above their horizons (Lambert 1760;
    Baum et al. 1989, eq. 6)."""
    total = np.zeros(len(points))
    for a, b in zip(corners, np.roll(corners, -1, axis=0)):
        ra, rb = (each / np.linalg.norm(each, axis=1)[:, None] for each in (a - points, b - points))
        edge = np.cross(ra, rb)
        angle = np.arctan2(np.linalg.norm(edge, axis=1), (ra * rb).sum(axis=1))
        total += angle * (edge * normals).sum(axis=1) / np.linalg.norm(edge, axis=1)
    return np.abs(total) / 2


def test_under_a_panel_irradiance_is_lamberts(device: Device) -> None:
    """A thousand points and tilted normals, under a panel that is large for some and small for others."""
    random = np.random.default_rng(todays_seed())
    corner, e1, e2 = np.array([-0.5, 2.0, -0.5]), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    points = random.uniform(-3, 3, (1000, 3)) * [1, 0, 1] + [0, 1, 0] * random.uniform(-3, 1.5, (1000, 1))
    corners = np.array([corner, corner + e1, corner + e1 + e2, corner + e2])
    normals = np.mean(corners, axis=0) - points
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    for _ in range(100):  # tilted, and with the whole panel above the horizon
        tilted = normals + random.normal(0, 0.1, normals.shape)
        tilted /= np.linalg.norm(tilted, axis=1)[:, None]
        above = ((corners[None] - points[:, None]) * tilted[:, None]).sum(axis=2).min(axis=1) > 1e-3
        normals[above] = tilted[above]
    scene = clrt.Scene(meshes=[quad(corner, e1, e2, emission=(2, 2, 2))], environment=BLACK)
    measured = clrt.irradiance(scene, points, normals, spp=256, device=device.info.index)
    check_within_three_standard_errors(measured, 2 * lambert(points, normals, corners)[:, None].repeat(3, 1))


@pytest.mark.parametrize("sampler", ["sobol", *others(*(name for name in get_args(Sampler) if name != "sobol"))])
def test_standard_errors_are_those_of_repetitions(device: Device, sampler: Sampler) -> None:
    """For samples that depend on each other, too."""
    random = np.random.default_rng(todays_seed())
    scene = clrt.Scene(
        spheres=[clrt.Sphere(center=(0, 3, 0), radius=1, material=clrt.Diffuse(color=(0.5,) * 3, emission=(1,) * 3))],
        environment=clrt.Environment(color=(0.2, 0.2, 0.2)),
    )
    places = random.uniform(-2, 2, (40, 3)) * [1, 0, 1]
    runs = [
        clrt.irradiance(scene, places, (0, 1, 0), spp=64, seed=seed, sampler=sampler, device=device.info.index)
        for seed in range(30)
    ]
    spread = np.std([run.value[:, 0] for run in runs], axis=0, ddof=1)
    claimed = np.sqrt(np.mean([run.standard_error[:, 0] ** 2 for run in runs], axis=0))
    assert np.sqrt(np.mean(claimed**2 / spread**2)) == pytest.approx(1, abs=0.15)


def test_lights_without_size_and_skies(device: Device) -> None:
    options = SensorOptions(spp=16, device=device.info.index)
    sky = clrt.Scene(environment=clrt.Environment(color=(1, 2, 3)))
    received = clrt.irradiance(sky, (1, 2, 3), (0, 3, 4), **options).value
    np.testing.assert_allclose(received, np.pi * np.array([[1, 2, 3]]), rtol=1e-6)
    bulb = clrt.PointLight(position=(0, 2, 0), intensity=(1, 1, 1))
    lit = clrt.Scene(lights=[bulb], environment=BLACK)
    measured = clrt.irradiance(lit, [[0, 0, 0], [1, 0, 0], [0, 4, 0]], (0, 1, 0), **options)
    np.testing.assert_allclose(measured.value[:, 0], [1 / 4, 2 / 5**1.5, 0], rtol=1e-6)
    assert not measured.standard_error.any()
    seen = clrt.radiance(sky, (0, 0, 0), [[0, 0, 1], [0, -5, 0]], **options)
    np.testing.assert_allclose(seen.value, [[1, 2, 3]] * 2, rtol=1e-6)


@pytest.mark.parametrize("scale, shift", [(1, 0), (1e-6, 0), (1e6, 0), (1, 1e5)])
def test_a_closed_room_that_glows(device: Device, scale: float, shift: float) -> None:
    """Of albedo ρ and emission e, the radiance is e / (1 − ρ) everywhere, in rooms of any size, anywhere."""
    low, high = np.full(3, shift - scale), np.full(3, shift + scale)
    faces = []
    for axis in range(3):
        e1, e2 = np.zeros(3), np.zeros(3)
        e1[(axis + 1) % 3] = e2[(axis + 2) % 3] = 2 * scale
        faces += [(low, e1, e2), (high, -e2, -e1)]
    room = clrt.Scene(
        meshes=[quad(*face, color=(0.5, 0.5, 0.5), emission=(1, 1, 1)) for face in faces], environment=BLACK
    )
    random = np.random.default_rng(todays_seed())
    points, normals = random.uniform(-1, 1, (64, 3)), np.zeros((64, 3))
    rows, walls = np.arange(64), random.integers(3, size=64)
    points[rows, walls] = random.choice([-1.0, 1.0], 64)
    normals[rows, walls] = -points[rows, walls]
    points = points * scale + shift
    measured = clrt.irradiance(room, points, normals, spp=256, max_depth=24, device=device.info.index)
    check_within_three_standard_errors(measured, np.full((64, 3), 2 * math.pi))
    inside = np.full((8, 3), float(shift))
    seen = clrt.radiance(room, inside, random.normal(size=(8, 3)), spp=256, max_depth=24, device=device.info.index)
    check_within_three_standard_errors(seen, np.full((8, 3), 2.0))


def is_matte(mesh: clrt.Mesh) -> bool:
    """Return whether the mesh is Lambertian of one color, and no light."""
    material = mesh.material
    return isinstance(material, clrt.Diffuse) and isinstance(material.color, tuple) and material.emission == (0, 0, 0)


@pytest.mark.programs
@pytest.mark.parametrize("name", ["cornell", *others("spot", "night")])
def test_lambertian_surfaces_reflect_their_irradiance(device: Device, name: str) -> None:
    """L = ρ E / π at the points of matte surfaces that rays from the camera hit."""
    scene = clrt.load(SCENES / f"{name}.toml")
    firsts = np.cumsum([0, *(len(mesh.vertices) for mesh in scene.meshes)])
    query = clrt.RayQuery(
        np.concatenate([mesh.vertices for mesh in scene.meshes]),
        np.concatenate([mesh.faces + first for mesh, first in zip(scene.meshes, firsts)]),
        device=device.info.index,
    )
    of_face = [mesh for mesh in scene.meshes for _ in mesh.faces]
    corners = np.concatenate([mesh.vertices[mesh.faces] for mesh in scene.meshes]).astype(np.float64)
    random = np.random.default_rng(todays_seed())
    eye = np.array(scene.camera.position)
    directions = np.subtract(scene.camera.look_at, eye) + random.normal(0, 0.3, (256, 3)) * np.linalg.norm(eye) / 4
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    hits = query.closest_hit(np.broadcast_to(eye, directions.shape), directions)
    rows = np.array([row for row, face in enumerate(hits["primitive"]) if face >= 0 and is_matte(of_face[face])])
    assert len(rows) > 20
    face, ways = corners[hits["primitive"][rows]], directions[rows]
    normals = np.cross(face[:, 1] - face[:, 0], face[:, 2] - face[:, 0])
    normals *= -np.sign((normals * ways).sum(axis=1))[:, None]
    u, v = hits["u"][rows, None], hits["v"][rows, None]
    points = (1 - u - v) * face[:, 0] + u * face[:, 1] + v * face[:, 2]
    colors = np.array([vars(of_face[face].material)["color"] for face in hits["primitive"][rows]])
    options = SensorOptions(spp=1024, device=device.info.index)
    received = clrt.irradiance(scene, points, normals, **options)
    seen = clrt.radiance(scene, eye, ways, **options)
    error = np.hypot(received.standard_error * colors / math.pi, seen.standard_error)
    z = (received.value * colors / math.pi - seen.value) / np.maximum(error, 3e-6 * seen.value.max())
    assert np.sqrt((z[:, 0] ** 2).mean()) < 1.5 and np.abs(z[:, 0]).max() < 6


def test_a_daylight_factor_by_hand(device: Device) -> None:
    """A vertical window, 3 m wide and 1.5 m high, its sill at the height of the point 3 m in front of its middle, under
    a uniform sky: SC = (atan(b/d) − cos φ atan(b cos φ/d)) / π with φ = atan(h/d) and b half the width; Hopkinson,
    Petherbridge and Longmore 1966, "Daylighting". By hand: b/d = .5, tan φ = .5, cos φ = .89443, atan .5 = .46365,
    atan .44721 = .42053; SC = (.46365 − .37614) / π = 2.785 %."""
    far = 50.0
    across, up, deep = np.array([2 * far, 0, 0]), np.array([0, far, 0]), np.array([0, 0, far])
    wall = [
        quad(np.array([-far, 0, -3.0]), np.array([far - 1.5, 0, 0]), up),
        quad(np.array([1.5, 0, -3.0]), np.array([far - 1.5, 0, 0]), up),
        quad(np.array([-1.5, 1.5, -3.0]), np.array([3.0, 0, 0]), up),
    ]
    roof = quad(np.array([-far, 3.0, -3.0]), across, deep)
    back = quad(np.array([-far, 0, 10.0]), across, up)
    sides = [quad(np.array([x, 0, -3.0]), up, deep) for x in (-10.0, 10.0)]
    sky = clrt.Environment(color=(1, 1, 1))
    room = clrt.Scene(meshes=[*wall, roof, back, *sides], environment=sky)
    inside = clrt.irradiance(room, (0, 0, 0), (0, 1, 0), spp=1 << 16, device=device.info.index)
    outside = clrt.irradiance(clrt.Scene(environment=sky), (0, 0, 0), (0, 1, 0), spp=16, device=device.info.index)
    factor, error = inside.value[0, 0] / outside.value[0, 0], inside.standard_error[0, 0] / outside.value[0, 0]
    by_hand = (math.atan(0.5) - math.cos(math.atan(0.5)) * math.atan(0.5 * math.cos(math.atan(0.5)))) / math.pi
    assert by_hand == pytest.approx(0.02785, abs=1e-4)
    assert error < 2e-4 and factor == pytest.approx(by_hand, abs=4 * error)


def test_ambient_occlusion_by_a_wall(device: Device) -> None:
    """A wall of height h at distance d hides (1 − d/√(d² + h²))/2 of the sky. Directions within a distance r of an
    endless wall have a cosine above c = d/r with its normal: half the disc's segment beyond c, as they end above the
    floor, (acos c − c √(1 − c²)) / π of the disc's area, all of which lies above it."""
    random = np.random.default_rng(todays_seed())
    far, high = 1e4, 3.0
    base, along = np.array([1.0, 0, -far]), np.array([0, 0, 2 * far])
    points, up = random.uniform(-4, 0.9, (500, 3)) * [1, 0, 1], (0, 1, 0)
    away = 1 - points[:, 0]
    points[(away > 2.2) & (away < 2.5), 0] = 0  # too little of the wall for 256 samples to hit
    away = 1 - points[:, 0]
    options = SensorOptions(spp=256, device=device.info.index)
    low = clrt.Scene(meshes=[quad(base, along, np.array([0, high, 0]))], environment=BLACK)
    seen = clrt.ambient_occlusion(low, points, up, **options)
    expected = 1 - (1 - away / np.hypot(away, high)) / 2
    check_within_three_standard_errors(Measurement(*(each[:, None] for each in seen)), expected[:, None])
    endless = clrt.Scene(meshes=[quad(base, along, np.array([0, far, 0]))], environment=BLACK)
    near = clrt.ambient_occlusion(endless, points, up, distance=2.5, **options)
    c = np.minimum(away / 2.5, 1)
    expected = 1 - (np.arccos(c) - c * np.sqrt(1 - c**2)) / np.pi
    check_within_three_standard_errors(Measurement(*(each[:, None] for each in near)), expected[:, None])
    assert (near.value[away > 2.5] == 1).all() and not near.standard_error[away > 2.5].any()


@pytest.mark.parametrize("scale", [1e-6, 1, 1e6])
def test_ambient_occlusion_under_a_disc(device: Device, scale: float) -> None:
    """A parallel disc of radius r at height h hides r²/(r² + h²), in scenes of any size; with half an alpha, half."""
    angles = np.linspace(0, 2 * np.pi, 4097)[:-1]
    rim = np.stack([np.cos(angles), np.zeros_like(angles), np.sin(angles)], axis=1)
    vertices = (np.concatenate([[[0, 0, 0]], rim]) * 1.5 + [0, 2, 0]) * scale
    number = np.arange(1, 4097)
    faces = np.stack([np.zeros_like(number), number, np.roll(number, -1)], axis=1)
    hidden = 1.5**2 / (1.5**2 + 2**2)
    for opacity in (1.0, 0.5):
        disc = clrt.Mesh(
            vertices=vertices.astype(np.float32), faces=faces.astype(np.int32), material=clrt.Diffuse(opacity=opacity)
        )
        scene = clrt.Scene(meshes=[disc], environment=BLACK)
        for distance, part in ((None, hidden), (1.9 * scale, 0.0), (3 * scale, hidden)):
            seen = clrt.ambient_occlusion(
                scene, (0, 0, 0), (0, 1, 0), distance=distance, spp=1 << 14, device=device.info.index
            )
            limit = 6 * seen.standard_error[0] + 1e-5
            assert limit < 0.02 and seen.value[0] == pytest.approx(1 - opacity * part, abs=limit)


@pytest.mark.parametrize("height", [-3.0, 3.0])
def test_a_ground_at_any_height_hides_half_of_the_sky(device: Device, height: float) -> None:
    """Also that of a bare model, which is a plane to a point right above it, facing down and to the side."""
    scene = clrt.Scene(environment=clrt.Environment(color=(1, 1, 1)), ground=clrt.Ground(height=height, radius=1e4))
    points, normals = np.full((2, 3), (0, height + 0.1, 0)), [(0, -1, 0), (1, 0, 0)]
    measured = clrt.irradiance(scene, points, normals, spp=256, device=device.info.index)
    # Half of the light that meets a floor of albedo one half comes back.
    np.testing.assert_allclose(measured.value[:, 0] / np.pi, [0.5, 0.75], rtol=0.02)
    occlusion = clrt.ambient_occlusion(scene, points, normals, spp=256, device=device.info.index)
    np.testing.assert_allclose(occlusion.value, [0, 0.5], atol=0.02)


@pytest.mark.programs
def test_moving_lights_are_measured_over_the_exposure(device: Device) -> None:
    corner, e1, e2 = np.array([-0.5, 3.0, -0.5]), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    end = np.eye(3, 4)
    end[0, 3] = 20
    panel = clrt.Instance(quad(corner, e1, e2, emission=(10, 10, 10)), to_world_end=end)
    scene = clrt.Scene(instances=[panel], environment=BLACK, camera=clrt.Camera(shutter=(0, 1)))
    points, normals = np.array([(0.0, 0.0, 0.0), (9.0, 0.5, 1.0)]), np.array([(0.0, 1.0, 0.0)] * 2)
    corners = np.array([corner, corner + e1, corner + e1 + e2, corner + e2])
    moments = (np.arange(2000) + 0.5) / 2000
    expected = 10 * np.mean([lambert(points, normals, corners + [20 * s, 0, 0]) for s in moments], axis=0)
    measured = clrt.irradiance(scene, points, normals, spp=65536, device=device.info.index)
    np.testing.assert_allclose(measured.value[:, 0], expected, rtol=0.02)


def test_arrays_that_are_no_rays(device: Device) -> None:
    scene = clrt.Scene(environment=BLACK)
    assert clrt.radiance(scene, np.zeros((0, 3)), np.zeros((0, 3))).value.shape == (0, 3)
    with pytest.raises(UsageError, match=r"points\[1\] is \[0\.0, 0\.0, 0\.0\], and normals\[1\] \[0\.0, 0\.0, 0\.0\]"):
        clrt.irradiance(scene, np.zeros((2, 3)), np.array([[0, 1.0, 0], [0, 0, 0]]))
    with pytest.raises(UsageError, match="origins"):
        clrt.radiance(scene, np.zeros((2, 2)), (0, 0, 1))
    with pytest.raises(UsageError, match="finite"):
        clrt.radiance(scene, (0, 0, math.nan), (0, 0, 1))
    with pytest.raises(UsageError, match="distance is 0; give a finite number above 0"):
        clrt.ambient_occlusion(scene, (0, 0, 0), (0, 0, 1), distance=0)


def test_what_is_composited_is_not_measured(device: Device) -> None:
    """Transparent images, backdrops, catchers and hidden environments leave the light as it is, to the last bit."""
    ground = quad(np.array([-5.0, 0.0, 5.0]), np.array([10.0, 0.0, 0.0]), np.array([0.0, 0.0, -10.0]), (0.5, 0.6, 0.7))
    plain = clrt.Scene(meshes=[ground], environment=clrt.Environment(color=(0.2, 0.4, 0.6)))
    material = replace(ground.material, catcher=True)
    composited = clrt.Scene(
        meshes=[replace(ground, material=material)],
        environment=clrt.Environment(color=(0.2, 0.4, 0.6), camera_visible=False),
        backdrop=clrt.Backdrop(color=(9.0, 9.0, 9.0)),
        render=clrt.RenderSettings(transparent=True),
    )
    rays = [(0.3, 1.0, 0.2), (0.1, 1.0, 0.0)], [(0.0, -1.0, 0.1), (0.2, 1.0, 0.0)]
    for measure in (clrt.radiance, clrt.irradiance):
        expected, found = (measure(scene, *rays, spp=64, device=device.info.index) for scene in (plain, composited))
        assert expected.value.min() > 0.05
        np.testing.assert_array_equal(found.value, expected.value)
