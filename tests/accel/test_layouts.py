"""Reference traversal of the packed records in float64 hits what brute force hits, for every layout and builder."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from clrt.accel.builders import BUILDERS
from clrt.accel.bvh import FloatArray
from clrt.accel.cwbvh import CWBVH_NODE
from clrt.accel.layouts import (
    BVH2_NODE,
    BVH8_NODE,
    LAYOUTS,
    LEAF_SPHERE,
    LEAF_TRIANGLE,
    LONE_PACK,
    TRIANGLE_PACK,
    Layout,
    pack,
    sphere_boxes,
)
from clrt.accel.methods import TREELESS
from clrt.accel.wide import EMPTY
from clrt.errors import UsageError

from ..covering import covering
from .cases import grid, soup, spheres

Doubles = NDArray[np.float64]
Ray = tuple[Doubles, Doubles]
Hit = tuple[float, int]  # t and primitive
MISS: Hit = (np.inf, -1)
Box = tuple[Any, Any]
Visit = tuple[list[tuple[Box, int]], Hit]  # children with their references, or the hit of a leaf's primitives

SCENES = {
    "mixed": (soup(400, 0.2), spheres(40)),
    "triangles": (soup(300, 0.2), spheres(0)),
    "spheres": (soup(0), spheres(60)),
    "duplicates": (np.repeat(soup(10, 0.6), 64, axis=0), np.repeat(spheres(5), 3, axis=0)),
    "flat": (grid(12), spheres(0)),
    "degenerate": (np.concatenate([soup(40, 0.4), soup(40)[:, [0, 0, 1]]]), spheres(1)),
    "one": (soup(1, 1.0), spheres(0)),
    "one_sphere": (soup(0), np.array([[0.5, 0.5, 0.5, 0.4]], np.float32)),
    "one_each": (soup(1, 1.0), spheres(1)),
    "nothing": (soup(0), spheres(0)),
}


def rays(count: int = 60) -> list[Ray]:
    """Return rays from around and inside the unit cube; every tenth one is parallel to an axis."""
    rng = np.random.default_rng(3)
    origins = rng.uniform(-1, 2, (count, 3))
    directions = rng.random((count, 3)) - origins
    axes = np.arange(0, count, 10)
    origins[axes], directions[axes] = [0.4, 0.3, 0.6], 0
    directions[axes, axes // 10 % 3] = 1
    origins[axes, axes // 10 % 3] = -1
    return list(zip(origins, directions))


def hit_triangles(corners: Doubles, primitive: NDArray[np.int32], ray: Ray) -> Hit:
    """Möller–Trumbore on (n, 3, 3) per component, so bits do not depend on n. Ties go to the lowest primitive."""
    (ox, oy, oz), (dx, dy, dz) = ray
    p0x, p0y, p0z, p1x, p1y, p1z, p2x, p2y, p2z = corners.reshape(-1, 9).T
    ax, ay, az, bx, by, bz = p1x - p0x, p1y - p0y, p1z - p0z, p2x - p0x, p2y - p0y, p2z - p0z
    sx, sy, sz = ox - p0x, oy - p0y, oz - p0z
    qx, qy, qz = dy * bz - dz * by, dz * bx - dx * bz, dx * by - dy * bx
    rx, ry, rz = sy * az - sz * ay, sz * ax - sx * az, sx * ay - sy * ax
    det = qx * ax + qy * ay + qz * az
    with np.errstate(divide="ignore", invalid="ignore"):
        u, v = (qx * sx + qy * sy + qz * sz) / det, (rx * dx + ry * dy + rz * dz) / det
        t = (rx * bx + ry * by + rz * bz) / det
        hit = (det != 0) & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
    return min([*zip(t[hit].tolist(), primitive[hit].tolist()), MISS])


def hit_spheres(center: Doubles, radius: Doubles, primitive: NDArray[np.int32], ray: Ray) -> Hit:
    (ox, oy, oz), (dx, dy, dz) = ray
    x, y, z = ox - center[:, 0], oy - center[:, 1], oz - center[:, 2]
    a, b = dx * dx + dy * dy + dz * dz, dx * x + dy * y + dz * z
    discriminant = b * b - a * (x * x + y * y + z * z - radius * radius)
    hits = []
    for d, b_i, i in zip(discriminant.tolist(), b.tolist(), primitive.tolist()):
        roots = [(-b_i + side * d**0.5) / a for side in (-1, 1)] if d >= 0 else []
        hits += [(root, i) for root in roots if root > 0][:1]
    return min([*hits, MISS])


def brute_force(triangles: FloatArray, balls: FloatArray, ray: Ray) -> Hit:
    number = np.arange(len(triangles) + len(balls), dtype=np.int32)
    wide = balls.astype(np.float64)
    return min(
        hit_triangles(triangles.astype(np.float64), number[: len(triangles)], ray),
        hit_spheres(wide[:, :3], wide[:, 3], number[len(triangles) :], ray),
    )


def triangle_records(records: NDArray[np.void], ray: Ray) -> Hit:
    corners = np.stack([records["p0"], records["p1"], records["p2"]], axis=1).astype(np.float64)
    return hit_triangles(corners, records["primitive"], ray)


def pack_record(record: Any, ray: Ray) -> Hit:
    corners = np.stack([record["p0"].T, record["p1"].T, record["p2"].T], axis=1).astype(np.float64)
    return hit_triangles(corners, record["primitive"], ray)


def sphere_records(records: NDArray[np.void], ray: Ray) -> Hit:
    return hit_spheres(
        records["center"].astype(np.float64), records["radius"].astype(np.float64), records["primitive"], ray
    )


def packed_records(records: NDArray[np.void], ray: Ray) -> Hit:
    return min(pack_record(record, ray) for record in records)


def visit_bvh2(layout: Layout, reference: int, ray: Ray) -> Visit:
    nodes = layout.buffers["nodes"]
    first, count = int(nodes[reference]["left_first"]), int(nodes[reference]["count"])
    if count == 0:
        return [((nodes[i]["aabb_min"], nodes[i]["aabb_max"]), i) for i in (first, first + 1)], MISS
    if count < 0:
        return [], sphere_records(layout.buffers["leaf_spheres"][first : first - count], ray)
    return [], triangle_records(layout.buffers["leaf_triangles"][first : first + count], ray)


def visit_bvh8(layout: Layout, reference: int, ray: Ray) -> Visit:
    if reference >= 0:
        node = layout.buffers["nodes"][reference]
        return [((node["lo"][:, i], node["hi"][:, i]), int(node["child"][i])) for i in range(8)], MISS
    first, sphere, count = ~reference >> 4, ~reference >> 3 & 1, (~reference & 7) + 1
    if sphere:
        return [], sphere_records(layout.buffers["leaf_spheres"][first : first + count], ray)
    record = layout.buffers["packs"][first]
    assert np.count_nonzero(record["primitive"] >= 0) == count
    return [], pack_record(record, ray)


def visit_cwbvh(layout: Layout, reference: int, ray: Ray) -> Visit:
    """Visit a node; references >= 0 are nodes, < 0 are leaves ~(first << 2 | count)."""
    if reference < 0:
        first, count = ~reference >> 2, ~reference & 3
        triangles = len(layout.buffers.get("leaf_triangles", ()))
        if first >= triangles:
            return [], sphere_records(layout.buffers["leaf_spheres"][first - triangles :][:count], ray)
        return [], triangle_records(layout.buffers["leaf_triangles"][first : first + count], ray)
    node = layout.buffers["nodes"][reference]
    step = np.ldexp(1.0, node["exponent"].astype(int) - 127)
    children, child = [], int(node["child"])
    for slot, meta in enumerate(node["meta"].tolist()):
        box = tuple(node["origin"].astype(np.float64) + node[side][:, slot] * step for side in ("lo", "hi"))
        if node["imask"] >> slot & 1:
            children.append((box, child))
            child += 1
        elif meta:
            children.append((box, ~(int(node["primitive"]) + (meta & 31) << 2 | (meta >> 5).bit_count())))
    return children, MISS


def enters(box: Box, ray: Ray) -> bool:
    """Float64 slab test, near and far plane by the direction's sign, widened by far more than the rounding error."""
    near, far = 0.0, np.inf
    for low, high, o, d in zip(box[0].tolist(), box[1].tolist(), *ray):
        if d == 0:
            if not low <= o <= high:
                return False
            continue
        entry, leave = ((low - o) / d, (high - o) / d) if d > 0 else ((high - o) / d, (low - o) / d)
        near, far = max(near, entry * (1 - 1e-12)), min(far, leave * (1 + 1e-12))
    return near <= far


def trace(layout: Layout, ray: Ray) -> Hit:
    """Return the closest hit, with a stack bounded by layout.stack (cwbvh, whose stack holds groups: test_cwbvh)."""
    if layout.name in TREELESS:
        readers = {"leaf_triangles": triangle_records, "packs": packed_records, "leaf_spheres": sphere_records}
        return min([readers[name](records, ray) for name, records in layout.buffers.items()] + [MISS])
    visit = {"bvh2": visit_bvh2, "bvh8": visit_bvh8, "cwbvh": visit_cwbvh}[layout.name]
    stack, closest = [0], MISS
    while stack:
        assert len(stack) <= layout.stack or layout.name == "cwbvh"
        children, hit = visit(layout, stack.pop(), ray)
        closest = min(closest, hit)
        stack += [reference for box, reference in children if enters(box, ray)]
    return closest


@covering("scene, layout, builder", SCENES, LAYOUTS, BUILDERS, strength=2)
def test_rays_hit_what_brute_force_hits(layout: str, builder: str, scene: str) -> None:
    packed = pack(layout, builder, *SCENES[scene])
    expected = [brute_force(*SCENES[scene], ray) for ray in rays()]
    assert [trace(packed, ray) for ray in rays()] == expected
    assert any(hit != MISS for hit in expected) or scene == "nothing"


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("layout", LAYOUTS)
def test_buffers_hold_every_primitive_once(layout: str, scene: str) -> None:
    triangles, balls = SCENES[scene]
    buffers = pack(layout, "sah", triangles, balls).buffers
    names = {"nodes"} if layout not in TREELESS else set()
    names |= {"packs" if layout in ("bvh8", "packs") else "leaf_triangles"} if len(triangles) else set()
    names |= {"leaf_spheres"} if len(balls) else set()
    assert set(buffers) == names

    found = np.concatenate([buffers[name]["primitive"].ravel() for name in sorted(names - {"nodes"})] or [np.empty(0)])
    np.testing.assert_array_equal(np.sort(found[found >= 0]), np.arange(len(triangles) + len(balls)))
    if "packs" in buffers:
        unused = buffers["packs"]["primitive"] < 0
        for name in ("p0", "p1", "p2"):
            assert np.isnan(buffers["packs"][name].transpose(0, 2, 1)[unused]).all()


def test_siblings_of_a_binary_tree_share_a_cache_line() -> None:
    nodes = pack("bvh2", "sah", *SCENES["mixed"]).buffers["nodes"]
    assert (nodes["left_first"][nodes["count"] == 0] % 2 == 0).all()
    assert np.count_nonzero(nodes["count"] == 0) > 50


def test_a_tree_of_nothing_cannot_be_entered() -> None:
    """Neither the root's box nor, if the root is not tested, its children's can be hit."""
    binary, wide, compressed = (
        pack(name, "sah", *SCENES["nothing"]).buffers["nodes"] for name in ("bvh2", "bvh8", "cwbvh")
    )
    first = binary["left_first"][0]
    assert (binary["count"] == 0).all()
    assert (binary["aabb_min"][[0, first, first + 1]] == np.inf).all()
    assert (binary["aabb_max"][[0, first, first + 1]] == -np.inf).all()
    assert (wide["lo"] == np.inf).all() and (wide["hi"] == -np.inf).all() and (wide["child"] == EMPTY).all()
    assert not compressed["meta"].any() and not compressed["imask"].any()
    assert (compressed["lo"] == 255).all() and (compressed["hi"] == 0).all()


def test_records_have_the_sizes_that_the_device_expects() -> None:
    sizes = {
        BVH2_NODE: 32,
        BVH8_NODE: 256,
        LEAF_TRIANGLE: 48,
        LEAF_SPHERE: 32,
        TRIANGLE_PACK: 320,
        LONE_PACK: 704,
        CWBVH_NODE: 80,
    }
    assert all(dtype.itemsize == size for dtype, size in sizes.items())


COORDINATE = st.floats(width=32, allow_nan=False, allow_infinity=False)


@settings(deadline=None)
@given(balls=arrays(np.float32, (5, 4), elements=COORDINATE))
def test_boxes_of_spheres_contain_them(balls: FloatArray) -> None:
    """In exact arithmetic, up to the largest float; and within two float32 ulps of the sphere."""
    balls[:, 3] = np.abs(balls[:, 3])
    toward = np.array([np.inf, -np.inf], np.float32)
    far = Fraction(float(np.finfo(np.float32).max))
    for (*center, size), low, high in zip(balls.tolist(), *sphere_boxes(balls)):
        for c, least, most in zip(center, low, high):
            assert np.isfinite([least, most]).all()
            exact_low, exact_high = Fraction(c) - Fraction(size), Fraction(c) + Fraction(size)
            assert Fraction(float(least)) <= max(exact_low, -far) and Fraction(float(most)) >= min(exact_high, far)
            if abs(exact_low) < far and abs(exact_high) < far:
                inner = np.nextafter(np.nextafter(np.array([least, most]), toward), toward)
                assert Fraction(float(inner[0])) >= exact_low and Fraction(float(inner[1])) <= exact_high


@pytest.mark.parametrize(
    "layout, builder, message",
    [("bvh3", "sah", "'bvh3'.*list, packs, bvh2, bvh8, cwbvh"), ("bvh2", "shah", "'shah'.*sah, midpoint")],
)
def test_unknown_names_are_refused(layout: str, builder: str, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        pack(layout, builder, *SCENES["one"])
