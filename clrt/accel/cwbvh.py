"""Compressed wide BVH: eight children per node in 80 bytes, in an order that rays traverse without sorting.

Ylitie, Karras, Laine 2017, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs"; `collapse` is its
3.1, `octant_slots` its 3.2. Intersection of a ray with such a node: kernels/traverse/cwbvh.cl.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .bvh import BoolArray, Bvh, FloatArray, IntArray
from .wide import EMPTY, WideBvh, collapse, leaf_fields

Bytes = NDArray[np.uint8]
Records = NDArray[np.void]

SLOTS = 8
#: Maximum number of primitives per leaf: `meta` counts them in three bits.
MAX_LEAF = 3

#: Node 0 is the root. Read as five uint4, in little-endian byte order.
#:
#: origin: p, the minimum corner of the box around the children.
#: exponent: of the quantisation step s per axis, biased as in float32: s = 2^(exponent − 127), exponent in 1 … 254.
#: lo, hi: [axis][slot], the children's boxes p + lo·s … p + hi·s. They enclose the children up to one float32 rounding
#:     of a plane's distance from p, which the traversal's padding covers: lo·s ≤ fl(min − p), hi·s ≥ fl(max − p).
#: imask: bit i is set if slot i holds a node.
#: child: index of the first child node; the others follow it in the order of their slots.
#: primitive: index of the node's first primitive. Primitives are numbered consecutively: triangle i of `leaf_triangles`
#:     is i, sphere i of `leaf_spheres` is i + the number of triangles.
#: meta: of a slot with a node, 1 << 5 | 24 + slot. Of a leaf, its count in unary (001, 011, 111) << 5 | the offset of
#:     its first primitive from `primitive`, 0 … 23. 0 in an empty slot, which no ray enters; there lo = 255 and hi = 0.
#:
#: A node's primitives are contiguous, its leaves in any order. Hence at most one node, the root, has leaves of both
#: kinds; its triangles are the last ones and its spheres the first. Any slot may hold any child: the order of
#: `octant_slots` only makes rays visit near children first.
CWBVH_NODE = np.dtype(
    [
        ("origin", "f4", 3),
        ("exponent", "u1", 3),
        ("imask", "u1"),
        ("child", "u4"),
        ("primitive", "u4"),
        ("meta", "u1", SLOTS),
        ("lo", "u1", (3, SLOTS)),
        ("hi", "u1", (3, SLOTS)),
    ]
)

#: (slot, axis): the corner of a node that a slot corresponds to; bit a of the slot is set on the high side of axis a.
_CORNERS = np.where(np.arange(SLOTS)[:, None] >> np.arange(3) & 1, 1.0, -1.0)


@dataclass(frozen=True, eq=False)
class CompressedBvh:
    """A BVH as records. order, sphere_order: (m,), (s,) int32, the primitives in the records' numbering.

    stack: maximum number of node groups on the stack (see stack_bound). wide: the BVH before compression, with its
    slots and nodes in the records' order.
    """

    nodes: Records
    order: IntArray
    sphere_order: IntArray
    stack: int
    wide: WideBvh


def compress(tree: Bvh) -> CompressedBvh:
    """Compress a binary BVH whose leaves have up to MAX_LEAF primitives. Raises SceneError as `collapse` does."""
    wide = in_slots(collapse(tree, SLOTS))
    nodes = np.zeros(len(wide.child), CWBVH_NODE)
    nodes["origin"], nodes["exponent"], lo, hi = quantise(wide.aabb_min, wide.aabb_max)
    nodes["lo"], nodes["hi"] = lo.transpose(0, 2, 1), hi.transpose(0, 2, 1)
    interior, slot = wide.interior, np.arange(SLOTS)
    nodes["imask"] = (interior << slot).sum(axis=1)
    inner = np.count_nonzero(interior, axis=1)
    nodes["child"] = 1 + np.cumsum(inner) - inner
    nodes["meta"][interior] = (1 << 5 | 24 + np.broadcast_to(slot, interior.shape))[interior]
    order, sphere_order = _number_primitives(wide, nodes)
    return CompressedBvh(nodes, order, sphere_order, stack_bound(wide), wide)


def octant_slots(offset: NDArray[np.float64], used: BoolArray) -> IntArray:
    """Assign the children to slots, (k, 8), −1 for none, so that rays of any direction visit near children first.

    offset: (k, 8, 3), child's center − node's center; used: (k, 8), which children exist. A ray whose direction is
    negative on the axes of the bits of i visits the slots in the order of slot ^ i, so slot i should hold the child
    farthest towards its corner. Greedily, the pair of remaining child and slot with the largest offset · corner is
    assigned, the lowest child and slot on ties. (The optimal assignment costs more and made no measured ray faster.)
    """
    gain = np.where(used[:, :, None], offset @ _CORNERS.T, -np.inf).reshape(len(offset), -1)
    slots, row = np.full(used.shape, -1, np.int32), np.arange(len(offset))
    for _ in range(SLOTS):
        pick = gain.argmax(axis=1)
        child, slot = np.divmod(pick, SLOTS)
        left = gain[row, pick] > -np.inf
        slots[row[left], slot[left]] = child[left]
        pairs = gain.reshape(-1, SLOTS, SLOTS)
        pairs[row, child], pairs[row, :, slot] = -np.inf, -np.inf
    return slots


def quantise(aabb_min: FloatArray, aabb_max: FloatArray) -> tuple[FloatArray, Bytes, Bytes, Bytes]:
    """Quantise children's boxes (k, 8, 3): return origin (k, 3), exponent (k, 3), lo and hi (k, 8, 3) of CWBVH_NODE.

    Inverted boxes are empty slots. The step is the power of two above extent / 255, which always suffices, and the
    smallest normal number for extent 0. The distances are float64, so nothing overflows and the quantised boxes are
    conservative.
    """
    used = np.all(aabb_min <= aabb_max, axis=2)
    origin = np.where(used.any(axis=1)[:, None], aabb_min.min(axis=1), np.float32(0))
    low, high = (_doubles(boxes, used) - _doubles(origin[:, None], used) for boxes in (aabb_min, aabb_max))
    exponent = ((high.max(axis=1) / 255).astype(np.float32).view(np.uint32) >> 23) + 1
    step = np.ldexp(1.0, exponent.astype(np.int32) - 127)[:, None]
    lo, hi = np.where(used[..., None], np.floor(low / step), 255), np.where(used[..., None], np.ceil(high / step), 0)
    return origin, exponent.astype(np.uint8), lo.astype(np.uint8), hi.astype(np.uint8)


def in_slots(wide: WideBvh) -> WideBvh:
    """Return the BVH with every node's children in their octants' slots, and nodes in breadth-first order again."""
    used = wide.child != EMPTY
    low, high = wide.aabb_min.min(axis=1, keepdims=True), wide.aabb_max.max(axis=1, keepdims=True)
    twice = [_doubles(a, used) + _doubles(b, used) for a, b in ((wide.aabb_min, wide.aabb_max), (low, high))]
    slots = octant_slots(twice[0] - twice[1], used)  # −1 selects the last child, which is then unused
    child = np.take_along_axis(wide.child, slots, axis=1)
    nodes = np.concatenate(list(replace(wide, child=child).levels()))
    interior = (child >= 0) & (child != EMPTY)
    child[interior] = np.argsort(nodes)[child[interior]]
    low, high = (np.take_along_axis(boxes, slots[..., None], axis=1)[nodes] for boxes in (wide.aabb_min, wide.aabb_max))
    return replace(wide, aabb_min=low, aabb_max=high, child=child[nodes])


def _doubles(boxes: FloatArray, used: BoolArray) -> NDArray[np.float64]:
    """Return children's boxes, (k, 8 or 1, 3), as (k, 8, 3) float64, 0 in unused slots."""
    return np.where(used[..., None], boxes.astype(np.float64), 0.0)


def stack_bound(wide: WideBvh) -> int:
    """Return the maximum number of node groups on the stack of a traversal.

    The child nodes of a node that a ray enters are one group, which is on the stack while one of them is visited if
    others remain. So a path down the BVH leaves a group at each node with two or more child nodes.
    """
    waiting, inner = np.zeros(len(wide.child), np.intp), np.count_nonzero(wide.interior, axis=1)
    for nodes in wide.levels():
        below = wide.child[nodes][wide.interior[nodes]]
        waiting[below] = np.repeat(waiting[nodes] + (inner[nodes] > 1), inner[nodes])
    return int(waiting.max())


def _number_primitives(wide: WideBvh, nodes: Records) -> tuple[IntArray, IntArray]:
    """Fill `primitive`, and `meta` of leaves; return the triangles and the spheres in the order of their numbers."""
    row, slot = np.nonzero(wide.child < 0)
    first, sphere, count = leaf_fields(wide.child[row, slot])
    # Triangles before spheres, node by node, but the root's triangles last: the root may have leaves of both kinds.
    place = np.lexsort((slot, row, (row == 0) & ~sphere, sphere))
    row, slot, first, sphere, count = row[place], slot[place], first[place], sphere[place], count[place]
    number = np.cumsum(count) - count
    nodes["primitive"][row[::-1]] = number[::-1]  # the last assignment, that of a node's first leaf, remains
    nodes["meta"][row, slot] = (1 << count) - 1 << 5 | number - nodes["primitive"][row]
    source = np.arange(count.sum()) + np.repeat(first - number, count)
    triangles = len(wide.order)
    return wide.order[source[:triangles]], wide.sphere_order[source[triangles:]]
