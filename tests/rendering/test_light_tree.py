"""Light selection among few, many and infinite lights (the resulting images: test_many_lights.py)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.kernel_probe import Probe, choices
from clrt.bench.numerics.cases.subject import unit_vectors
from clrt.bench.significance import chi2_test, sidak
from clrt.device.open import Device
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.scene.lights import PointLight
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Mesh, Scene, Sphere

from .lamps import lamps, point_lights, with_infinite
from .test_lights import points_and_normals

pytestmark = pytest.mark.statistics

Doubles = NDArray[np.float64]
COUNT, FAMILY = 1 << 17, 1e-3
UP = np.array([0.0, 1.0, 0.0])


def coincident() -> Scene:
    return Scene(lights=[*point_lights(np.full((100, 3), 0.25)), *point_lights(np.zeros((100, 3)), 3.0)])


SCENES = {
    "two": lamps(2),
    "few": lamps(32),
    "a tree": lamps(33),
    "many": lamps(1000),
    "coincident": coincident(),
    "suns and sky": with_infinite(Scene()),
    "lamp and infinite": with_infinite(lamps(1)),
    "few and infinite": with_infinite(lamps(20)),
    "many and infinite": with_infinite(lamps(300)),
}


def probabilities(probe: Probe, point: Doubles, normal: Doubles) -> Doubles:
    """Return the selection probability of each light at a point."""
    count = int(probe.compiled.counts["lights"][0])
    return probe("light_probability", 1, np.tile(np.append(point, normal), (count, 1)), np.arange(count))[:, 0]


@pytest.fixture(scope="module", params=SCENES)
def probe(device: Device, request: pytest.FixtureRequest) -> Probe:
    return Probe(device, SCENES[request.param])


def test_probabilities_add_up(probe: Probe) -> None:
    """They sum to 1 at any point and normal, mostly inside the light BVH's bounds, also at a light's position."""
    points, normals = points_and_normals(30)
    points[0], points[1], points[2] = 0.0, 1e6, 0.25
    sums = [probabilities(probe, point, normal).sum() for point, normal in zip(points, normals)]
    np.testing.assert_allclose(sums, 1, atol=2e-6)


def test_choices_follow_the_probabilities(probe: Probe) -> None:
    """Chi-square over the lights; each choice reports its probability, and leaves a uniform random number."""
    p_values = []
    for seed, (point, normal) in enumerate(zip(*points_and_normals(3))):
        out = probe("pick_light", 3, np.tile(np.append(point, normal), (COUNT, 1)), seed=seed)
        light, mass = out[:, 0].astype(int), probabilities(probe, point, normal)
        np.testing.assert_allclose(out[:, 1], mass[light], rtol=1e-5)
        if np.sum(mass * COUNT > 5) > 1:
            p_values.append(chi2_test(np.bincount(light, minlength=len(mass)), mass / mass.sum() * COUNT))
        assert np.all((out[:, 2] >= 0) & (out[:, 2] < 1))
        p_values.append(chi2_test(np.histogram(out[:, 2], 64, (0, 1))[0], np.full(64, COUNT / 64)))
    assert min(p_values) > sidak(FAMILY, len(p_values))


@pytest.mark.parametrize("lanes", [1, 16])
def test_choices_do_not_depend_on_lanes(device: Device, lanes: int) -> None:
    """SIMD widths agree except for rounding, which changes one of about 2^15 choices."""
    points, normals = points_and_normals(1 << 14)
    scene = SCENES["many and infinite"]
    found, expected = (Probe(device, scene, lanes=n)("pick_light", 3, points, normals, seed=1) for n in (lanes, 8))
    same = found[:, 0] == expected[:, 0]
    assert np.mean(same) > 0.999
    np.testing.assert_allclose(found[same, 1], expected[same, 1], rtol=1e-4)


@pytest.mark.parametrize("count", [20, 500])
def test_no_light_that_can_be_seen_is_left_out(device: Device, count: int) -> None:
    """Every light whose centre is above the horizon, and that faces the point, has a positive probability."""
    scene = lamps(count)
    probe = Probe(device, scene)
    corners = np.array([mesh.vertices for mesh in scene.meshes]).reshape(-1, 3, 3).astype(np.float64)
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    middles = np.concatenate(
        [
            corners.mean(axis=1),
            [s.center for s in scene.spheres],
            [light.position for light in scene.lights if isinstance(light, PointLight)],
        ]
    )
    left = 0
    for point, normal in zip(*points_and_normals(50)):
        to_light = middles - point
        seen = to_light @ normal > 1e-5
        seen[: len(facing)] &= np.sum(to_light[: len(facing)] * facing, axis=1) < -1e-9
        mass = probabilities(probe, point, normal)
        assert np.all(mass[seen] > 0)
        left += int(np.sum(mass == 0))
    assert left > 0.1 * count * 50  # about half are below the horizon


def test_balls_bring_nothing_to_their_own_surface(device: Device) -> None:
    """For any rounding of the point; if the normal is tilted by a tenth, a part of the sphere is above the horizon."""
    rng = np.random.default_rng(5)
    centers, radii, shining = rng.normal(size=(20, 3)), 10 ** rng.uniform(-2, 0, 20), Diffuse(emission=(1.0, 1.0, 1.0))
    probe = Probe(
        device,
        Scene(
            spheres=[
                Sphere(center=(x, y, z), radius=radius, material=shining)
                for (x, y, z), radius in zip(centers.tolist(), radii.tolist())
            ]
        ),
    )
    own = np.arange(1, 20).repeat(100)  # not the first light, which is chosen if none contributes
    normals = unit_vectors(rng, len(own))
    points = probe.compiled.frame.points(centers[own] + radii[own, None] * normals)
    aside = normals + 0.1 * np.cross(normals, unit_vectors(rng, len(own)))
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    assert not np.any(probe("light_probability", 1, points, normals, own))
    assert np.mean(probe("light_probability", 1, points, aside, own) > 0) > 0.98


def test_few_lights_are_chosen_by_what_they_bring(device: Device) -> None:
    """Point lights: 4/5 of the probability by intensity·cos θ/d², 1/5 uniform over those above the horizon."""
    rng = np.random.default_rng(1)
    places, powers = rng.normal(size=(30, 3)), 10 ** rng.uniform(-1, 1, 30)
    probe = Probe(device, Scene(lights=[light for p, i in zip(places, powers) for light in point_lights(p[None], i)]))
    for point, normal in zip(*points_and_normals(20)):
        d = places - point
        brought = np.maximum(powers * (d @ normal) / np.linalg.norm(d, axis=1) ** 3, 0)
        expected = 0.8 * brought / brought.sum() + 0.2 * (brought > 0) / np.sum(brought > 0)
        np.testing.assert_allclose(probabilities(probe, point, normal), expected, rtol=2e-5, atol=1e-7)


def test_a_tree_is_nearly_as_good(device: Device) -> None:
    """Choosing among 2000 equal point lights by exact contribution has zero variance; the light BVH's relative
    variance is below 1, and that of a uniform choice is above 10.
    """
    places = np.random.default_rng(2).uniform((-10, 0.1, -10), (10, 2, 10), (2000, 3))
    probe = Probe(device, Scene(lights=point_lights(places)))
    chosen, even = [], []
    for x, z in np.random.default_rng(3).uniform(-9, 9, (20, 2)):
        d = places - [x, 0.0, z]
        brought = d[:, 1] / np.linalg.norm(d, axis=1) ** 3
        mass = probabilities(probe, np.array([x, 0.0, z]), UP)
        chosen.append(np.sum(brought**2 / mass) / brought.sum() ** 2 - 1)
        even.append(np.sum(brought**2) * len(brought) / brought.sum() ** 2 - 1)
    assert np.mean(chosen) < 1 < 10 < np.mean(even)


def test_black_lights_are_left_out(device: Device) -> None:
    """Lights without power or area are dropped and do not affect the others."""
    lit, dark = lamps(50), Diffuse(emission=(0.0, 0.0, 0.0))
    flat = Mesh(np.zeros((3, 3), np.float32), np.array([[0, 1, 2]], np.int32), Diffuse(emission=(9.0, 9.0, 9.0)))
    zeros = replace(
        lit,
        meshes=[flat, *lit.meshes, flat],
        spheres=[Sphere(radius=0.1, material=dark), *lit.spheres],
        lights=[*point_lights(np.zeros((2, 3)), 0.0), *lit.lights],
    )
    probes = Probe(device, lit), Probe(device, zeros)
    point, normal = np.array([0.1, 0.2, 0.3]), UP
    with_black, without = (probabilities(probe, point, normal) for probe in probes)
    np.testing.assert_array_equal(with_black, without)
    assert probes[0].compiled.counts[0]["lights"] == probes[1].compiled.counts[0]["lights"] == 50
    nothing = compile_scene(Scene(meshes=[flat], lights=point_lights(np.zeros((1, 3)), 0.0)), choices(device))
    assert "LIGHTS" not in nothing.features


@pytest.mark.parametrize("power", [1e-30, 1e30])
def test_powers_of_any_unit(device: Device, power: float) -> None:
    places = np.random.default_rng(1).normal(size=(60, 3))
    scenes = [Scene(lights=[*point_lights(places[:30], p), *point_lights(places[30:], 2 * p)]) for p in (1.0, power)]
    found = [probabilities(Probe(device, scene), np.array([0.0, -1.0, 0.0]), UP) for scene in scenes]
    np.testing.assert_allclose(found[0], found[1], rtol=1e-5)


def test_a_hundred_thousand_triangles(device: Device) -> None:
    """A closed emitter of 10^5 triangles: those facing the point have positive probability, the others little; sum
    1."""
    side = 224
    v, u = np.meshgrid(np.linspace(0, np.pi, side + 1), np.linspace(0, 2 * np.pi, side + 1), indexing="ij")
    sphere = np.stack([np.sin(v) * np.sin(u), np.cos(v), np.sin(v) * np.cos(u)], axis=-1).reshape(-1, 3)
    a = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
    b = a + side + 1
    faces = np.concatenate([np.stack([a, b, a + 1], axis=1), np.stack([a + 1, b, b + 1], axis=1)]).astype(np.int32)
    lamp = Mesh(sphere.astype(np.float32), faces, Diffuse(emission=(1.0, 1.0, 1.0)))
    probe = Probe(device, Scene(meshes=[lamp]))
    point = np.array([0.0, -3.0, 0.0])
    mass = probabilities(probe, point, UP)
    assert len(mass) > 99_000
    assert abs(mass.sum() - 1) < 1e-5
    records = probe.compiled.buffers["triangle_lights"][1]
    to_point = point - records["p0"]
    facing = np.sum(to_point * records["normal"], axis=1) / np.linalg.norm(to_point, axis=1)
    assert np.all(mass[facing > 1e-3] > 0) and mass[facing < -0.05].sum() < 0.2


def test_only_what_is_needed_is_compiled(device: Device) -> None:
    """One light compiles no selection code and no table; a few compile no light BVH."""
    files = {count: compile_scene(lamps(count), choices(device)) for count in (1, 2, 32, 33)}
    for count, compiled in files.items():
        assert ("light/choice.cl" in compiled.files) == ("light_groups" in compiled.buffers) == (count > 1)
        assert ("light/tree.cl" in compiled.files) == ("light_places" in compiled.buffers) == (count > 32)
        assert ("light/only.cl" in compiled.files) == (count == 1)
