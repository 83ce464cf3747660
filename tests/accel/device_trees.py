"""BVHs built on a device and read back to the host."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from clrt.accel.build import build_tree
from clrt.accel.bvh import Bvh, FloatArray, half_area
from clrt.accel.device_builder import SHAPES, program_source
from clrt.accel.layouts import Layout, sphere_boxes
from clrt.accel.morton import sort_primitives
from clrt.accel.ploc import BINARY_NODE, cluster
from clrt.accel.reinsertion import reinsert
from clrt.accel.wide import EMPTY, WideBvh, leaf_fields, leaf_reference
from clrt.device.launches.data_parallel import DataParallel
from clrt.device.launches.device_arrays import on_host
from clrt.device.open import Device

from .cases import SCENES, edges
from .test_cwbvh import boxes_below, children_of, leaves_of


def like_gpu(device: Device) -> Device:
    """Return the device with the execution settings of a GPU: many work-items, in groups."""
    return replace(device, info=replace(device.info, type="gpu"))


@cache
def built(device: Device, layout: str, case: str) -> Layout:
    """Return the BVH of a scene, with its buffers on the host."""
    tree = build_tree(device, layout, "ploc", *SCENES[case])
    return replace(tree, buffers={name: on_host(device, array) for name, array in tree.buffers.items()})


def wide_tree(device: Device, layout: str, case: str) -> WideBvh:
    """Return a BVH8 with leaves numbered by their first lane, or a CWBVH with primitives numbered as in the records.

    The boxes of a CWBVH are recomputed from what is below each slot.
    """
    tree, triangle_count = built(device, layout, case), len(SCENES[case][0])
    nodes, order = tree.buffers["nodes"], np.empty(0, np.int32)
    if layout == "cwbvh":
        child = np.full((len(nodes), 8), EMPTY, np.int32)
        for index, node in enumerate(nodes):
            for slot, below in children_of(node):
                child[index, slot] = below
            for slot, start, size in leaves_of(node):
                child[index, slot] = ~(start << 4 | (start >= triangle_count) << 3 | size - 1)
        return WideBvh(*boxes_below(tree), child, np.zeros(1, np.int32), order)
    child = nodes["child"].copy()
    first, sphere, count = leaf_fields(child[child < 0])
    child[child < 0] = leaf_reference(np.where(sphere, first, 8 * first).astype(np.int32), sphere, count)
    if "packs" in tree.buffers:
        order = tree.buffers["packs"]["primitive"].ravel()
    balls = tree.buffers["leaf_spheres"]["primitive"] if "leaf_spheres" in tree.buffers else order[:0]
    return WideBvh(
        nodes["lo"].transpose(0, 2, 1), nodes["hi"].transpose(0, 2, 1), child, order, balls - np.int32(triangle_count)
    )


def binary_tree(device: Device, case: str) -> Bvh:
    """Return the BVH2; sphere leaves are stored like triangle leaves, and follow them in `order`."""
    buffers, triangle_count = built(device, "bvh2", case).buffers, len(SCENES[case][0])
    nodes = np.delete(buffers["nodes"], 1)
    shift = np.where(nodes["count"] == 0, -1, np.where(nodes["count"] < 0, triangle_count, 0))
    leaves = [buffers[name]["primitive"] for name in ("leaf_triangles", "leaf_spheres") if name in buffers]
    order = np.concatenate(leaves)
    return Bvh(
        nodes["aabb_min"],
        nodes["aabb_max"],
        (nodes["left_first"] + shift).astype(np.int32),
        np.abs(nodes["count"]),
        np.zeros(len(nodes), bool),
        order,
        order[:0],
    )


@dataclass(frozen=True)
class Binary:
    """Binary BVH on the host. Per primitive, (count,): whether it is a sphere, and its box."""

    nodes: NDArray[np.void]
    rounds: list[int]
    sphere: NDArray[np.bool_]
    low: FloatArray
    high: FloatArray

    @property
    def below(self) -> NDArray[np.int64]:
        """Children, (nodes, 2): primitives are numbered from 0, nodes continue from there."""
        children = np.stack([self.nodes["left"], self.nodes["right"]], axis=1).astype(np.int64)
        return np.where(children < 0, ~children, len(self.sphere) + children)

    @property
    def total_area(self) -> float:
        """Half of the surface area of all nodes."""
        return float(half_area(self.nodes["lo"], self.nodes["hi"]).sum())

    @property
    def depth(self) -> int:
        """Edges from the root to the deepest primitive."""
        depth = np.zeros(len(self.nodes) + len(self.sphere), np.intp)
        for node, children in reversed(list(enumerate(self.below, start=len(self.sphere)))):
            depth[children] = depth[node] + 1
        return int(depth.max())

    def check(self) -> None:
        """Assert that every child has one parent, created in a later round, and that boxes are tight."""
        count, below = len(self.sphere), self.below
        np.testing.assert_array_equal(np.sort(below, axis=None), np.arange(2 * count - 2))
        made = np.concatenate([np.full(count, -1), np.repeat(np.arange(len(self.rounds)), self.rounds)])
        assert (made[below] < made[count:, None]).all()
        for side, union, ends in (("lo", np.minimum, self.low), ("hi", np.maximum, self.high)):
            boxes = np.concatenate([ends, self.nodes[side]])
            np.testing.assert_array_equal(self.nodes[side], union.reduce(boxes[below], axis=1))


def binary(device: Device, layout: str, case: str, passes: int = 0) -> Binary:
    """Return the binary BVH of a scene for a layout, after some passes of reinsertion."""
    triangles, balls = SCENES[case]
    work = DataParallel(device, program_source(SHAPES[layout], len(triangles) > 0, len(balls) > 0, passes > 0))
    primitives = sort_primitives(work, triangles, balls)
    tree = cluster(work, primitives)
    tree = reinsert(work, primitives, tree, passes) if passes else tree
    ids = work.download(primitives.ids, np.uint32, primitives.count)
    ball_low, ball_high = sphere_boxes(balls)
    triangle_low, triangle_high = edges(triangles)
    low, high = np.concatenate([triangle_low, ball_low]), np.concatenate([triangle_high, ball_high])
    return Binary(
        work.download(tree.nodes, BINARY_NODE, tree.count), tree.rounds, ids >= len(triangles), low[ids], high[ids]
    )
