"""Two-level BVHs: every leaf of every instance is reached, and stacks stay within the host's bound."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.accel.layouts import Layout
from clrt.accel.two_level import TwoLevelBvh
from clrt.accel.upper_level import FORMS, upper_level
from clrt.accel.wide import EMPTY
from clrt.device.open import Device

from .cases import NASTY, soup

MESHES = [NASTY["exponential"] * np.float32(1e-30), soup(300), soup(1), soup(9, seed=2)]
WORLD = -1


def in_a_row(count: int) -> NDArray[np.float64]:
    """Return (count, 3, 4) transforms in ever larger steps, which make a deep upper level."""
    to_world = np.tile(np.eye(3, 4), (count, 1, 1))
    to_world[:, 0, 3] = 1.3 ** np.arange(count)
    return to_world


class Records:
    """Two-level BVH read from its records; `seen` collects the instance and primitive of each leaf visited."""

    def __init__(self, device: Device, tree: Layout) -> None:
        buffers = {name: array.read(device) for name, array in tree.buffers.items()}
        self.nodes, self.instances = buffers["nodes"], buffers["instances"]
        leaves = buffers[FORMS[tree.name].leaves]["primitive"]
        self.leaves = leaves.reshape(len(leaves), -1)
        self.seen: list[tuple[int, int]] = []

    def meet(self, instance: int, leaf: int) -> None:
        self.seen += [(instance, primitive) for primitive in self.leaves[leaf].tolist() if primitive >= 0]

    def instance(self, place: int) -> tuple[int, int]:
        """Return the root of an instance's BVH and the instance's index."""
        return int(self.instances["root"][place]), int(self.instances["index"][place])


def most_bvh2(records: Records, node: int, instance: int, waiting: int) -> int:
    """Return the maximum stack size, over all orders, if all nodes below are entered with `waiting` on the stack.

    One child waits while the other is visited.
    """
    count, first = int(records.nodes["count"][node]), int(records.nodes["left_first"][node])
    if count == 0:
        return max(most_bvh2(records, child, instance, waiting + 1) for child in (first, first + 1))
    if instance == WORLD:
        return most_bvh2(records, *records.instance(first), waiting + 1)
    for leaf in range(first, first + count):
        records.meet(instance, leaf)
    return waiting


def most_bvh8(records: Records, reference: int, instance: int, waiting: int) -> int:
    """Return the maximum stack size: children are pushed, then one is popped; an instance's root lies above LEAVE."""
    if reference >= 0:
        children = [child for child in records.nodes["child"][reference].tolist() if child != EMPTY]
        below = [most_bvh8(records, child, instance, waiting + len(children) - 1) for child in children]
        return max(waiting + len(children), *below)
    if instance == WORLD:
        return max(waiting + 2, most_bvh8(records, *records.instance(~reference >> 4), waiting + 1))
    records.meet(instance, ~reference >> 4)
    return waiting


def most_cwbvh(records: Records, node: int, instance: int, waiting: int) -> int:
    """Return the maximum stack size: unvisited nodes of a group wait; in an instance, its outer group and nodes too."""
    record = records.nodes[node]
    inner = [slot for slot in range(8) if record["imask"] >> slot & 1]
    leaves = [meta for slot, meta in enumerate(record["meta"].tolist()) if meta and slot not in inner]
    number = sum((meta >> 5).bit_count() for meta in leaves)
    most = [waiting]
    for primitive in range(int(record["primitive"]), int(record["primitive"]) + number):
        if instance == WORLD:
            most.append(most_cwbvh(records, *records.instance(primitive), waiting + bool(inner) + 1))
        else:
            records.meet(instance, primitive)
    for child in range(int(record["child"]), int(record["child"]) + len(inner)):
        most.append(most_cwbvh(records, child, instance, waiting + (len(inner) > 1)))
    return max(most)


MOST: dict[str, Callable[[Records, int, int, int], int]] = {"bvh2": most_bvh2, "bvh8": most_bvh8, "cwbvh": most_cwbvh}


@pytest.mark.parametrize("kinds", [1, len(MESHES)])
@pytest.mark.parametrize("builder", ["ploc", "sah"])
@pytest.mark.parametrize("layout", FORMS)
def test_stacks_hold_and_all_is_reached(device: Device, layout: str, builder: str, kinds: int) -> None:
    """For one mesh the bound is tight, up to entries in registers; for several the deepest may not be the lowest."""
    mesh = np.arange(60, dtype=np.int32) % kinds
    tree = TwoLevelBvh(device, layout, builder, MESHES[:kinds], mesh).place(in_a_row(len(mesh)))
    records = Records(device, tree)
    most = MOST[layout](records, 0, WORLD, 0)
    assert sorted(records.seen) == [(i, p) for i, m in enumerate(mesh) for p in range(len(MESHES[m]))]
    assert most <= tree.stack and (kinds > 1 or most >= tree.stack - 2)


@pytest.mark.parametrize("layout", FORMS)
def test_the_upper_level_has_room_wherever_instances_are(layout: str) -> None:
    """Any number of instances: apart, in one place, and nested."""
    form = FORMS[layout]
    for count in (0, 1, 2, 3, 8, 9, 70):
        low = np.arange(count, dtype=np.float32)[:, None] * np.ones(3, np.float32)
        for boxes in ((low, low + 1), (0 * low, 0 * low + 1), (-low, low)):
            tree, order = upper_level(form, *boxes)
            assert len(tree.buffers["nodes"]) <= form.room(count)
            assert sorted(order) == list(range(count))
