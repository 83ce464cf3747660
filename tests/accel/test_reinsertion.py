"""Reinsertion on every device keeps BVHs valid, never increases the area, and always makes the best single move."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from clrt.accel.bvh import FloatArray, half_area
from clrt.accel.device_builder import SHAPES, program_source
from clrt.accel.morton import sort_primitives
from clrt.accel.ploc import BINARY_NODE, BinaryTree
from clrt.accel.reinsertion import DEEP, reinsert
from clrt.device.launches.data_parallel import DataParallel
from clrt.device.open import Device

from ..covering import others
from .cases import NO_SPHERES, SCENES, edges, soup
from .device_trees import Binary, binary, like_gpu

Children = list[list[int]]


@pytest.mark.parametrize("case", [*SCENES][::4] + others(*(case for case in SCENES if case not in [*SCENES][::4])))
def test_trees_stay_sound_and_their_area_never_grows(device: Device, case: str) -> None:
    before = binary(device, "bvh8", case)
    deepest, area = max(before.depth, DEEP), before.total_area
    for passes in (1, 2, 5):
        tree = binary(device, "bvh8", case, passes)
        tree.check()
        assert tree.depth <= 1.5 * deepest
        assert tree.total_area <= area
        area = tree.total_area


@cache
def first_result(case: str) -> list[bytes]:
    """Hold the result of the device that is tested first."""
    return []


@pytest.mark.parametrize("case", ["mixed", *others("blocks", "duplicates", "long_diagonals")])
def test_the_same_tree_again_and_everywhere(device: Device, case: str) -> None:
    ways = device, device, like_gpu(device)
    first_result(case).extend(binary(way, "bvh8", case, 3).nodes.tobytes() for way in ways)
    assert len(set(first_result(case))) == 1


def total_area(below: Children, low: FloatArray, high: FloatArray) -> float:
    """Return half the area of all nodes of a BVH whose node numbers follow the primitives'; the root is the last."""

    def of(node: int) -> tuple[FloatArray, FloatArray, float]:
        if node < len(low):
            return low[node], high[node], 0.0
        (a, b, area), (c, d, more) = of(below[node - len(low)][0]), of(below[node - len(low)][1])
        union = np.minimum(a, c), np.maximum(b, d)
        return *union, area + more + float(half_area(*union))

    return of(len(low) + len(below) - 1)[2]


def moves(below: Children, count: int) -> Iterator[Children]:
    """Yield the BVHs made by moving one subtree to any node that is not its ancestor."""
    parent = {child: count + k for k, children in enumerate(below) for child in children}
    root = count + len(below) - 1

    def above(node: int) -> set[int]:
        return {node} | (above(parent[node]) if node in parent else set())

    for moved, p in parent.items():
        for target in parent:
            if p != root and moved not in above(target) and target not in above(moved):
                (sibling,) = set(below[p - count]) - {moved}
                after = [[sibling if child == p else child for child in children] for children in below]
                after = [[p if child == target else child for child in children] for children in after]
                after[p - count] = [target, moved]
                yield after


@pytest.mark.parametrize("seed", [*range(3), *others(*range(3, 10))])
def test_the_best_move_is_always_made(device: Device, seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Start from random merges of subtrees; a pass gains at least as much as the best single move."""
    monkeypatch.setattr("clrt.accel.reinsertion.TOPMOST", 1)
    count, rng = 12, np.random.default_rng(seed)
    triangles = soup(count, seed=seed)
    nodes, roots = np.zeros(count - 1, BINARY_NODE), [~i for i in range(count)]
    for node in range(count - 1):
        nodes[node]["left"], nodes[node]["right"] = (roots.pop(rng.integers(len(roots))) for _ in range(2))
        roots.append(node)

    work = DataParallel(device, program_source(SHAPES["bvh8"], True, False, True))
    primitives = sort_primitives(work, triangles, NO_SPHERES)
    corners = triangles[work.download(primitives.ids, np.uint32, count)]
    after = reinsert(work, primitives, BinaryTree(work.upload(nodes), [1] * (count - 1)), 1)
    tree = Binary(
        work.download(after.nodes, BINARY_NODE, after.count), after.rounds, np.zeros(count, bool), *edges(corners)
    )
    tree.check()
    below = replace(tree, nodes=nodes).below.tolist()
    best = min(total_area(moved, tree.low, tree.high) for moved in moves(below, count))
    assert tree.total_area <= best * (1 + 1e-6) < total_area(below, tree.low, tree.high)
