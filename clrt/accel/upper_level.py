"""The upper level of a two-level BVH: a BVH over boxes with instances as leaves, for each layout that supports one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from .builders import BUILDERS
from .bvh import Bvh, FloatArray, IntArray
from .cwbvh import CWBVH_NODE, compress
from .layouts import BVH2_NODE, BVH8_NODE, LANES, Layout, Records, bvh2_nodes, wide_nodes
from .wide import EMPTY, collapse, leaf_fields


class UpperLevelLayout(NamedTuple):
    """Requirements of two-level BVHs on a layout.

    node: its record. leaves: the buffer of leaves. room: the maximum number of nodes of a BVH over this many instances.
    pack: packs a BVH with one instance per leaf; also returns the instance for each leaf number, (k,).
    shift: adds offsets to all references to nodes and to leaf records of triangles, in place. References to spheres
    count from the first sphere and stay, but in cwbvh from the first triangle, and so move with the last mesh's
    triangles.
    """

    node: np.dtype[np.void]
    leaves: str
    room: Callable[[int], int]
    pack: Callable[[Bvh], tuple[Layout, IntArray]]
    shift: Callable[[Records, int, int], None]


def upper_level(form: UpperLevelLayout, aabb_min: FloatArray, aabb_max: FloatArray) -> tuple[Layout, IntArray]:
    """Return the BVH over k instances' boxes (k, 3), with only the buffer `nodes`, and its order as in Form.pack."""
    tree = BUILDERS["sah"](aabb_min, aabb_max, 1, 1)
    leaves = tree.left_first.copy()
    leaves[tree.leaf] = tree.order[leaves[tree.leaf]]
    return form.pack(replace(tree, left_first=leaves, order=np.arange(len(tree.order), dtype=np.int32)))


def _bvh2(tree: Bvh) -> tuple[Layout, IntArray]:
    layout = Layout("bvh2", {"nodes": bvh2_nodes(tree)}, tree.stack_bound, len(tree.count), tree.depth, tree.sah_cost())
    return layout, tree.order


def _bvh8(tree: Bvh) -> tuple[Layout, IntArray]:
    wide = collapse(tree, LANES)
    layout = Layout(
        "bvh8", {"nodes": wide_nodes(wide, wide.child)}, wide.stack_bound, len(wide.child), wide.depth, wide.sah_cost()
    )
    return layout, wide.order


def _cwbvh(tree: Bvh) -> tuple[Layout, IntArray]:
    packed = compress(tree)
    # One more stack entry: while a node's instances are visited, all of its child nodes are on the stack.
    layout = Layout(
        "cwbvh", {"nodes": packed.nodes}, packed.stack + 1, len(packed.nodes), packed.wide.depth, packed.wide.sah_cost()
    )
    return layout, packed.order


def _shift_bvh2(nodes: Records, first_node: int, first_leaf: int) -> None:
    nodes["left_first"] += np.where(
        nodes["count"] == 0, np.int32(first_node), np.where(nodes["count"] > 0, np.int32(first_leaf), np.int32(0))
    )


def _shift_bvh8(nodes: Records, first_node: int, first_leaf: int) -> None:
    child = nodes["child"]
    leaf, interior = (child < 0) & ~leaf_fields(child)[1], (child >= 0) & (child != EMPTY)
    child[leaf] -= np.int32(first_leaf << 4)
    child[interior] += np.int32(first_node)


def _shift_cwbvh(nodes: Records, first_node: int, first_leaf: int) -> None:
    nodes["child"] += np.uint32(first_node)
    nodes["primitive"] += np.uint32(first_leaf)


def _wide_room(instances: int) -> int:
    return max(1, instances - 1)  # the root, and nodes of at least two children


def _binary_room(instances: int) -> int:
    return max(2, 2 * instances)  # with the unused node 1; even, so that siblings below stay side by side


#: Forms by layout.
FORMS = {
    "bvh2": UpperLevelLayout(BVH2_NODE, "leaf_triangles", _binary_room, _bvh2, _shift_bvh2),
    "bvh8": UpperLevelLayout(BVH8_NODE, "packs", _wide_room, _bvh8, _shift_bvh8),
    "cwbvh": UpperLevelLayout(CWBVH_NODE, "leaf_triangles", _wide_room, _cwbvh, _shift_cwbvh),
}
