"""Trees of two levels: one a mesh, and above them one over instances, meshes that stand in the world by a transform.

A ray is taken into the mesh's frame and walked through its tree there: ten thousand instances cost the memory of one.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..device.arrays import DeviceArray, on_host, put, room_for
from ..device.open import Device
from ..device.records import record
from ..errors import UsageError, check_choice
from .build import build_tree
from .layouts import LAYOUTS, Layout, sphere_boxes
from .tree import FloatArray, IntArray
from .upper_level import FORMS, upper_level

Doubles = NDArray[np.float64]

#: to_object: rows of the transform from the world to the mesh's frame. root: the mesh's, in the array of all nodes.
#: index: the host's of the instance.
INSTANCE = record(to_object="(3,4)f4", root="i4", index="i4", pad="2i4")
#: Rounding of a coordinate's way to the object's frame and back: three products, their sum, the matrix itself.
TRANSFORM_ROUNDING = 8 * 2.0**-24


class TwoLevels:
    """Trees of meshes on a device, and above them the tree over instances, which can be made anew.

    meshes: triangles (m, 3, 3) each, all of sizes near 1. mesh: (k,) int32 indices of `meshes`, one an instance.
    triangle: the test that the leaves are for. spheres: (s, 4), which stand in the last mesh's frame and are found with
    it, their primitives after its own. Without a device the trees stay in numpy.
    The upper level comes first in the array of nodes, in room for the largest one of so many instances.
    Raises UsageError for a layout that has no upper level.
    """

    def __init__(self, device: Device | None, layout: str, builder: str | None, meshes: Sequence[FloatArray],
                 mesh: IntArray, triangle: str = "watertight", spheres: FloatArray | None = None) -> None:
        check_choice("layout", layout, LAYOUTS)
        if layout not in FORMS:
            raise UsageError(f"the layout {layout} is no tree, which instances need: take one of {', '.join(FORMS)}")
        start = time.perf_counter()
        self._device, self._form, self._mesh = device, FORMS[layout], mesh
        balls = [np.zeros((0, 4), np.float32)] * len(meshes)
        if spheres is not None:
            balls[-1] = spheres
        self._boxes = np.array([_box(*each) for each in zip(meshes, balls)]).reshape(-1, 2, 3)
        trees = [build_tree(device, layout, builder, *each, triangle) for each in zip(meshes, balls)]
        self._builder = trees[0].builder if trees else ""
        self._stack = max((tree.stack for tree in trees), default=0)
        self._depth = max((tree.depth for tree in trees), default=0)
        self._nodes = sum(tree.nodes for tree in trees)
        self._buffers, self._roots = self._joined(trees)
        self._seconds = time.perf_counter() - start

    def on(self, device: Device | None, buffers: dict[str, DeviceArray | NDArray[Any]]) -> TwoLevels:
        """The same, with its buffers there."""
        other = copy(self)
        other._device, other._buffers = device, buffers
        return other

    def place(self, to_world: Doubles) -> Layout:
        """The tree with the instances where transforms to the world (k, 3, 4), none singular, put them.

        Its buffers are those of the tree before, rewritten. build_seconds: of the lower level and this upper one.
        """
        start = time.perf_counter()
        upper, order = upper_level(self._form, *world_boxes(self._boxes[self._mesh], to_world))
        instances = np.zeros(len(order), INSTANCE)
        instances["to_object"], instances["index"] = inverse(to_world)[order], order
        instances["root"] = self._roots[self._mesh[order]]
        put(self._device, self._buffers["nodes"], upper.buffers["nodes"])
        put(self._device, self._buffers["instances"], instances)
        # On the stack: what waits in the upper level, LEAVE, and what waits in the lower one.
        return replace(upper, buffers=self._buffers, stack=upper.stack + 1 + self._stack,
                       nodes=upper.nodes + self._nodes, depth=upper.depth + self._depth, builder=self._builder,
                       build_seconds=self._seconds + time.perf_counter() - start)

    def _joined(self, trees: Sequence[Layout]) -> tuple[dict[str, DeviceArray | NDArray[Any]], NDArray[np.int64]]:
        """The buffers, with the trees' records one tree after another, and where their roots are, (m,)."""
        device, form = self._device, self._form
        first_node = form.room(len(self._mesh)) + _starts([len(tree.buffers["nodes"]) for tree in trees])
        first_leaf = _starts([len(tree.buffers.get(form.leaves, ())) for tree in trees])
        buffers = {"nodes": room_for(device, form.node, int(first_node[-1]))}
        if leaves := [tree.buffers[form.leaves] for tree in trees if form.leaves in tree.buffers]:
            buffers[form.leaves] = room_for(device, leaves[0].dtype, int(first_leaf[-1]))
        for tree, node, leaf in zip(trees, first_node, first_leaf):
            nodes = (on_host(device, tree.buffers["nodes"]) if device else tree.buffers["nodes"]).copy()
            form.shift(nodes, node, leaf)
            put(device, buffers["nodes"], nodes, node)
            if form.leaves in tree.buffers:
                put(device, buffers[form.leaves], tree.buffers[form.leaves], leaf)
        buffers |= {"leaf_spheres": tree.buffers["leaf_spheres"] for tree in trees if "leaf_spheres" in tree.buffers}
        buffers["instances"] = room_for(device, INSTANCE, len(self._mesh))
        return buffers, first_node[:-1]


def world_boxes(boxes: Doubles, to_world: Doubles) -> tuple[FloatArray, FloatArray]:
    """aabb_min, aabb_max (k, 3) float32 around transformed boxes (k, 2, 3), and around what rounding makes of them."""
    corners = np.stack([boxes[:, [x, y, z], [0, 1, 2]] for x in (0, 1) for y in (0, 1) for z in (0, 1)], axis=1)
    world = np.einsum("kij,kcj->kci", to_world[..., :3], corners) + to_world[:, None, :, 3]
    to_object = inverse(to_world)
    size = np.abs(world).max(axis=1)
    error = np.einsum("kij,kj->ki", np.abs(to_object[..., :3]), size) + np.abs(to_object[..., 3])
    pad = TRANSFORM_ROUNDING * (np.einsum("kij,kj->ki", np.abs(to_world[..., :3]), error) + size)
    low, high = (world.min(axis=1) - pad).astype(np.float32), (world.max(axis=1) + pad).astype(np.float32)
    return np.nextafter(low, np.float32(-np.inf)), np.nextafter(high, np.float32(np.inf))


def inverse(transforms: Doubles) -> Doubles:
    """(k, 3, 4) inverses of affine transforms; LinAlgError where one is singular."""
    linear = np.linalg.inv(transforms[..., :3])
    return np.concatenate([linear, -linear @ transforms[..., 3:]], axis=-1)


def _box(triangles: FloatArray, spheres: FloatArray) -> FloatArray:
    """The box of a mesh and spheres (2, 3); of neither a point, whose tree no ray gets into."""
    points = np.concatenate([triangles.reshape(-1, 3), *sphere_boxes(spheres)])
    return np.stack([points.min(axis=0), points.max(axis=0)]) if len(points) else np.zeros((2, 3), np.float32)


def _starts(sizes: Sequence[int]) -> NDArray[np.int64]:
    """Where each of some ranges starts if they lie one after another, and where the last one ends."""
    return np.cumsum([0, *sizes], dtype=np.int64)
