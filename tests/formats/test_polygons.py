"""Triangulations cover simple polygons: no other set of k − 2 triangles of one orientation has the shoelace area."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st

from clrt.formats import polygons
from clrt.formats.models import read_mesh
from clrt.formats.polygons import fans, triangulate

Rng = np.random.Generator
Shape = Callable[[Rng, int], np.ndarray]


def star(rng: Rng, corners: int) -> np.ndarray:
    """Seen from the origin, the corners follow each other at any distance."""
    angles = (np.arange(corners) + 0.9 * rng.random(corners)) * 2 * np.pi / corners
    return np.column_stack([np.cos(angles), np.sin(angles)]) * (0.2 + rng.random(corners))[:, None]


def comb(rng: Rng, corners: int) -> np.ndarray:
    """Teeth of random lengths, visible from no single point."""
    x = np.arange(corners - 2)
    teeth = np.column_stack([x, np.where(x % 2, 5, rng.random(len(x)))])
    return np.concatenate([[[len(x) - 1, -1.0]], teeth[::-1], [[0, -1.0]]])


def spiral(rng: Rng, corners: int) -> np.ndarray:
    """A winding corridor: only its ends are ears."""
    angles = np.linspace(0, 1 + 0.2 * corners, corners // 2)
    around = np.column_stack([np.cos(angles), np.sin(angles)])
    outside = around * (2 + angles)[:, None]
    return np.concatenate([outside, (around * (0.5 + angles)[:, None])[: corners - len(outside)][::-1]])


def with_hole(rng: Rng, corners: int) -> np.ndarray:
    """A ring, cut open: two of its corners occur twice."""
    angles = np.linspace(0, 2 * np.pi, max(corners // 2, 4))
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    circle[-1] = circle[0]
    return np.concatenate([2 * circle, circle[::-1]])


def collinear(rng: Rng, corners: int) -> np.ndarray:
    """An L whose edges have further vertices."""
    outline = np.array([[0, 0], [3, 0], [3, 1], [1, 1], [1, 3], [0, 3.0]])
    steps = np.linspace(0, 1, max(corners // 6, 1), endpoint=False)[:, None]
    return np.concatenate([a + steps * (b - a) for a, b in zip(outline, np.roll(outline, -1, axis=0))])


def staircases(rng: Rng, corners: int) -> np.ndarray:
    """Between two staircases; where two steps are as high as each other, a vertex occurs twice in succession."""
    steps = max(corners // 4, 2)
    x = np.repeat(np.arange(steps + 1.0), 2)[1:-1]
    lower, upper = (np.column_stack([x, np.repeat(rng.integers(y, y + 3, steps), 2)]) for y in (0, 3))
    return np.concatenate([lower, upper[::-1]])


def spikes(rng: Rng, corners: int) -> np.ndarray:
    """A star with detours toward its center, or away from it, and back along the same way."""
    factors = np.ones((corners, 3))
    factors[:, 1] = rng.choice([0.5, 1, 1.5], corners)
    return np.concatenate(factors[:, :, None] * star(rng, corners)[:, None])


def touching(rng: Rng, corners: int) -> np.ndarray:
    """Every other tooth of a comb touches the edge opposite."""
    x = np.arange(corners - 2)
    teeth = np.column_stack([x, np.where(x % 2, 0, 3 + rng.random(len(x)))])
    return np.concatenate([[[-1, 0.0], [len(x), 0.0]], teeth[::-1]])


def slender(rng: Rng, corners: int) -> np.ndarray:
    return star(rng, corners) * [1, 1e-6]


SHAPES = [star, comb, spiral, with_hole, collinear, staircases, spikes, touching, slender]


def signed_area(polygon: np.ndarray) -> float:
    (x, y), (u, v) = polygon.T, np.roll(polygon, -1, axis=0).T
    return float(np.sum(x * v - y * u)) / 2


def turned(rng: Rng, polygon: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The polygon in a random plane, and the plane's normal."""
    frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return polygon @ frame[:2] + rng.normal(size=3), np.cross(frame[0], frame[1])


def areas(points: np.ndarray, triangles: np.ndarray, normal: np.ndarray) -> np.ndarray:
    a, b, c = points[triangles].transpose(1, 0, 2)
    return np.asarray(np.sum(np.cross(b - a, c - a) * normal, axis=1) / 2)


def assert_covered(points: np.ndarray, outlines: list[np.ndarray], normals: np.ndarray, expected: np.ndarray) -> None:
    """Triangles of the outlines, indices into the points, have the expected area, and none is turned over."""
    sizes, corners = np.array([len(each) for each in outlines]), np.concatenate(outlines)
    triangles = triangulate(points, corners, sizes)
    owner = np.repeat(np.arange(len(sizes)), sizes - 2)
    assert triangles.shape == (len(owner), 3)
    found = areas(points, corners[triangles], normals[owner]) / expected[owner]
    assert found.min() > -1e-7
    np.testing.assert_allclose(np.bincount(owner, found), 1, rtol=1e-6)


@pytest.mark.parametrize("shape", SHAPES)
@settings(max_examples=20, deadline=None, derandomize=True)
@example(seed=185719718, corners=14)
@example(seed=3, corners=14)
@example(seed=95, corners=14)
@example(seed=1152, corners=12)
@example(seed=765, corners=18)
@given(seed=st.integers(0, 1 << 32), corners=st.integers(4, 24))
def test_simple_polygons(shape: Shape, seed: int, corners: int) -> None:
    """From each corner as the first one, in both orientations, none overlaps and none is turned over."""
    rng = np.random.default_rng(seed)
    polygon = shape(rng, corners)
    points, normal = turned(rng, polygon)
    k = len(polygon)
    outlines = [np.roll(order, first) for order in (np.arange(k), np.arange(k)[::-1]) for first in range(k)]
    expected = np.repeat([1.0, -1.0], k) * signed_area(polygon)
    assert_covered(points, outlines, np.tile(normal, (2 * k, 1)), expected)


@pytest.mark.parametrize("shape", SHAPES)
def test_many_simple_polygons(shape: Shape) -> None:
    """Hundreds of one shape and of all sizes, in random planes and from random corners on."""
    rng = np.random.default_rng(11)
    shapes = [shape(rng, int(corners)) for corners in rng.integers(4, 61, 600)]
    points, normals = zip(*(turned(rng, each) for each in shapes))
    sizes = np.array([len(each) for each in shapes])
    starts = np.cumsum(sizes) - sizes
    outlines = [start + np.roll(np.arange(k), rng.integers(k)) for start, k in zip(starts, sizes)]
    expected = np.array([signed_area(each) for each in shapes])
    assert_covered(np.concatenate(points), outlines, np.array(normals), expected)


def test_convex_polygons_stay_fans() -> None:
    angles = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    points = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    sizes = np.array([12, 3, 5])
    corners = np.concatenate([np.arange(12), [0, 4, 8], [11, 9, 6, 3, 1]])
    np.testing.assert_array_equal(triangulate(points, corners, sizes), fans(sizes))
    np.testing.assert_array_equal(fans(np.array([3, 5])), [[0, 1, 2], [3, 4, 5], [3, 5, 6], [3, 6, 7]])


def test_polygons_of_one_file_do_not_mix() -> None:
    rng = np.random.default_rng(5)
    shapes = [star(rng, int(corners)) for corners in rng.integers(3, 12, 200)]
    sizes = np.array([len(each) for each in shapes])
    points = np.column_stack([np.concatenate(shapes), np.zeros(sizes.sum())])
    triangles = triangulate(points, np.arange(len(points)), sizes)
    owner = np.repeat(np.arange(200), sizes)
    np.testing.assert_array_equal(owner[triangles], np.repeat(np.arange(200), sizes - 2)[:, None] + [0, 0, 0])
    found = np.bincount(owner[triangles[:, 0]], areas(points, triangles, np.array([0, 0, 1])))
    np.testing.assert_allclose(found, [signed_area(each) for each in shapes])


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 1 << 32), corners=st.integers(3, 60))
def test_any_polygon_becomes_triangles(seed: int, corners: int) -> None:
    """Also those that intersect themselves, are degenerate or have vertices that are not finite."""
    rng = np.random.default_rng(seed)
    points = rng.integers(1, 4, (corners, 3)) * rng.choice(
        [1.0, 1e30, np.nan, np.inf], (corners, 3), p=[0.97, 0.01, 0.01, 0.01]
    )
    triangles = triangulate(points, np.arange(corners), np.array([corners]))
    assert triangles.shape == (corners - 2, 3) and triangles.min() >= 0 and triangles.max() < corners


def test_work_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    """What exceeds the limits becomes a fan; other polygons are not affected by the limit for one."""
    rng = np.random.default_rng(7)
    large, small = star(rng, 400), collinear(rng, 6)
    points = np.column_stack([np.concatenate([large, small]), np.zeros(406)])
    monkeypatch.setattr(polygons, "MOST_PAIRS", 1000)
    triangles = triangulate(points, np.arange(406), np.array([400, 6]))
    np.testing.assert_array_equal(triangles[:398], fans(np.array([400])))
    assert areas(points, triangles[398:], np.array([0, 0, 1])).min() > 0
    monkeypatch.setattr(polygons, "WORK", 0)
    np.testing.assert_array_equal(triangulate(points, np.arange(406), np.array([400, 6])), fans(np.array([400, 6])))


L = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)]
ROWS = "".join(f"{x} {y} 0\n" for x, y in L)
FILES = {
    "a.obj": "v " + ROWS.strip().replace("\n", "\nv ") + "\nf 2 3 4 5 6 1\n",
    "a.off": f"OFF\n6 1 0\n{ROWS}6 1 2 3 4 5 0\n",
    "a.ply": "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n"
    f"element face 1\nproperty list uchar int vertex_indices\nend_header\n{ROWS}6 1 2 3 4 5 0\n",
}


@pytest.mark.parametrize("name", FILES)
def test_concave_polygons_of_files(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(FILES[name])
    (mesh,) = read_mesh(tmp_path / name)
    found = areas(mesh.vertices, mesh.faces, np.array([0, 0, 1]))
    assert found.sum() == 5 and found.min() > 0
