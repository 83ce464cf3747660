"""RayQuery agrees with float64 brute force for every layout, chunk size and ray order."""

from __future__ import annotations

import os
import signal
import sys
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import clrt
from clrt.device.open import Device
from clrt.queries import base
from clrt.queries.query_program import TRAVERSALS

from ..covering import others
from ..rendering.rays import grid

Doubles = NDArray[np.float64]
RNG = np.random.default_rng(5)
VERTICES = RNG.uniform(-1, 1, (150, 3)).astype(np.float32)
FACES = RNG.integers(0, 150, (400, 3), dtype=np.int32)
ORIGINS = RNG.uniform(-2, 2, (3000, 3)).astype(np.float32)
DIRECTIONS = (RNG.normal(size=(3000, 3)) * RNG.uniform(0.1, 10, (3000, 1))).astype(np.float32)


@pytest.fixture(
    params=["bvh8-single", "bvh8-packet", "bvh8-pool", "bvh2-single", "cwbvh-single", "packs-single", "list-single"]
)
def soup(request: pytest.FixtureRequest, device: Device) -> clrt.RayQuery:
    """Return a query of random triangles for each layout and traversal."""
    layout, traversal = request.param.split("-")
    return clrt.RayQuery(VERTICES, FACES, device=device.info.index, layout=layout, traversal=traversal)


def brute_force(
    origins: Doubles, directions: Doubles, corners: NDArray[np.float32] = VERTICES[FACES]
) -> tuple[Doubles, Doubles]:
    """Return (n, m) float64: t of every ray at every triangle, inf outside, and how deep inside the hit lies."""
    p0, p1, p2 = (corners[:, i].astype(np.float64) for i in range(3))
    normal = np.cross(p1 - p0, p2 - p0)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = ((p0 * normal).sum(1) - origins @ normal.T) / (directions @ normal.T)
        point = origins[:, None] + t[..., None] * directions[:, None]
        edges = [
            np.einsum("nmk,mk->nm", np.cross(b - a, point - a), normal) / (normal**2).sum(1)
            for a, b in ((p0, p1), (p1, p2), (p2, p0))
        ]
        depth = np.minimum.reduce(edges)
        return np.where((depth >= 0) & (t > 0), t, np.inf), np.where(t > 0, depth, -np.inf)


def test_closest_hit_is_the_nearest_of_all(soup: clrt.RayQuery) -> None:
    t, depth = brute_force(ORIGINS.astype(np.float64), DIRECTIONS.astype(np.float64))
    clear = (np.abs(depth) > 1e-5).all(axis=1)
    hits = soup.closest_hit(ORIGINS, DIRECTIONS)
    nearest, primitive = t.min(axis=1), np.where(np.isfinite(t.min(axis=1)), t.argmin(axis=1), -1)
    second = np.partition(t, 1, axis=1)[:, 1]
    clear &= (second > 1.0001 * nearest) | np.isinf(nearest)
    assert clear.mean() > 0.9, "rays through the middle of triangles are the rule"
    np.testing.assert_array_equal(hits["primitive"][clear], primitive[clear])
    np.testing.assert_allclose(hits["t"][clear], nearest[clear], rtol=2e-4)
    hit = clear & (primitive >= 0)
    corners = VERTICES[FACES[hits["primitive"][hit]]].astype(np.float64)
    u, v = hits["u"][hit, None].astype(np.float64), hits["v"][hit, None].astype(np.float64)
    at = (1 - u - v) * corners[:, 0] + u * corners[:, 1] + v * corners[:, 2]
    ray = ORIGINS[hit] + nearest[hit, None] * DIRECTIONS[hit]
    np.testing.assert_allclose(at, ray, atol=1e-4)


def test_any_hit_agrees_with_closest_hit(soup: clrt.RayQuery) -> None:
    hits = soup.closest_hit(ORIGINS, DIRECTIONS)
    limit = RNG.uniform(0, 2, len(ORIGINS)).astype(np.float32)
    np.testing.assert_array_equal(soup.any_hit(ORIGINS, DIRECTIONS), hits["primitive"] >= 0)
    np.testing.assert_array_equal(soup.any_hit(ORIGINS, DIRECTIONS, limit), hits["t"] < limit)
    short = soup.closest_hit(ORIGINS, DIRECTIONS, limit)
    np.testing.assert_array_equal(short["primitive"], np.where(hits["t"] < limit, hits["primitive"], -1))
    assert np.isinf(short["t"][short["primitive"] < 0]).all()


@pytest.mark.parametrize("kind", ["bvh8-single", "bvh8-packet", "bvh8-pool", "bvh2-single", "cwbvh-single"])
def test_the_end_of_a_ray_is_exact(device: Device, kind: str) -> None:
    """A ray that ends just behind the nearest triangle hits it, one that ends just before it hits nothing.

    The triangles are parallel to two axes, so that a ray enters their boxes where it hits them.
    """
    rng = np.random.default_rng(7)
    corners = rng.uniform(-1, 1, (400, 3, 3))
    corners[np.arange(400), :, rng.integers(3, size=400)] = rng.uniform(-1, 1, (400, 1))
    vertices, faces = corners.reshape(-1, 3).astype(np.float32), np.arange(1200).reshape(-1, 3)
    layout, traversal = kind.split("-")
    query = clrt.RayQuery(vertices, faces, device=device.info.index, layout=layout, traversal=traversal)
    t, depth = brute_force(ORIGINS.astype(np.float64), DIRECTIONS.astype(np.float64), vertices[faces])
    nearest, length = t.min(axis=1), np.linalg.norm(DIRECTIONS, axis=1)
    clear = (np.abs(depth) > 1e-5).all(axis=1) & (nearest * length > 0.1) & np.isfinite(nearest)
    assert clear.sum() > 300
    rays, primitive = (ORIGINS[clear], DIRECTIONS[clear]), t.argmin(axis=1)[clear]
    behind, before = nearest[clear] * (1 + 1e-4), nearest[clear] * (1 - 1e-4)
    np.testing.assert_array_equal(query.closest_hit(*rays, behind)["primitive"], primitive)
    assert query.any_hit(*rays, behind).all() and not query.any_hit(*rays, before).any()


@pytest.mark.parametrize(
    "soup",
    [
        *("bvh8-single", "cwbvh-single", "packs-single"),
        *others("bvh8-packet", "bvh8-pool", "bvh2-single", "list-single"),
    ],
    indirect=True,
)
def test_all_hits_are_those_of_brute_force(soup: clrt.RayQuery) -> None:
    t, depth = brute_force(ORIGINS.astype(np.float64), DIRECTIONS.astype(np.float64))
    clear = np.flatnonzero((np.abs(depth) > 1e-5).all(axis=1))
    index, hits = soup.all_hits(ORIGINS[clear], DIRECTIONS[clear], max_hits=len(FACES))
    ray, primitive = np.nonzero(np.isfinite(t[clear]))
    assert len(ray) > 4 * len(clear)
    by_primitive = np.lexsort((hits["primitive"], index))
    np.testing.assert_array_equal(index[by_primitive], ray)
    np.testing.assert_array_equal(hits["primitive"][by_primitive], primitive)
    assert (np.diff(hits["t"])[np.diff(index) == 0] >= 0).all()


def test_coherent_rays_hit_the_same_by_all_traversals(device: Device) -> None:
    """A fan from one point and parallel rays, with single divergent rays, agree bit for bit across traversals."""
    y, x = np.mgrid[-1:1:90j, -1:1:91j].reshape(2, -1)
    fan = np.stack([x, y, np.full(len(x), -1.5)], axis=1)
    fan[::97] *= -1
    parallel = np.tile([0.1, 0.2, -1.0], (len(x), 1))
    origins = np.concatenate([np.tile([0.1, 0.2, 3.0], (len(x), 1)), np.stack([x, y, np.full(len(x), 2.0)], axis=1)])
    rays = origins, np.concatenate([fan, parallel]), RNG.uniform(1, 4, len(origins))
    queries = [
        clrt.RayQuery(VERTICES, FACES, device=device.info.index, layout="bvh8", traversal=traversal)
        for traversal in (*TRAVERSALS, None)
    ]
    first, *alike = [each.closest_hit(*rays) for each in queries]
    assert (first["primitive"] >= 0).mean() > 0.3
    for hits in alike:
        np.testing.assert_array_equal(hits, first)
    for each in queries:
        np.testing.assert_array_equal(each.any_hit(*rays), first["primitive"] >= 0)


@pytest.mark.parametrize("layout", ["bvh8", "bvh2", "cwbvh", "packs", "list"])
def test_copies_a_hair_away_are_told_apart(device: Device, layout: str) -> None:
    """The lowest index of nine coincident triangles is hit, also if t is hardly more than rounding error."""
    rng = np.random.default_rng(6)
    order = rng.permutation(np.tile(np.arange(64), 9))
    corners = rng.uniform(-1, 1, (64, 3, 3)).astype(np.float32)
    query = clrt.RayQuery(
        corners.reshape(-1, 3),
        np.arange(192, dtype=np.int32).reshape(-1, 3)[order],
        device=device.info.index,
        layout=layout,
    )
    which = rng.integers(64, size=20_000)
    directions = rng.normal(size=(20_000, 3)).astype(np.float32)
    distance = 10.0 ** rng.uniform(-7, -3, (20_000, 1))
    inside = np.einsum("nk,nkx->nx", rng.dirichlet((1, 1, 1), 20_000), corners[which])
    hits = query.closest_hit((inside - distance * directions).astype(np.float32), directions)
    met = hits["primitive"] >= 0
    first = np.array([np.flatnonzero(order == triangle)[0] for triangle in range(64)])
    assert np.mean(met) > 0.9 and np.array_equal(hits["primitive"][met], first[order[hits["primitive"][met]]])


def test_chunks_and_order_do_not_matter(soup: clrt.RayQuery, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = soup.closest_hit(ORIGINS, DIRECTIONS)
    order = RNG.permutation(len(ORIGINS))
    np.testing.assert_array_equal(soup.closest_hit(ORIGINS[order], DIRECTIONS[order]), whole[order])
    monkeypatch.setattr(base, "CHUNK", 257)
    np.testing.assert_array_equal(soup.closest_hit(ORIGINS, DIRECTIONS), whole)


@pytest.mark.parametrize("scale", [1e-20, 1.0, 1e15])
def test_size_does_not_matter(device: Device, scale: float) -> None:
    base = clrt.RayQuery(VERTICES, FACES, device=device.info.index).closest_hit(ORIGINS, DIRECTIONS)
    size = 2.0 ** np.round(np.log2(scale))
    hits = clrt.RayQuery(VERTICES * size, FACES, device=device.info.index).closest_hit(ORIGINS * size, DIRECTIONS)
    np.testing.assert_array_equal(hits["primitive"], base["primitive"])
    np.testing.assert_allclose(hits["t"], base["t"] * size, rtol=1e-6)


def test_strange_rays_hit_nothing(soup: clrt.RayQuery) -> None:
    strange: list[Any] = [[0, 0, 0], [np.nan, 0, 1], [np.inf, 0, 1], [-np.inf] * 3]
    assert not soup.any_hit([0.0, 0.0, 0.0], strange).any()
    assert not soup.any_hit(np.array(strange[1:]), [0.0, 0.0, 1.0]).any()
    assert not soup.any_hit(ORIGINS, DIRECTIONS, 0.0).any() and not soup.any_hit(ORIGINS, DIRECTIONS, np.nan).any()
    assert soup.closest_hit(np.zeros((0, 3)), np.zeros((0, 3))).shape == (0,)


def test_a_mesh_without_faces_is_empty(device: Device) -> None:
    empty = clrt.RayQuery(np.zeros((0, 3)), np.zeros((0, 3), int), device=device.info.index)
    assert not empty.any_hit(ORIGINS, DIRECTIONS).any()
    assert (empty.closest_hit(ORIGINS, DIRECTIONS)["primitive"] == -1).all()


@pytest.mark.parametrize(
    ("vertices", "faces", "words"),
    [
        (np.zeros((3, 2)), [[0, 1, 2]], "(3, 2)"),
        (np.zeros((3, 3)), [[0, 1, 3]], "faces[0]"),
        (np.zeros((3, 3)), [[0, -1, 2]], "faces[0]"),
        (np.zeros((3, 3)), [[0.0, 1.0, 2.0]], "float64"),
        (np.zeros((4, 3)), [[1, 2, 3], [2, 3, 4]], "faces[1] = [2, 3, 4]: the mesh has 4 vertices, counted from 0"),
        ([[0, 0, 0], [1, 0, 0], [0, np.nan, 0]], [[0, 1, 2]], "vertices[2]"),
        ([[0, 0, 0], [1e300, 0, 0], [0, 1, 0]], [[0, 1, 2]], "vertices[1] = [1e+300, 0.0, 0.0]"),
        (np.zeros((3, 3), complex), [[0, 1, 2]], "vertices has dtype complex128"),
        (np.zeros((3, 3)), [[0j, 1, 2]], "faces has dtype complex128"),
        ([[0, 0, 0], [1, 0]], [[0, 1, 2]], "vertices is not an array"),
        (np.zeros((3, 3)), [[0, 1, 2], [0]], "faces is not an array"),
        (np.zeros((3, 3)), "faces", "faces has dtype"),
    ],
)
def test_what_is_no_mesh_is_refused(vertices: Any, faces: Any, words: str) -> None:
    with pytest.raises(clrt.SceneError) as caught:
        clrt.RayQuery(vertices, faces)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("origins", "directions", "t_max", "words"),
    [
        (np.zeros((2, 3)), np.ones((3, 3)), 1, r"directions \(3, 3\): there are 2 origins"),
        (np.zeros((2, 3)), np.ones((2, 3)), np.ones(3), r"t_max \(3,\): there are 2 origins"),
        (np.zeros(3), np.ones((2, 3)), np.ones(3), r"t_max \(3,\): there are 2 directions"),
        (np.zeros(2), np.ones(3), 1, r"origins \(2,\) must"),
        (np.zeros((3, 9)), np.ones((3, 9)), 1, r"origins \(3, 9\) must"),
        (np.zeros(3), np.ones((2, 2, 3)), 1, r"directions \(2, 2, 3\) must"),
        (np.zeros(3), np.ones(3), np.ones((2, 2)), r"t_max \(2, 2\) must"),
        (np.zeros(3), np.ones(3), None, "t_max has dtype object"),
        (np.zeros(3), np.ones(3), "far", "t_max has dtype"),
        (np.zeros(3, complex), np.ones(3), 1, "origins has dtype complex128"),
        ([[0, 0, 0], [0]], np.ones(3), 1, "origins is not an array"),
    ],
)
def test_rays_that_do_not_fit_are_refused(
    device: Device, origins: Any, directions: Any, t_max: Any, words: str
) -> None:
    query = clrt.RayQuery(VERTICES, FACES, device=device.info.index)
    for ask in (query.closest_hit, query.any_hit, query.all_hits):
        with pytest.raises(clrt.UsageError, match=words):
            ask(origins, directions, t_max)


@pytest.mark.parametrize("max_hits", [0, 2.5, None, "all"])
def test_numbers_of_hits_are_whole(device: Device, max_hits: Any) -> None:
    with pytest.raises(clrt.UsageError, match=f"max_hits is {max_hits!r}"):
        clrt.RayQuery(VERTICES, FACES, device=device.info.index).all_hits(ORIGINS, DIRECTIONS, max_hits=max_hits)


@pytest.mark.parametrize(
    ("choice", "words"),
    [
        ({"layout": "bvh9"}, "bvh2, bvh8, cwbvh"),
        ({"builder": "lbvh"}, "ploc, reinsertion, sah, midpoint"),
        ({"traversal": "pol"}, "single, packet, pool"),
        ({"traversal": "pool", "layout": "bvh2"}, "bvh8, not bvh2"),
        ({"triangle": "watertite"}, "watertight, "),
        ({"box": "loose"}, "robust, plain"),
        ({"sphere": "flat"}, "textbook"),
    ],
)
def test_choices_that_are_none_are_refused(device: Device, choice: dict[str, Any], words: str) -> None:
    with pytest.raises(clrt.UsageError, match=words):
        clrt.RayQuery(VERTICES, FACES, device=device.info.index, **choice)


def test_programs_that_are_none_are_refused(soup: clrt.RayQuery) -> None:
    for name, traversal in (("closesthit", "single"), ("closest_hit", "pol")):
        with pytest.raises(clrt.UsageError, match="choose from"):
            soup.source(name, traversal)


def test_numbers_beyond_float32_are_infinite(soup: clrt.RayQuery) -> None:
    """An infinite limit cuts nothing, and nothing is hit from an infinite origin; neither raises an error."""
    np.testing.assert_array_equal(soup.any_hit(ORIGINS, DIRECTIONS, 1e300), soup.any_hit(ORIGINS, DIRECTIONS))
    assert not soup.any_hit([1e300, 0, 0], DIRECTIONS).any()


def test_threads_share_a_query(device: Device) -> None:
    """Each of four threads gets the answers to its own rays, at a switch interval of 1e-6 s."""
    query = clrt.RayQuery(VERTICES, FACES, device=device.info.index)
    parts = [slice(size) for size in (300, 700, 1500, 3000)] * 100
    expected = query.closest_hit(ORIGINS, DIRECTIONS)
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(4) as threads:
            answers = list(threads.map(lambda part: query.closest_hit(ORIGINS[part], DIRECTIONS[part]), parts))
    finally:
        sys.setswitchinterval(interval)
    for part, answer in zip(parts, answers):
        np.testing.assert_array_equal(answer, expected[part])


def test_a_forked_process_is_refused(device: Device) -> None:
    """Both the parent's query and a new one would hang in the child, so they raise UsageError."""
    query = clrt.RayQuery(VERTICES, FACES, device=device.info.index)
    query.any_hit(ORIGINS, DIRECTIONS)
    for ask in (lambda: query.any_hit(ORIGINS, DIRECTIONS), lambda: clrt.RayQuery(VERTICES, FACES)):
        child = os.fork()
        if not child:
            signal.alarm(20)
            try:
                ask()
            except clrt.UsageError as error:
                os._exit(0 if "spawn" in str(error) else 1)
            finally:
                os._exit(2)
        assert os.waitpid(child, 0)[1] == 0


def test_a_query_says_what_it_is(device: Device) -> None:
    query = clrt.RayQuery(VERTICES, FACES, device=device.info.index, layout="bvh2")
    assert repr(query) == f"<RayQuery: 400 triangles, 0 spheres; bvh2 on {device.info.name}>"


@pytest.mark.parametrize("layout", ["bvh8", "bvh2", "cwbvh"])
def test_no_ray_from_afar_passes_between_triangles(device: Device, layout: str) -> None:
    """From 10^5 sizes away onto the inner corners of a grid along the axes, whose boxes meet there: every ray hits.

    Box tests that leave out their own rounding (`box="plain"`) lose one ray in some hundreds.
    """
    vertices, faces = grid(16)
    inner = vertices[((vertices > 0) & (vertices < 16)).sum(axis=1) == 2]
    rng = np.random.default_rng(1)
    away = rng.normal(size=(100_000, 3))
    away[:, 1] = np.abs(away[:, 1]) + 1
    origins = (1e6 * away / np.linalg.norm(away, axis=1, keepdims=True)).astype(np.float32)
    targets = rng.choice(inner, len(origins))
    query = clrt.RayQuery(vertices, faces, device=device.info.index, layout=layout)
    assert not (query.closest_hit(origins, targets - origins)["primitive"] < 0).any()


@pytest.mark.parametrize("exponent", [-140, -130, -127, -126, 126])
def test_scaled_to_the_ends_of_float32(device: Device, exponent: int) -> None:
    """Scaling exact coordinates by a power of two gives the same hits, also of spheres."""
    rng = np.random.default_rng(7)
    vertices, faces = rng.integers(-64, 64, (60, 3)) / 64, rng.integers(0, 60, (90, 3))
    spheres = np.hstack([rng.integers(-64, 64, (20, 3)) / 64, np.full((20, 1), 0.0625)])
    origins, directions, scale = rng.integers(-128, 128, (400, 3)) / 64, rng.normal(size=(400, 3)), 2.0**exponent
    expected = clrt.RayQuery(vertices, faces, spheres=spheres, device=device.info.index)
    scaled = clrt.RayQuery(vertices * scale, faces, spheres=spheres * scale, device=device.info.index)
    hits, found = expected.closest_hit(origins, directions), scaled.closest_hit(origins * scale, directions)
    assert (hits["primitive"] >= 0).sum() > 20
    np.testing.assert_array_equal(found["primitive"], hits["primitive"])
