"""Optimise a binary BVH on the device by parallel reinsertion of subtrees (kernels/build/reinsert.cl, levels.cl)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pyopencl as cl

from ..device.launches.data_parallel import DataParallel
from ..device.programs.struct_types import record
from .morton import Primitives
from .ploc import BINARY_NODE, BinaryTree

MOVE = record(moved="i4", target="i4", pivot="i4", gain="f4")
#: Reinsertion is tried for the children of one in TOPMOST nodes, from the root down.
TOPMOST = 10
#: How often moves that lost to conflicting moves compete again.
ROUNDS = 3
STEPS = 5
#: Shallower BVHs may grow to this depth.
DEEP = 64


@dataclass(frozen=True, eq=False)
class LevelOrderBvh:
    """A BVH in level order, root last, with the parents of all nodes and then of all primitives.

    parents: (nodes + primitives,) uint32. levels: (nodes,) uint32, depth | height << 16.
    """

    tree: BinaryTree
    parents: cl.Buffer
    levels: cl.Buffer


def reinsert(work: DataParallel, primitives: Primitives, tree: BinaryTree, passes: int) -> BinaryTree:
    """Return the BVH after some passes of moving subtrees to reduce the sum of surface areas. Frees `tree`.

    A pass never increases the sum. Leaves become at most 1.5 times as deep as they were, or DEEP.
    """
    leveled = _level(work, primitives, tree)
    deepest = max(DEEP, len(leveled.tree.rounds))
    for _ in range(passes):
        _move(work, primitives, leveled, deepest)
        work.free(leveled.parents, leveled.levels)
        leveled = _level(work, primitives, leveled.tree)
    work.free(leveled.parents, leveled.levels)
    return leveled.tree


def _level(work: DataParallel, primitives: Primitives, tree: BinaryTree) -> LevelOrderBvh:
    """Sort a BVH into level order and recompute its boxes; frees `tree`, whose root must be its last node."""
    root, listed = tree.count - 1, work.empty(np.uint32, tree.count)
    nodes, levels = work.empty(BINARY_NODE, tree.count), work.empty(np.uint32, tree.count)
    parents = work.empty(np.uint32, tree.count + primitives.count)
    sizes: list[int] = []
    below = 1
    while below:
        counts = work.empty(np.uint32, work.number(below))
        work.run("count_below", below, tree.nodes, root, listed, sum(sizes), counts)
        work.scan(counts, work.number(below))
        work.run(
            "write_binary_level",
            below,
            tree.nodes,
            root,
            listed,
            sum(sizes),
            len(sizes),
            counts,
            nodes,
            parents,
            levels,
        )
        work.free(counts)
        sizes.append(below)
        (below,) = work.sums()
    work.free(tree.nodes, listed)
    sizes.reverse()
    for first, count in zip(np.cumsum([0, *sizes]), sizes):
        work.run_each("refit_nodes", count, *primitives.arguments, nodes, int(first), levels)
    return LevelOrderBvh(BinaryTree(nodes, sizes), parents, levels)


def _move(work: DataParallel, primitives: Primitives, leveled: LevelOrderBvh, deepest: int) -> None:
    """Find moves and apply those that win over conflicting ones; the boxes are then out of date."""
    tree = leveled.tree
    places, count = tree.count + primitives.count, 2 * -(-tree.count // TOPMOST)
    arguments = tree.nodes, leveled.parents, leveled.levels, tree.count - 1
    moves, gains, owners = work.empty(MOVE, count), work.zeros(np.uint32, places), work.zeros(np.uint32, places)
    work.run_each("find_moves", count, *primitives.arguments, *arguments, deepest, moves)
    for step in range(ROUNDS * STEPS):
        work.run_each("match_moves", count, *arguments, step % STEPS, moves, gains, owners)
    work.run_each("make_moves", count, *arguments, moves)
    work.free(moves, gains, owners)
