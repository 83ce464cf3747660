"""Trees that were built on a device, brought to the host."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from clrt.accel.device_builder import SHAPES, DeviceTree, build_tree, program_source
from clrt.accel.layouts import BVH8_NODE, LEAF_SPHERE, TRIANGLE_PACK, sphere_boxes
from clrt.accel.morton import sort_primitives
from clrt.accel.ploc import BINARY_NODE, cluster
from clrt.accel.reinsertion import reinsert
from clrt.accel.tree import FloatArray, half_area
from clrt.accel.wide import Wide, leaf_fields, leaf_reference
from clrt.device.blocks import Blocks
from clrt.device.open import Device

from .cases import SCENES

Records = NDArray[np.void]


@dataclass(frozen=True)
class Built:
    """A tree of the layout bvh8 and its records; `wide.order` lists the packs' eight lanes one after another."""

    tree: DeviceTree
    nodes: Records
    packs: Records
    spheres: Records
    first_sphere: int

    @cached_property
    def wide(self) -> Wide:
        child = self.nodes["child"].copy()
        first, sphere, count = leaf_fields(child[child < 0])
        child[child < 0] = leaf_reference(np.where(sphere, first, 8 * first).astype(np.int32), sphere, count)
        return Wide(self.nodes["lo"].transpose(0, 2, 1), self.nodes["hi"].transpose(0, 2, 1), child,
                    self.packs["primitive"].ravel(), self.spheres["primitive"] - np.int32(self.first_sphere))


@lru_cache(maxsize=None)
def built(device: Device, case: str) -> Built:
    triangles, balls = SCENES[case]
    tree = build_tree(device, SHAPES["bvh8"], triangles, balls)
    records = [np.empty(count, dtype) for count, dtype in zip(tree.counts, (BVH8_NODE, TRIANGLE_PACK, LEAF_SPHERE))]
    for values, array in zip(records, tree.arrays):
        if len(values):
            cl.enqueue_copy(device.queue, values, array)
    nodes, packs, leaf_spheres = records
    return Built(tree, nodes, packs, leaf_spheres, len(triangles))


@dataclass(frozen=True)
class Binary:
    """A binary tree on the host. Of primitives, (count,): whether they are spheres, and their boxes."""

    nodes: NDArray[np.void]
    rounds: list[int]
    sphere: NDArray[np.bool_]
    low: FloatArray
    high: FloatArray

    @property
    def below(self) -> NDArray[np.int64]:
        """(nodes, 2), children: primitives count from 0, nodes on from there."""
        children = np.stack([self.nodes["left"], self.nodes["right"]], axis=1).astype(np.int64)
        return np.where(children < 0, ~children, len(self.sphere) + children)

    @property
    def total_area(self) -> float:
        """Half the area of all nodes."""
        return float(half_area(self.nodes["lo"], self.nodes["hi"]).sum())

    @property
    def depth(self) -> int:
        """Edges from the root to the deepest primitive."""
        depth = np.zeros(len(self.nodes) + len(self.sphere), np.intp)
        for node, children in reversed(list(enumerate(self.below, start=len(self.sphere)))):
            depth[children] = depth[node] + 1
        return int(depth.max())

    def check(self) -> None:
        """Every child has one parent, of a later round, and boxes are tight."""
        count, below = len(self.sphere), self.below
        np.testing.assert_array_equal(np.sort(below, axis=None), np.arange(2 * count - 2))
        made = np.concatenate([np.full(count, -1), np.repeat(np.arange(len(self.rounds)), self.rounds)])
        assert (made[below] < made[count:, None]).all()
        for side, union, ends in (("lo", np.minimum, self.low), ("hi", np.maximum, self.high)):
            boxes = np.concatenate([ends, self.nodes[side]])
            np.testing.assert_array_equal(self.nodes[side], union.reduce(boxes[below], axis=1))


def binary(device: Device, triangles: FloatArray, balls: FloatArray, passes: int = 0) -> Binary:
    """The binary tree after some passes of reinsertion."""
    work = Blocks(device, program_source(SHAPES["bvh8"], len(triangles) > 0, len(balls) > 0, passes > 0))
    primitives = sort_primitives(work, triangles, balls)
    tree = cluster(work, primitives)
    tree = reinsert(work, primitives, tree, passes) if passes else tree
    ids = work.download(primitives.ids, np.uint32, primitives.count)
    ball_low, ball_high = sphere_boxes(balls)
    low, high = np.concatenate([triangles.min(axis=1), ball_low]), np.concatenate([triangles.max(axis=1), ball_high])
    return Binary(work.download(tree.nodes, BINARY_NODE, tree.count), tree.rounds, ids >= len(triangles), low[ids],
                  high[ids])
