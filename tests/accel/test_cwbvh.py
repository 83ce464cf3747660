"""Compressed nodes (CWBVH): conservative decoded boxes, each child stored once, octant order of slots, stack bounds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from clrt.accel.builders import BUILDERS, sah
from clrt.accel.bvh import FloatArray
from clrt.accel.cwbvh import MAX_LEAF, Records, compress, octant_slots, quantise
from clrt.accel.layouts import Layout, pack, sphere_boxes
from clrt.scene.geometry.scaling import unit_for

from .cases import NASTY, edges, soup, spheres
from .test_layouts import SCENES

Doubles = NDArray[np.float64]
Group = list[int]  # nodes that are still to be visited
CASES = {name: (corners, spheres(0)) for name, corners in NASTY.items() if name != "none"} | {
    "mixed": SCENES["mixed"],
    "spheres": SCENES["spheres"],
    "one_sphere": SCENES["one_sphere"],
}


def children_of(node: Any) -> Iterator[tuple[int, int]]:
    """Yield (slot, node) of the child nodes of a record, in slot order."""
    slots = [slot for slot in range(8) if node["imask"] >> slot & 1]
    yield from zip(slots, range(int(node["child"]), int(node["child"]) + len(slots)))


def leaves_of(node: Any) -> Iterator[tuple[int, int, int]]:
    """Yield (slot, first primitive, count) of the leaves of a record."""
    for slot, meta in enumerate(node["meta"].tolist()):
        if meta and not node["imask"] >> slot & 1:
            yield slot, int(node["primitive"]) + (meta & 31), (meta >> 5).bit_count()


def boxes_below(layout: Layout) -> tuple[FloatArray, FloatArray]:
    """Return (k, 8, 3) bounds of what is below each slot, computed bottom-up; inverted for empty slots."""
    low, high = [np.zeros((0, 3), np.float32)], [np.zeros((0, 3), np.float32)]
    if "leaf_triangles" in layout.buffers:
        corners = np.stack([layout.buffers["leaf_triangles"][name] for name in ("p0", "p1", "p2")], axis=1)
        low, high = ([each] for each in edges(corners))
    if "leaf_spheres" in layout.buffers:
        balls = layout.buffers["leaf_spheres"]
        inside = sphere_boxes(np.column_stack([balls["center"], balls["radius"]]))
        low, high = [*low, inside[0]], [*high, inside[1]]
    lows, highs, nodes = np.concatenate(low), np.concatenate(high), layout.buffers["nodes"]
    below_min = np.full((len(nodes), 8, 3), np.inf, np.float32)
    below_max = -below_min
    for index in reversed(range(len(nodes))):
        for slot, first, count in leaves_of(nodes[index]):
            below_min[index, slot] = lows[first : first + count].min(axis=0)
            below_max[index, slot] = highs[first : first + count].max(axis=0)
        for slot, child in children_of(nodes[index]):
            below_min[index, slot], below_max[index, slot] = below_min[child].min(axis=0), below_max[child].max(axis=0)
    return below_min, below_max


def slab(nodes: Records, origin: FloatArray, direction: np.float32) -> tuple[FloatArray, FloatArray]:
    """Return t_near, t_far (k, 3, 8) per axis, with the same float32 operations as cwbvh.cl.

    origin: (k, 3) of the ray, on each node's axes. Sums with q·step (exact) are rounded from float64, as by fma.
    """
    pad, unit = np.float32(6 * 2.0**-24), np.float32(1)
    base = nodes["origin"] - origin
    outward = np.abs(base) * np.float32(4 * 2.0**-24)
    step = np.ldexp(1.0, nodes["exponent"].astype(int) - 127)[..., None]
    low = (nodes["lo"] * step + (base - outward)[..., None]).astype(np.float32)
    high = (nodes["hi"] * step + (base + outward)[..., None]).astype(np.float32)
    near, far = (low, high) if direction > 0 else (high, low)
    inverse = unit / direction
    return near * (inverse * (unit - pad)), far * (inverse * (unit + pad))


@pytest.mark.parametrize("case", CASES)
def test_rays_enter_the_boxes_of_what_they_hit(case: str) -> None:
    """No decoded plane lies on the wrong side of the child's own plane, in t and in float32, for any ray origin.

    The reference is where rays in extended precision cross the planes of the children's boxes; values below 1e-30,
    whose products lose digits, are excluded. Lengths are in the scene's unit, as on devices.
    """
    triangles, balls = CASES[case]
    unit = np.float64(unit_for(max(np.abs(triangles).max(initial=0), np.abs(balls).max(initial=0))))
    layout = pack("cwbvh", "sah", (triangles * unit).astype(np.float32), (balls * unit).astype(np.float32))
    nodes, (below_min, below_max) = layout.buffers["nodes"], boxes_below(layout)
    used = np.isfinite(below_min[:, None, :, 0]).repeat(3, axis=1)
    low, high = (box.transpose(0, 2, 1).astype(np.longdouble) for box in (below_min, below_max))
    size = np.float32(np.ptp(np.concatenate([low[used], high[used]])))
    rng, own, slot = np.random.default_rng(0), nodes["origin"], np.argmax(used[:, 0], axis=1)
    planes = [np.take_along_axis(box, slot[:, None, None], axis=2)[..., 0].astype(np.float32) for box in (low, high)]
    origins = [
        0 * own,
        own,
        *planes,
        np.nextafter(planes[0], -size),
        np.nextafter(planes[1], size),
        own - 1000 * size,
        own + np.float32(1e6) * size,
        *(own + size * rng.random(own.shape, np.float32) for _ in range(4)),
    ]
    for origin in origins:
        for direction in (1.0, -1.0, 0.3, -1e-6, 777.7):
            near, far = slab(nodes, origin, np.float32(direction))
            exact = [(plane - origin[..., None]) / np.longdouble(np.float32(direction)) for plane in (low, high)]
            first, last = exact if direction > 0 else exact[::-1]
            normal = used & (np.abs(first) > 1e-30) & (np.abs(last) > 1e-30)
            assert not (normal & (first > 0) & (near > first)).any()
            assert not (normal & (last > 0) & (far < last)).any()
            assert not (used & (first <= 0) & (near > 1e-30)).any() and not (used & (last >= 0) & (far < -1e-30)).any()


@settings(deadline=None)
@given(
    corners=arrays(np.float32, (2, 8, 3), elements=st.floats(width=32, allow_nan=False, allow_infinity=False)),
    count=st.integers(0, 8),
    flat=st.booleans(),
)
def test_quantised_boxes_enclose_and_fit(corners: FloatArray, count: int, flat: bool) -> None:
    """In exact arithmetic, for any finite boxes: planes enclose the child within a step, which is not too large."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    if flat:
        low[:, 1] = high[:, 1] = low[0, 1]
    low[count:], high[count:] = np.inf, -np.inf
    origin, exponent, lo, hi = (a[0] for a in quantise(low[None], high[None]))
    assert (lo[count:] == 255).all() and (hi[count:] == 0).all() and np.isfinite(origin).all()
    rounding = Fraction(1, 2**53)
    for axis in range(3):
        step, p = Fraction(2) ** (int(exponent[axis]) - 127), Fraction(float(origin[axis]))
        for slot in range(count):
            near, far = Fraction(float(low[slot, axis])) - p, Fraction(float(high[slot, axis])) - p
            assert near * (1 - rounding) - step < int(lo[slot, axis]) * step <= near * (1 + rounding)
            assert far * (1 - rounding) <= int(hi[slot, axis]) * step < far * (1 + rounding) + step
        extent = Fraction(float(high[:count, axis].max(initial=origin[axis]))) - p
        assert exponent[axis] == 1 or 127 * step < extent
        assert count == 0 or not (flat and axis == 1 and (hi[:count, axis].any() or exponent[axis] > 1))


def check_said_once(layout: Layout, triangle_count: int, sphere_count: int) -> None:
    """Assert that each node and primitive is reached once, breadth first, and that the fields of a slot agree."""
    nodes = layout.buffers["nodes"]
    reached, primitives = [0], list[int]()
    for index, node in enumerate(nodes):
        children, leaves = list(children_of(node)), list(leaves_of(node))
        reached += [child for _, child in children]
        assert all(child > index for _, child in children)
        assert all(node["meta"][slot] == 0b001_11_000 + slot for slot, _ in children)
        for slot, first, count in leaves:
            assert node["meta"][slot] >> 5 in (1, 3, 7) and 0 <= first - node["primitive"] <= 24 - count
            assert first >= triangle_count or first + count <= triangle_count, "a leaf holds one kind"
            primitives += range(first, first + count)
        empty = np.setdiff1d(np.arange(8), [slot for slot, *_ in (*children, *leaves)])
        assert not node["meta"][empty].any()
        assert (node["lo"][:, empty] == 255).all() and (node["hi"][:, empty] == 0).all()
    assert reached == list(range(len(nodes))), "breadth first, each once"
    assert sorted(primitives) == list(range(triangle_count + sphere_count))


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("builder", BUILDERS)
def test_every_child_is_said_once(builder: str, scene: str) -> None:
    check_said_once(pack("cwbvh", builder, *SCENES[scene]), *map(len, SCENES[scene]))


@settings(deadline=None)
@given(offset=arrays(np.float64, (20, 8, 3), elements=st.integers(-9, 9)), used=arrays(np.bool_, (20, 8)))
def test_no_child_and_slot_prefer_each_other(offset: Doubles, used: NDArray[np.bool_]) -> None:
    """Greedy matching by best pair: any other pair is worth at most what its child or its slot has got."""
    slots = octant_slots(offset, used)
    corners = [[1 if slot >> axis & 1 else -1 for axis in range(3)] for slot in range(8)]
    for row, has in zip(slots, used):
        assert sorted(row[row >= 0]) == np.flatnonzero(has).tolist()
    for shift, row, has in zip(offset, slots, used):
        worth = shift @ np.transpose(corners)
        of_slot = np.array([worth[child, slot] if child >= 0 else -np.inf for slot, child in enumerate(row)])
        for child in np.flatnonzero(has):
            of_child = of_slot[np.flatnonzero(row == child)[0]]
            assert (worth[child] <= np.maximum(of_child, of_slot)).all()


def test_a_ray_passes_eight_corners_in_order() -> None:
    """With a child in each corner, for any octant, no child is visited after one that is behind it on every axis."""
    where = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    slots = octant_slots(where[None] * np.array([3.0, 2.0, 1.0]), np.ones((1, 8), bool))[0]
    for direction in where:
        order = sum(1 << axis for axis in range(3) if direction[axis] > 0)
        visited = [where[slots[bit ^ order]] * direction for bit in reversed(range(8))]
        for i, earlier in enumerate(visited):
            assert not any((later < earlier).any() and (later <= earlier).all() for later in visited[i:])


def fullest(nodes: Records, choose: Callable[[Group], int], enters: Callable[[], bool]) -> int:
    """Return the most groups on the stack of a traversal that visits choose(group) and enters children if enters()."""
    group, waiting, most = [0], list[Group](), 0
    while True:
        node = group.pop(group.index(choose(group)))
        if group:
            waiting.append(group)
        most = max(most, len(waiting))
        group = [child for _, child in children_of(nodes[node]) if enters()]
        if not group:
            if not waiting:
                return most
            group = waiting.pop()


@settings(deadline=None, max_examples=50)
@given(count=st.integers(1, 120), seed=st.integers(0, 10_000), size=st.sampled_from([0.001, 0.1, 3.0]))
def test_stack_bound_is_what_a_walk_to_some_node_takes(count: int, seed: int, size: float) -> None:
    layout = pack("cwbvh", "sah", soup(count, size, seed), spheres(seed % 3))
    nodes = layout.buffers["nodes"]
    parent = {child: index for index, node in enumerate(nodes) for _, child in children_of(node)}

    def walk(node: int) -> int:
        path = {node}
        while node in parent:
            node = parent[node]
            path.add(node)
        return fullest(nodes, lambda group: next((child for child in group if child in path), group[0]), lambda: True)

    assert layout.stack == max(walk(node) for node in range(len(nodes)))


@pytest.mark.parametrize("case", ["exponential", "teapot_in_a_stadium", "long_diagonals", "duplicates", "line"])
def test_no_order_of_visits_passes_the_bound(case: str) -> None:
    """The bound holds for any set of entered nodes in any order: slots from either end, and random ones."""
    corners, rng = NASTY[case], np.random.default_rng(1)
    tree = compress(sah(corners.min(axis=1), corners.max(axis=1), MAX_LEAF))
    orders: list[Callable[[Group], int]] = [min, max, *[lambda group: int(rng.choice(group))] * 8]
    most = [
        fullest(tree.nodes, choose, enters)
        for choose in orders
        for enters in (lambda: True, lambda: bool(rng.random() < 0.8))
    ]
    assert 0 < max(most) <= tree.stack
