"""Binary trees made on the device, by parallel locally-ordered clustering (kernels/build/ploc.cl)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pyopencl as cl

from ..device.blocks import Blocks
from ..device.records import record
from .tree import FloatArray

BINARY_NODE = record(lo="3f4", left="i4", hi="3f4", right="i4")
#: How far clusters look for partners, and how many are left to a single work-item: as in ploc.cl.
RADIUS, FEW = 8, 32
#: A round that joins fewer than one cluster in SLOW is followed by one that joins all neighbours, so that depth and time
#: are bounded for any input, nested boxes included.
SLOW = 16
CODE_BITS, DIGIT_BITS = 64, 8
CELLS = (1 << 21) - 1


@dataclass(frozen=True, eq=False)
class Primitives:
    """Triangles (m, 3, 3) and spheres (s, 4) on the device; `count` = m + s."""

    triangles: cl.Buffer
    spheres: cl.Buffer
    triangle_count: int
    count: int

    @property
    def arguments(self) -> Sequence[cl.Buffer | int]:
        """What stands for PRIMITIVE_PARAMETERS."""
        return self.triangles, self.spheres, self.triangle_count


@dataclass(frozen=True, eq=False)
class BinaryTree:
    """count − 1 nodes of BINARY_NODE, the root last; a child >= 0 is a node, ~p < 0 is primitive p.

    parents: (2 count − 1,) int32, of the nodes and then of the primitives, −1 for the root.
    order: (count,) uint32, the primitives with neighbours close together.
    """

    nodes: cl.Buffer
    parents: cl.Buffer
    order: cl.Buffer
    count: int

    @property
    def root(self) -> int:
        """Index of the root."""
        return self.count - 2


def cluster(work: Blocks, primitives: Primitives) -> BinaryTree:
    """The tree over at least two primitives."""
    count = primitives.count
    order = morton_order(work, primitives)
    pitch = count + 2 * RADIUS
    boxes, ids = ([work.empty(np.float32, 6 * pitch), work.empty(np.int32, count)] for _ in range(2))
    now, later = boxes, ids
    nearest = work.empty(np.uint32, count)
    nodes, parents = work.empty(BINARY_NODE, count - 1), work.empty(np.int32, 2 * count - 1)
    work.run("first_clusters", count, *primitives.arguments, order, *now, pitch)
    made, clusters, forced = 0, count, False
    while clusters > FEW:
        work.run("pair_clusters", clusters, nearest) if forced else work.run(
            "nearest_clusters", clusters, now[0], pitch, nearest)
        offsets = work.empty(np.uint32, 2 * work.number(clusters))
        work.run("count_pairs", clusters, nearest, offsets)
        stay, joined = map(int, work.scan(offsets, work.number(clusters), 2))
        work.run("join_pairs", clusters, nearest, offsets, work.totals, *now, pitch, *later, nodes, parents, made,
                 count - 1)
        work.free(offsets)
        forced = joined * SLOW < clusters
        made, clusters, now, later = made + joined, stay, later, now
    work.run("join_few", clusters, *now, pitch, nodes, parents, made, count - 1)
    work.free(*now, *later, nearest)
    return BinaryTree(nodes, parents, order, count)


def morton_order(work: Blocks, primitives: Primitives) -> cl.Buffer:
    """(count,) uint32, the primitives along a space-filling curve through the centres of their boxes."""
    count = primitives.count
    codes, order = [work.empty(np.uint64, count) for _ in range(2)], [work.empty(np.uint32, count) for _ in range(2)]
    low, extent = _centre_bounds(work, primitives)
    scale = float(np.float32(CELLS / extent)) if extent > 0 else 0.0
    work.run("morton_codes", count, *primitives.arguments, *low.tolist(), scale, codes[0], order[0])
    blocks = work.number(count)
    digits = work.empty(np.uint32, blocks << DIGIT_BITS)
    for shift in range(0, CODE_BITS, DIGIT_BITS):
        work.run("count_digits", count, codes[0], shift, digits)
        work.scan(digits, blocks << DIGIT_BITS)
        work.run("move_digits", count, codes[0], order[0], shift, digits, codes[1], order[1])
        codes.reverse()
        order.reverse()
    work.free(*codes, order[1], digits)
    return order[0]


def _centre_bounds(work: Blocks, primitives: Primitives) -> tuple[FloatArray, float]:
    """Twice the lowest centre (3,) float32, and twice the largest extent of the centres."""
    blocks = work.number(primitives.count)
    partial = work.empty(np.float32, 6 * blocks)
    work.run("centre_bounds", primitives.count, *primitives.arguments, partial)
    bounds = work.download(partial, np.float32, 6 * blocks).reshape(-1, 6)
    work.free(partial)
    low, high = bounds[:, :3].min(axis=0), bounds[:, 3:].max(axis=0)
    return low, float((high - low).max())
