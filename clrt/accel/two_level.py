"""Trees of two levels: one a mesh, and above them one over instances, meshes that stand in the world by a transform.

A ray is taken into the mesh's frame and walked through its tree there: ten thousand instances cost the memory of one.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..device.arrays import DeviceArray
from ..device.open import Device
from ..device.records import record
from ..errors import UsageError
from .build import build_tree
from .builders import BUILDERS
from .layouts import LANES, Layout, Records, wide_nodes
from .tree import FloatArray, IntArray
from .wide import EMPTY, collapse

Doubles = NDArray[np.float64]

#: to_object: rows of the transform from the world to the mesh's frame. root: the mesh's, in the array of all nodes.
INSTANCE = record(to_object="(3,4)f4", root="i4", pad="3i4")
#: Rounding of a coordinate's way to the object's frame and back: three products, their sum, the matrix itself.
TRANSFORM_ROUNDING = 8 * 2.0**-24


def build_two_levels(device: Device, layout: str, builder: str | None, meshes: Sequence[FloatArray], mesh: IntArray,
                     to_world: Doubles) -> Layout:
    """The two levels over instances: (k,) indices of `meshes`, (k, 3, 4) transforms to the world, not singular.

    meshes: triangles (m, 3, 3) each, all of sizes near 1. Raises UsageError for a layout that has no upper level.
    """
    if layout != "bvh8":
        raise UsageError(f"the layout {layout} has no instances: take bvh8")
    start = time.perf_counter()
    trees = [build_tree(device, layout, builder, triangles) for triangles in meshes]
    boxes = np.array([_bounds(_on_host(device, tree.buffers["nodes"])) for tree in trees]).reshape(-1, 2, 3)
    present = np.flatnonzero(np.isfinite(boxes[mesh]).all(axis=(1, 2)))
    upper = _upper_level(world_boxes(boxes[mesh[present]], to_world[present]), present.astype(np.int32))
    first = len(upper.buffers["nodes"]) + np.cumsum([0] + [tree.nodes for tree in trees])
    buffers = _joined(device, upper, trees)
    buffers["instances"] = _instances(to_world, first[mesh])
    return replace(upper, buffers=buffers, stack=upper.stack + 1 + max((tree.stack for tree in trees), default=0),
                   nodes=len(buffers["nodes"]), build_seconds=time.perf_counter() - start)


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


def _upper_level(boxes: tuple[FloatArray, FloatArray], instances: IntArray) -> Layout:
    """The tree over boxes; each of its leaves is one of `instances`."""
    wide = collapse(BUILDERS["sah"](*boxes, 1, 1), LANES)
    leaf = wide.child < 0
    child = wide.child.copy()
    child[leaf] = ~(instances[wide.order[~child[leaf] >> 4]] << 4)
    return Layout("bvh8", {"nodes": wide_nodes(wide, child)}, wide.stack_bound, len(child), wide.depth, wide.sah_cost())


def _joined(device: Device, upper: Layout, trees: Sequence[Layout]) -> dict[str, Records | DeviceArray]:
    """One array of nodes, the upper level's first, and one of packs, with the references moved accordingly."""
    nodes, packs = [_on_host(device, upper.buffers["nodes"])], []
    first_node, first_pack = len(nodes[0]), 0
    for tree in trees:
        own = _on_host(device, tree.buffers["nodes"]).copy()
        child = own["child"]
        child[child < 0] -= np.int32(first_pack << 4)
        child[(child >= 0) & (child != EMPTY)] += np.int32(first_node)
        nodes.append(own)
        first_node += len(own)
        if "packs" in tree.buffers:
            packs.append(_on_host(device, tree.buffers["packs"]))
            first_pack += len(packs[-1])
    joined: dict[str, Records | DeviceArray] = {"nodes": np.concatenate(nodes)}
    return joined | ({"packs": np.concatenate(packs)} if packs else {})


def _instances(to_world: Doubles, roots: NDArray[np.integer]) -> Records:
    records = np.zeros(max(1, len(to_world)), INSTANCE)  # no buffer is empty
    records["to_object"][:len(roots)], records["root"][:len(roots)] = inverse(to_world), roots
    return records


def _bounds(nodes: Records) -> Doubles:
    """The box of a tree (2, 3), infinite for an empty one."""
    return np.array([nodes["lo"][0].min(axis=1), nodes["hi"][0].max(axis=1)], np.float64)


def _on_host(device: Device, array: Records | DeviceArray) -> Records:
    return array.read(device) if isinstance(array, DeviceArray) else array
