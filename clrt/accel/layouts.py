"""BVH layouts in device memory. The dtypes here define the records; the C typedefs are generated from them.

Records are rows of three floats and a four-byte scalar, or of eight lanes, without OpenCL vector types, so that host
and device agree on every offset. Triangles are the primitives 0 … m − 1, spheres m … m + s − 1. Degenerate triangles
(without area) are kept but never hit. A scene without triangles, or without spheres, has no buffer for them.

- list: no BVH; leaf_triangles and leaf_spheres in scene order.
- packs: no BVH; packs (of PACK triangles) group by group, and leaf_spheres in scene order.
- bvh2: nodes (BVH2_NODE), leaf_triangles and leaf_spheres in BVH order.
- bvh8: nodes (BVH8_NODE), packs (one per triangle leaf), leaf_spheres in BVH order.
- cwbvh: nodes (cwbvh.CWBVH_NODE), leaf_triangles and leaf_spheres in BVH order.

A BVH layout of a scene without primitives has a root that no ray gets past: its children's boxes are inverted. See Wide
for what that requires of the slab test.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import check_choice
from .builders import BUILDERS
from .bvh import Bvh, FloatArray, IntArray, join
from .cwbvh import MAX_LEAF, compress
from .grouping import packs_of
from .wide import WideBvh, collapse, leaf_fields, leaf_reference

Records = NDArray[np.void]

#: Children of a wide node, and triangles of its packs.
LANES = 8
#: Triangles per pack without a BVH.
PACK = 16

#: `count`: 0 in an interior node, n in a leaf of n triangles, −n in a leaf of n spheres. `left_first`: the leaf's first
#: record, or the left child: always even, so that two siblings share 64 bytes (node 1, next to the root, is unused).
BVH2_NODE = np.dtype([("aabb_min", "f4", 3), ("left_first", "i4"), ("aabb_max", "f4", 3), ("count", "i4")])
#: `child` as in Wide, but the `first` of a triangle leaf is the index of its pack.
BVH8_NODE = np.dtype([("lo", "f4", (3, LANES)), ("hi", "f4", (3, LANES)), ("child", "i4", LANES), ("pad", "i4", LANES)])
LEAF_TRIANGLE = np.dtype(
    [("p0", "f4", 3), ("primitive", "i4"), ("p1", "f4", 3), ("pad1", "i4"), ("p2", "f4", 3), ("pad2", "i4")]
)
#: Padding of a triangle's box, as a fraction of its longest side: the test moves corners by a few roundings of their
#: distance from the ray's origin, and a sliver's corners may be far from the hit point. Also in
#: kernels/build/primitives.cl.
TRIANGLE_PAD = 2.0**-21
#: Unused lanes have NaN vertices and primitive −1.
TRIANGLE_PACK = np.dtype(
    [("p0", "f4", (3, LANES)), ("p1", "f4", (3, LANES)), ("p2", "f4", (3, LANES)), ("primitive", "i4", LANES)]
)
#: lo, hi: the box of its triangles. extent, count: of all packs, the largest absolute coordinate and their number.
LONE_PACK = np.dtype(
    [
        ("p0", "f4", (3, PACK)),
        ("p1", "f4", (3, PACK)),
        ("p2", "f4", (3, PACK)),
        ("primitive", "i4", PACK),
        ("lo", "f4", 3),
        ("hi", "f4", 3),
        ("extent", "f4"),
        ("count", "i4"),
        ("pad", "f4", PACK - 8),
    ]
)
LEAF_SPHERE = np.dtype([("center", "f4", 3), ("radius", "f4"), ("primitive", "i4"), ("pad", "i4", 3)])

#: Maximum primitives per leaf if they are intersected one by one; Nadolny 2026, 5.4.4 for the midpoint.
LEAF_SIZES = {"sah": 4, "midpoint": 2}


@dataclass(frozen=True, eq=False)
class Layout:
    """A scene's primitives and the BVH over them, ready to be copied to a device or already there.

    buffers: records by name, in a numpy array or, from a builder on the device, in a DeviceArray.
    stack: stack entries that a traversal needs (see Tree.stack_bound), 0 without a BVH. builder: its name.
    depth and sah_cost are those of the traversed BVH; build_seconds includes packing. work: sah_cost, or a function
    that computes it, for BVHs in device memory.
    level_sizes: number of nodes per level, from the root, if `nodes` is in level order; else ().
    peak_bytes: peak memory of a builder on the device, 0 for one in numpy.
    """

    name: str
    buffers: Mapping[str, Any]
    stack: int
    nodes: int
    depth: int
    work: float | Callable[[], float]
    build_seconds: float = 0.0
    builder: str = ""
    level_sizes: tuple[int, ...] = ()
    peak_bytes: int = 0

    @cached_property
    def sah_cost(self) -> float:
        """Return the expected cost of a ray that hits the root's box, see Tree.sah_cost."""
        return self.work() if callable(self.work) else self.work

    @property
    def bytes(self) -> int:
        """Return the size of all buffers in bytes."""
        return sum(records.nbytes for records in self.buffers.values())


#: Placeholder if no rays are traced.
NO_RAYS = Layout("none", {}, stack=0, nodes=0, depth=0, work=0.0)


def pack(layout: str, builder: str, triangles: FloatArray, spheres: FloatArray) -> Layout:
    """Build a BVH and pack it.

    layout: a name in LAYOUTS; builder: a name in BUILDERS (unused by list and packs). triangles: (m, 3, 3) float32
    corners; spheres: (s, 4) float32 center and radius; all finite. Raises UsageError for an unknown name, and
    SceneError for more primitives than the layout supports.
    """
    check_choice("layout", layout, LAYOUTS)
    check_choice("builder", builder, BUILDERS)
    started = time.perf_counter()
    packed = LAYOUTS[layout](builder, triangles, spheres)
    return replace(packed, build_seconds=time.perf_counter() - started, builder=builder)


def _list(builder: str, triangles: FloatArray, spheres: FloatArray) -> Layout:
    buffers = _filled(
        leaf_triangles=_leaf_triangles(triangles, np.arange(len(triangles), dtype=np.int32)),
        leaf_spheres=leaf_spheres(spheres, np.arange(len(spheres), dtype=np.int32), len(triangles)),
    )
    return Layout("list", buffers, stack=0, nodes=0, depth=0, work=float(len(triangles) + len(spheres)))


def _packs(builder: str, triangles: FloatArray, spheres: FloatArray) -> Layout:
    low, high = triangle_boxes(triangles)
    parts = packs_of(low, high, PACK)
    count = np.array([len(part) for part in parts], np.int32)
    order = np.concatenate(parts) if parts else np.zeros(0, np.int32)
    packs = _filled_packs(LONE_PACK, triangles, order, np.cumsum(count, dtype=np.int32) - count, count)
    for record, part in zip(packs, parts):
        record["lo"], record["hi"] = low[part].min(axis=0), high[part].max(axis=0)
    packs["extent"], packs["count"] = np.abs(triangles).max(initial=0.0), len(packs)
    every = np.arange(len(spheres), dtype=np.int32)
    buffers = _filled(packs=packs, leaf_spheres=leaf_spheres(spheres, every, len(triangles)))
    return Layout("packs", buffers, stack=0, nodes=0, depth=0, work=float(len(packs) + len(spheres)))


def _bvh2(builder: str, triangles: FloatArray, spheres: FloatArray) -> Layout:
    tree = _tree(builder, triangles, spheres, LEAF_SIZES[builder], 1)
    buffers = _filled(
        leaf_triangles=_leaf_triangles(triangles, tree.order),
        leaf_spheres=leaf_spheres(spheres, tree.sphere_order, len(triangles)),
    )
    return Layout(
        "bvh2",
        {"nodes": bvh2_nodes(tree)} | buffers,
        stack=tree.stack_bound,
        nodes=len(tree.count),
        depth=tree.depth,
        work=tree.sah_cost(),
        level_sizes=_level_sizes(tree),
    )


def _bvh8(builder: str, triangles: FloatArray, spheres: FloatArray) -> Layout:
    wide = collapse(_tree(builder, triangles, spheres, LANES, LANES), LANES, LANES)
    leaf = wide.child < 0
    first, sphere, count = leaf_fields(wide.child[leaf])
    packs = _filled_packs(TRIANGLE_PACK, triangles, wide.order, first[~sphere], count[~sphere])
    first[~sphere] = np.arange(len(packs))
    child = wide.child.copy()
    child[leaf] = leaf_reference(first, sphere, count)
    nodes = wide_nodes(wide, child)
    buffers = _filled(packs=packs, leaf_spheres=leaf_spheres(spheres, wide.sphere_order, len(triangles)))
    return Layout(
        "bvh8",
        {"nodes": nodes} | buffers,
        stack=wide.stack_bound,
        nodes=len(nodes),
        depth=wide.depth,
        work=wide.sah_cost(LANES),
        level_sizes=_level_sizes(wide),
    )


def _cwbvh(builder: str, triangles: FloatArray, spheres: FloatArray) -> Layout:
    # A leaf costs as much as a node, regardless of its size: a third fewer nodes than at a cost of 1 per triangle, and
    # as fast.
    tree = compress(_tree(builder, triangles, spheres, MAX_LEAF, MAX_LEAF))
    buffers = _filled(
        leaf_triangles=_leaf_triangles(triangles, tree.order),
        leaf_spheres=leaf_spheres(spheres, tree.sphere_order, len(triangles)),
    )
    return Layout(
        "cwbvh",
        {"nodes": tree.nodes} | buffers,
        stack=tree.stack,
        nodes=len(tree.nodes),
        depth=tree.wide.depth,
        work=tree.wide.sah_cost(MAX_LEAF),
    )


LAYOUTS: dict[str, Callable[[str, FloatArray, FloatArray], Layout]] = {
    "list": _list,
    "packs": _packs,
    "bvh2": _bvh2,
    "bvh8": _bvh8,
    "cwbvh": _cwbvh,
}


def _tree(builder: str, triangles: FloatArray, spheres: FloatArray, leaf_size: int, lanes: int) -> Bvh:
    """Build one BVH over both kinds; triangles are intersected `lanes` at a time, spheres one by one."""
    build = BUILDERS[builder]
    return join(
        build(*triangle_boxes(triangles), leaf_size, lanes),
        build(*sphere_boxes(spheres), min(LEAF_SIZES[builder], leaf_size), 1),
    )


def triangle_boxes(triangles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return aabb_min, aabb_max (m, 3) float32 of triangles (m, 3, 3), padded for their test: see TRIANGLE_PAD."""
    p0, p1, p2 = triangles.transpose(1, 0, 2)
    low, high = np.minimum(np.minimum(p0, p1), p2), np.maximum(np.maximum(p0, p1), p2)
    pad = TRIANGLE_PAD * (high - low).max(axis=1, keepdims=True, initial=0).astype(np.float64)
    return (low - pad).astype(np.float32), (high + pad).astype(np.float32)


def sphere_boxes(spheres: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return aabb_min, aabb_max (s, 3) float32, finite, that contain the spheres (s, 4): rounded outward."""
    center, radius = spheres[:, :3].astype(np.float64), spheres[:, 3:].astype(np.float64)
    far = np.finfo(np.float32).max
    inside = np.nextafter(far, np.float32(0))
    low, high = (np.clip(edge, -inside, inside).astype(np.float32) for edge in (center - radius, center + radius))
    return np.nextafter(low, -far), np.nextafter(high, far)


def _level_sizes(tree: Bvh | WideBvh) -> tuple[int, ...]:
    levels = list(tree.levels())
    nodes = np.concatenate(levels)
    return tuple(map(len, levels)) if np.array_equal(nodes, np.arange(len(nodes))) else ()


def bvh2_nodes(tree: Bvh) -> Records:
    """Return the nodes of the layout bvh2."""
    links = np.where(tree.leaf, tree.left_first, tree.left_first + (tree.left_first > 0))
    nodes = np.zeros(1 + len(tree.count), BVH2_NODE)
    for name, values in (
        ("aabb_min", tree.aabb_min),
        ("aabb_max", tree.aabb_max),
        ("left_first", links),
        ("count", np.where(tree.spheres, -tree.count, tree.count)),
    ):
        nodes[name][0], nodes[name][2:] = values[0], values[1:]
    nodes[1]["aabb_min"], nodes[1]["aabb_max"] = np.inf, -np.inf
    return nodes


def wide_nodes(wide: WideBvh, child: IntArray) -> Records:
    """Return the nodes of the layout bvh8 with the boxes of `wide` and references `child` (k, 8)."""
    nodes = np.zeros(len(child), BVH8_NODE)
    nodes["lo"], nodes["hi"] = wide.aabb_min.transpose(0, 2, 1), wide.aabb_max.transpose(0, 2, 1)
    nodes["child"] = child
    return nodes


def _filled(**buffers: Records) -> dict[str, Records]:
    return {name: records for name, records in buffers.items() if len(records)}


def _leaf_triangles(triangles: FloatArray, order: IntArray) -> Records:
    records = np.zeros(len(order), LEAF_TRIANGLE)
    for corner, name in enumerate(("p0", "p1", "p2")):
        records[name] = triangles[order, corner]
    records["primitive"] = order
    return records


def leaf_spheres(spheres: FloatArray, order: IntArray, first_primitive: int) -> Records:
    """Return LEAF_SPHERE records of spheres (s, 4) float32 in this order, numbered from `first_primitive` on."""
    records = np.zeros(len(order), LEAF_SPHERE)
    records["center"], records["radius"] = spheres[order, :3], spheres[order, 3]
    records["primitive"] = first_primitive + order
    return records


def _filled_packs(
    dtype: np.dtype[np.void], triangles: FloatArray, order: IntArray, first: IntArray, count: IntArray
) -> Records:
    """Pack the triangles order[first:first + count] of each leaf."""
    lane = np.arange(dtype["primitive"].shape[0], dtype=np.int32)
    live = lane < count[:, None]
    primitive = np.where(live, order[np.where(live, first[:, None] + lane, 0)], -1)
    packs = np.zeros(len(first), dtype)
    for corner, name in enumerate(("p0", "p1", "p2")):
        packs[name] = np.where(live[..., None], triangles[primitive, corner], np.nan).transpose(0, 2, 1)
    packs["primitive"] = primitive
    return packs
