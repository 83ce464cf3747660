"""Traversal of every BVH layout: no cracks, the hits of brute force in float64, and consistent tie-breaking."""

from __future__ import annotations

import subprocess
import sys
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.kernel_probe import Probe
from clrt.device.open import Device
from clrt.scene.model import Mesh, Scene, Sphere

from ..accel.cases import soup, spheres
from ..covering import covering, others
from . import rays

Doubles = NDArray[np.float64]
HOUSE = Path(__file__).parents[2]
LAYOUTS = ("bvh8", "bvh2", "cwbvh", "packs", "list")
TREES = tuple(product(("bvh8", "bvh2", "cwbvh"), ("sah", "midpoint")))


def mesh(corners: NDArray[np.float32]) -> Mesh:
    """Return a mesh of triangles (m, 3, 3) without shared vertices."""
    return Mesh(corners.reshape(-1, 3), np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3))


def balls(table: NDArray[np.float32]) -> list[Sphere]:
    return [Sphere(center=(x, y, z), radius=r) for x, y, z, r in table.astype(np.float64).tolist()]


def random_rays(count: int, seed: int) -> tuple[Doubles, Doubles]:
    """Return rays from around and inside the unit cube towards points in it, exact in float32 and not normalized."""
    rng = np.random.default_rng(seed)
    origin, target = rng.uniform(-1, 2, (count, 3)), rng.random((count, 3))
    return (origin.astype(np.float32).astype(np.float64), (target - origin).astype(np.float32).astype(np.float64))


closed_sphere = cache(rays.icosphere)


@pytest.mark.parametrize(
    ("layout", "offset", "subdivisions"),
    [
        ("bvh8", 0.0, 4),
        ("bvh2", 1000.0, 4),
        ("cwbvh", 0.0, 4),
        *others(*product(("bvh8", "bvh2", "cwbvh"), (0.0, 1000.0), (6,))),
    ],
)
def test_closed_mesh_has_no_cracks(device: Device, layout: str, offset: float, subdivisions: int) -> None:
    """From inside up to 81 920 triangles towards their vertices, edges and faces: none of up to 10^6 rays escapes."""
    vertices, faces = closed_sphere(subdivisions)
    vertices = vertices + np.float32(offset)
    rng = np.random.default_rng(0)
    corners = vertices[faces].astype(np.float64)
    edges = np.concatenate([(corners[:, i] + corners[:, i - 1]) / 2 for i in range(3)])
    some, b = rng.integers(len(faces), size=5 * len(faces)), rng.dirichlet([1, 1, 1], 5 * len(faces))
    anywhere = np.einsum("nij,ni->nj", corners[some], b)
    target = np.concatenate([np.repeat(vertices, 9, axis=0), edges, anywhere])
    origin = (offset + rng.uniform(-0.5, 0.5, target.shape)).astype(np.float32)
    assert len(target) > 12 * len(faces)
    probe = Probe(device, Scene(meshes=[Mesh(vertices, faces)]), layout=layout)
    found = probe("closest_hit", 4, probe.compiled.frame.points(origin), target - origin)
    assert np.count_nonzero(found[:, 3] < 0) == 0
    assert np.abs(found[:, 0] - 1).max() < 0.01 + offset * 1e-6  # A facet is flatter than the sphere by 1e-4


@pytest.mark.parametrize(("layout", "builder"), [*TREES, ("packs", "sah"), ("list", "sah")])
def test_triangles_as_in_float64(device: Device, layout: str, builder: str) -> None:
    """2000 rays against 600 triangles: hits, t, u and v, wherever float32 can decide."""
    corners = np.concatenate([soup(300, 0.3, seed=1), soup(300, 0.05, seed=2)])
    origin, direction = random_rays(2000, 3)
    t, which, margin = rays.hit_triangles(corners.astype(np.float64), origin, direction)
    clear = margin > 1e-4
    assert np.count_nonzero(clear & np.isfinite(t)) > 1000 and np.mean(clear) > 0.95
    probe = Probe(device, Scene(meshes=[mesh(corners)]), layout=layout, builder=builder)
    found = probe("closest_hit", 4, origin, direction)
    np.testing.assert_array_equal(found[clear, 3], np.where(np.isfinite(t), which, -1)[clear])
    hit = clear & np.isfinite(t)
    p0, p1, p2 = corners[which[hit]].astype(np.float64).transpose(1, 0, 2)
    u, v = found[hit, 1, None], found[hit, 2, None]
    there = origin[hit] + t[hit, None] * direction[hit]
    np.testing.assert_allclose(p0 + u * (p1 - p0) + v * (p2 - p0), there, atol=2e-6)
    np.testing.assert_allclose(found[hit, 0], t[hit], rtol=2e-5)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_spheres_as_in_float64(device: Device, layout: str) -> None:
    """From inside and outside, tiny and huge; t within some ulps of what the position's own rounding allows."""
    special = [[0.5, 0.5, 0.5, 0.9], [0.5, -1000.0, 0.5, 999.5], [0.2, 0.2, 3.0, 1e-4]]
    table = np.concatenate([spheres(60, seed=4), special]).astype(np.float32)
    origin, direction = random_rays(20_000, 5)
    t, which, margin = rays.hit_spheres(table.astype(np.float64), origin, direction)
    clear = margin > 1e-3
    assert np.count_nonzero(clear & np.isfinite(t)) > 10_000
    far = Mesh(soup(1).reshape(-1, 3) + np.float32(1e4), np.array([[0, 1, 2]], np.int32))  # for any-hit's program
    found = Probe(device, Scene(meshes=[far], spheres=balls(table)), layout=layout)("closest_hit", 4, origin, direction)
    np.testing.assert_array_equal(found[clear, 3], np.where(np.isfinite(t), 1 + which, -1)[clear])
    hit = clear & np.isfinite(t)
    there = origin[hit] + found[hit, :1] * direction[hit]
    # Distance from the surface, with the rounding of origin − centre and of the root, which grazing rays amplify.
    off = np.abs(np.linalg.norm(there - table[which[hit], :3], axis=1) - table[which[hit], 3])
    size = np.linalg.norm(origin[hit] - table[which[hit], :3], axis=1) + table[which[hit], 3]
    assert (off / size).max() < 1e-6


@pytest.mark.parametrize("kind", ["edges", "duplicates", *others("mixed")])
def test_ties_are_broken_alike(device: Device, kind: str) -> None:
    """Layouts and builders find the same primitive at the same t; among equal ones the first."""
    if kind == "edges":
        vertices, faces = rays.icosphere(3)
        scene, target = Scene(meshes=[Mesh(vertices, faces)]), np.repeat(vertices, 30, axis=0).astype(np.float64)
        direction = target - np.random.default_rng(1).uniform(-0.5, 0.5, target.shape).astype(np.float32)
        origin = target - direction
    else:
        triangles = np.repeat(soup(40, 0.5), 64, axis=0)
        repeated = balls(np.repeat(spheres(10), 8, axis=0))
        scene = Scene(meshes=[mesh(triangles)], spheres=repeated if kind == "mixed" else [])
        origin, direction = random_rays(20_000, 6)
    found = {
        tree: Probe(device, scene, layout=tree[0], builder=tree[1])("closest_hit", 4, origin, direction)
        for tree in (*TREES, ("packs", "sah"), ("list", "sah"))
    }
    reference = found.pop(("list", "sah"))
    for tree, hits in found.items():
        differ = np.any(hits != reference, axis=1)
        assert np.count_nonzero(differ) == 0, (tree, hits[differ][:3], reference[differ][:3])
    if kind == "duplicates":
        hit = reference[:, 3] >= 0
        assert hit.any() and np.all(reference[hit, 3] % 64 == 0)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_flat_grid_along_the_axes(device: Device, layout: str) -> None:
    """Straight down, with zeros of both signs, onto 1250 coplanar triangles: corners, edges, faces, the border."""
    vertices, faces = rays.grid(25)
    x, z = np.meshgrid(np.arange(0, 25.25, 0.25), np.arange(0, 25.25, 0.25))
    origin = np.column_stack([x.ravel(), np.full(x.size, 3.0), z.ravel()])
    scene = Scene(meshes=[Mesh(vertices, faces)])
    probe, no_tree = Probe(device, scene, layout=layout), Probe(device, scene, layout="list")
    lost, other = [], []
    for zero, side in product((0.0, -0.0), (1.0, -1.0)):
        down = np.tile([zero, -2 * side, zero], (len(origin), 1))
        found = probe("closest_hit", 4, origin * [1, side, 1], down)
        listed = no_tree("closest_hit", 4, origin * [1, side, 1], down)
        lost.append(np.count_nonzero(found[:, 0] != 1.5))
        other.append(np.count_nonzero(found[:, 3] != listed[:, 3]))
    assert not any(lost + other), (lost, other)  # of 10 201 each
    # In the plane itself, along an axis or across: neither a hit nor a hang.
    inside = origin * [1, 0, 1]
    for along in ([1.0, 0.0, 0.0], [0.0, -0.0, -1.0], [0.6, 0.0, 0.8]):
        assert np.all(probe("closest_hit", 4, inside, np.tile(along, (len(inside), 1)))[:, 3] == -1)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_axis_parallel_rays_from_box_planes(device: Device, layout: str) -> None:
    """Stacked unit squares with BVH bounds at integers; rays start on those planes and run along axes."""
    vertices, faces = rays.grid(8)
    levels = [Mesh(vertices + np.array([0, y, 0], np.float32), faces) for y in range(8)]
    standing = [Mesh(np.roll(vertices, 1, axis=1) + np.array([0, 0, z], np.float32), faces) for z in range(9)]
    probe = Probe(device, Scene(meshes=[*levels, *standing]), layout=layout)
    x, z = (grid.ravel().astype(float) for grid in np.meshgrid(np.arange(0.5, 8), np.arange(0.5, 8)))
    for y in range(7):
        origin = np.column_stack([x, np.full(64, float(y)), z])
        found = probe("closest_hit", 4, origin, np.tile([0.0, 1.0, -0.0], (64, 1)))
        # A ray that starts in a level's plane may intersect that level at 0, which is not a
        # hit, and then the next at 1.
        assert np.all(found[:, 0] == 1.0)


@pytest.mark.parametrize("layout", ["bvh8", "packs", *others("bvh2", "cwbvh", "list")])
def test_any_hit_is_a_closest_hit_before_t_max(device: Device, layout: str) -> None:
    """Also if t_max is the hit's own t, or an adjacent float."""
    scene = Scene(meshes=[mesh(soup(500, 0.2))], spheres=balls(spheres(20)))
    origin, direction = random_rays(50_000, 7)
    probe = Probe(device, scene, layout=layout)
    t = probe("closest_hit", 4, origin, direction)[:, 0].astype(np.float32)
    hit = np.isfinite(t)
    assert 0.2 < np.mean(hit) < 0.98
    limits: dict[str, NDArray[np.floating]] = {
        "infinite": np.full_like(t, np.inf),
        "half": t / 2,
        "double": 2 * t,
        "at": t,
        "before": np.nextafter(t, np.float32(0)),
        "behind": np.nextafter(t, np.float32(np.inf)),
    }
    blocked = {name: probe("any_hit", 1, origin, direction, limit)[:, 0] > 0 for name, limit in limits.items()}
    wrong = {name: np.count_nonzero(blocked[name] != (hit & (t < limit))) for name, limit in limits.items()}
    assert not any(wrong.values()), wrong


@covering("layout, scale", LAYOUTS, [2.0**-66, 2.0**-30, 2.0**30, 2.0**50])
def test_scaled_mesh_has_the_same_hits(device: Device, layout: str, scale: float) -> None:
    """From 1e-20 to 1e15: powers of two are exact, so only t may change. The device has its own unit."""
    corners = soup(300, 0.3)
    origin, direction = random_rays(10_000, 9)
    unscaled = Probe(device, Scene(meshes=[mesh(corners)]), layout=layout)("closest_hit", 4, origin, direction)
    scene = Scene(meshes=[mesh(corners * np.float32(scale))])
    probe = Probe(device, scene, layout=layout)
    scale *= probe.compiled.frame.unit
    scaled = probe("closest_hit", 4, scale * origin, direction)
    assert np.count_nonzero(scaled[:, 3] != unscaled[:, 3]) == 0
    np.testing.assert_allclose(scaled[:, 0], scale * unscaled[:, 0], rtol=1e-6)


@covering("layout, length", LAYOUTS, [2.0**-30, 2.0**30, 2.0**-10, 2.0**10])
def test_length_of_the_direction_does_not_matter(device: Device, layout: str, length: float) -> None:
    """t is in multiples of the direction; shadow rays have the vector to their light as direction, in any scene
    unit."""
    scene = Scene(meshes=[mesh(soup(300, 0.3))], spheres=balls(spheres(20)))
    origin, direction = random_rays(10_000, 10)
    probe = Probe(device, scene, layout=layout)
    unscaled, scaled = (probe("closest_hit", 4, origin, factor * direction) for factor in (1.0, length))
    assert np.count_nonzero(scaled[:, 3] != unscaled[:, 3]) == 0
    np.testing.assert_allclose(length * scaled[:, 0], unscaled[:, 0], rtol=1e-6)


def test_a_ray_that_is_no_ray_hits_nothing(device: Device) -> None:
    """NaN and infinite origins and directions, in a process of their own: a stack overflow would end it.

    Its scene needs the same programs as the any-hit test, so that PoCL has them cached."""
    program = f"""
import numpy as np
from clrt.device.open import open_device
from clrt.scene.model import Mesh, Scene
from tests.accel.cases import soup, spheres
from tests.rendering.test_traverse import balls
from clrt.bench.kernel_probe import Probe
rays = np.tile([0.5, 0.5, 3.0, 0.1, 0.1, -1.0], (12, 1))
for i, bad in enumerate((np.nan, np.inf, -np.inf, 0.0)):
    rays[3 * i, :3] = rays[3 * i + 1, 3:] = rays[3 * i + 2] = bad
mesh = Mesh(soup(100).reshape(-1, 3), np.arange(300, dtype=np.int32).reshape(-1, 3))
for layout in {LAYOUTS}:
    probe = Probe(open_device({device.info.index}), Scene(meshes=[mesh], spheres=balls(spheres(20))), layout=layout)
    out = probe("closest_hit", 4, np.delete(rays, 9, axis=0))
    assert np.all(out[:, 3] == -1), (layout, out)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=HOUSE)
    assert done.returncode == 0, f"exit status {done.returncode}\n{done.stderr[-500:]}"


@pytest.mark.parametrize(
    ("layout", "triangles", "other"),
    [
        ("bvh8", 2000, "PORTABLE_MASK 1"),
        ("packs", 60, "WIDTH 8"),
        *others(("packs", 60, "PORTABLE_MASK 1"), ("packs", 60, "WIDTH 16")),
    ],
)
def test_other_instructions_give_the_same_hits(device: Device, layout: str, triangles: int, other: str) -> None:
    """Gathering mask bits by multiplication if there is no instruction for it, and packs of another width."""
    scene = Scene(meshes=[mesh(soup(triangles, 0.1))], spheres=balls(spheres(50)))
    origin, direction = random_rays(50_000, 8)
    hits, others = (
        Probe(device, scene, defines, layout=layout, lanes=8)("closest_hit", 4, origin, direction)
        for defines in ("", f"#define {other}")
    )
    assert np.array_equal(hits, others)
