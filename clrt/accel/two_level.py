"""Two-level BVHs: one BVH per mesh (lower level), and one over instances (upper level), meshes placed by transforms.

A ray is transformed to the mesh's object space and traverses its BVH there: ten thousand instances take the memory of
one.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..device.launches.device_arrays import DeviceArray, on_host, put, room_for
from ..device.open import Device
from ..device.programs.struct_types import record
from ..errors import UsageError, check_choice
from .build import build_tree
from .bvh import FloatArray, IntArray
from .layouts import LAYOUTS, Layout, sphere_boxes
from .upper_level import FORMS, upper_level

Doubles = NDArray[np.float64]

#: to_object: rows of the world-to-object transform. root: the mesh's root in the array of all nodes. index: of the
#: instance on the host.
INSTANCE = record(to_object="(3,4)f4", root="i4", index="i4", pad="2i4")
#: Relative rounding error of transforming a coordinate to object space and back: three products, their sum, the matrix
#: itself.
TRANSFORM_ROUNDING = 8 * 2.0**-24
#: World boxes, aabb_min and aabb_max (m, 3), that contain boxes (m, 2, 3) of moving instances in all their poses.
Sweep = Callable[[Doubles], tuple[FloatArray, FloatArray]]


class TwoLevelBvh:
    """BVHs of meshes on a device, and above them the BVH over instances, which can be rebuilt.

    meshes: triangles (m, 3, 3) each, all of sizes near 1. mesh: (k,) int32 indices of `meshes`, one per instance.
    triangle: the test that the leaves are for. spheres: (s, 4), in the last mesh's object space and part of its BVH,
    with primitive numbers after its own. Without a device the BVHs stay in numpy.
    The upper level comes first in the array of nodes, with room for the largest BVH over this many instances.
    Raises UsageError for a layout that does not support an upper level.
    """

    def __init__(
        self,
        device: Device | None,
        layout: str,
        builder: str | None,
        meshes: Sequence[FloatArray],
        mesh: IntArray,
        triangle: str = "watertight",
        spheres: FloatArray | None = None,
    ) -> None:
        check_choice("layout", layout, LAYOUTS)
        if layout not in FORMS:
            raise UsageError(f"the layout {layout} is not a BVH, which instances need; use one of {', '.join(FORMS)}")
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

    def on(self, device: Device | None, buffers: dict[str, DeviceArray | NDArray[Any]]) -> TwoLevelBvh:
        """Return a copy whose buffers are on `device`."""
        other = copy(self)
        other._device, other._buffers = device, buffers
        return other

    def place(self, to_world: Doubles, moving: IntArray | None = None, sweep: Sweep | None = None) -> Layout:
        """Return the BVH with the instances placed by object-to-world transforms (k, 3, 4), none singular.

        Its buffers are those of the previous BVH, overwritten. build_seconds: of the lower level and this upper one.
        moving: (m,), numbers of instances that move; sweep: of their boxes.
        """
        start = time.perf_counter()
        low, high = world_boxes(self._boxes[self._mesh], to_world)
        if moving is not None and sweep is not None:
            low[moving], high[moving] = sweep(self._boxes[self._mesh[moving]])
        upper, order = upper_level(self._form, low, high)
        instances = np.zeros(len(order), INSTANCE)
        instances["to_object"], instances["index"] = inverse(to_world)[order], order
        instances["root"] = self._roots[self._mesh[order]]
        put(self._device, self._buffers["nodes"], upper.buffers["nodes"])
        put(self._device, self._buffers["instances"], instances)
        # The stack holds the upper level's entries, LEAVE, and the lower level's entries.
        return replace(
            upper,
            buffers=self._buffers,
            stack=upper.stack + 1 + self._stack,
            nodes=upper.nodes + self._nodes,
            depth=upper.depth + self._depth,
            builder=self._builder,
            build_seconds=self._seconds + time.perf_counter() - start,
        )

    def _joined(self, trees: Sequence[Layout]) -> tuple[dict[str, DeviceArray | NDArray[Any]], NDArray[np.int64]]:
        """Return the buffers with the BVHs' records concatenated, and the indices of their roots, (m,)."""
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
            if "leaf_spheres" in tree.buffers:
                buffers["leaf_spheres"] = tree.buffers["leaf_spheres"]
        buffers["instances"] = room_for(device, INSTANCE, len(self._mesh))
        return buffers, first_node[:-1]


def world_boxes(boxes: Doubles, to_world: Doubles) -> tuple[FloatArray, FloatArray]:
    """Return aabb_min, aabb_max (k, 3) float32 of transformed boxes (k, 2, 3), padded for the transforms' rounding."""
    corners = np.stack([boxes[:, [x, y, z], [0, 1, 2]] for x in (0, 1) for y in (0, 1) for z in (0, 1)], axis=1)
    world = np.einsum("kij,kcj->kci", to_world[..., :3], corners) + to_world[:, None, :, 3]
    to_object = inverse(to_world)
    size = np.abs(world).max(axis=1)
    error = np.einsum("kij,kj->ki", np.abs(to_object[..., :3]), size) + np.abs(to_object[..., 3])
    pad = TRANSFORM_ROUNDING * (np.einsum("kij,kj->ki", np.abs(to_world[..., :3]), error) + size)
    low, high = (world.min(axis=1) - pad).astype(np.float32), (world.max(axis=1) + pad).astype(np.float32)
    return np.nextafter(low, np.float32(-np.inf)), np.nextafter(high, np.float32(np.inf))


def inverse(transforms: Doubles) -> Doubles:
    """Return the inverses (k, 3, 4) of affine transforms. Raises LinAlgError if one is singular."""
    linear = np.linalg.inv(transforms[..., :3])
    return np.concatenate([linear, -linear @ transforms[..., 3:]], axis=-1)


def _box(triangles: FloatArray, spheres: FloatArray) -> FloatArray:
    """Return the box of a mesh and spheres (2, 3); without either it is a point, whose BVH no ray enters."""
    points = np.concatenate([triangles.reshape(-1, 3), *sphere_boxes(spheres)])
    return np.stack([points.min(axis=0), points.max(axis=0)]) if len(points) else np.zeros((2, 3), np.float32)


def _starts(sizes: Sequence[int]) -> NDArray[np.int64]:
    """Return the start of each of some consecutive ranges, and the end of the last."""
    return np.cumsum([0, *sizes], dtype=np.int64)
