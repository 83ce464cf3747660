"""Trees built on the device: clustering, the plan of the wide tree, its nodes and leaves (kernels/build)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pyopencl as cl

from ..device.blocks import Blocks
from ..device.open import Device
from ..device.preamble import defines, typedefs
from ..device.program import compose
from .layouts import BVH8_NODE, LEAF_SPHERE, TRIANGLE_PACK
from .ploc import BINARY_NODE, BinaryTree, Primitives, cluster
from .tree import FloatArray
from .wide import EMPTY


@dataclass(frozen=True)
class Shape:
    """What a layout asks of the builder. file: writes its nodes and leaves, whose records are `node` and `leaf`.

    children: of a node. leaf_size: most primitives of a leaf. pack: triangles that are intersected at the price of one.
    """

    file: str
    children: int
    leaf_size: int
    pack: int
    node: np.dtype[np.void]
    leaf: np.dtype[np.void]


SHAPES = {"bvh8": Shape("build/bvh8.cl", 8, 8, 8, BVH8_NODE, TRIANGLE_PACK)}


@dataclass(frozen=True, eq=False)
class Level:
    """`count` nodes of the wide tree: their slots, and the places of what is in them.

    records: how many nodes below, leaf records of triangles and spheres they take.
    """

    count: int
    slots: cl.Buffer
    places: cl.Buffer
    records: tuple[int, int, int]


@dataclass(frozen=True, eq=False)
class DeviceTree:
    """Records on the device, with their numbers: nodes, leaf records of triangles, spheres. level_sizes: (d,)."""

    arrays: tuple[cl.Buffer, cl.Buffer, cl.Buffer]
    counts: tuple[int, int, int]
    level_sizes: list[int]
    stack: int
    peak_bytes: int


def build_tree(device: Device, shape: Shape, triangles: FloatArray, spheres: FloatArray) -> DeviceTree:
    """The tree over at least two primitives: triangles (m, 3, 3), spheres (s, 4), coordinates finite, below 1e18."""
    work = Blocks(device, _source(shape, bool(len(triangles)), bool(len(spheres))))
    primitives = Primitives(work.upload(triangles), work.upload(spheres), len(triangles), len(triangles) + len(spheres))
    tree = cluster(work, primitives)
    plans = _plan(work, shape, primitives, tree)
    levels, stack = _open(work, shape, primitives, tree, plans)
    return _write(work, shape, primitives, tree, plans, levels, stack)


def _source(shape: Shape, triangles: bool, spheres: bool) -> str:
    values = {"CHILDREN": shape.children, "LEAF_SIZE": shape.leaf_size, "PACK": shape.pack, "EMPTY": EMPTY,
              "TRIANGLES": int(triangles), "SPHERES": int(spheres)}
    records = {"BinaryNode": BINARY_NODE, "Node": shape.node, "Triangles": shape.leaf, "LeafSphere": LEAF_SPHERE}
    return compose("\n".join([defines(values), typedefs(records)]), shape.file, {})


def _plan(work: Blocks, shape: Shape, primitives: Primitives, tree: BinaryTree) -> cl.Buffer:
    """(count − 1,) uint32: which nodes stay, become leaves or are opened."""
    plans, visits = work.empty(np.uint32, tree.count - 1), work.zeros(np.uint32, tree.count - 1)
    costs = work.empty(np.float32, (tree.count - 1) * (shape.children - 1))
    work.run("plan_nodes", tree.count, *primitives.arguments, tree.order, tree.nodes, tree.parents, visits, plans, costs)
    work.free(costs, visits, tree.parents, tree.order)
    return plans


def _open(work: Blocks, shape: Shape, primitives: Primitives, tree: BinaryTree,
          plans: cl.Buffer) -> tuple[list[Level], int]:
    """The wide tree's levels, and the most entries on a traversal's stack."""
    levels, most = [], work.zeros(np.int32, 1)
    tops, waiting, count = work.upload(np.array([tree.root], np.int32)), work.zeros(np.int32, 1), 1
    while count:
        slots, places = work.empty(np.int32, count * shape.children), work.empty(np.uint32, 3 * count)
        work.run("open_nodes", count, *primitives.arguments, tops, waiting, tree.nodes, plans, slots, places, most)
        inner, triangles, spheres = map(int, work.scan(places, count, 3))
        below = work.empty(np.int32, inner), work.empty(np.int32, inner)
        work.run("next_tops", count, *primitives.arguments, waiting, plans, slots, places, *below)
        work.free(tops, waiting)
        levels.append(Level(count, slots, places, (inner, triangles, spheres)))
        (tops, waiting), count = below, inner
    work.free(tops, waiting)
    return levels, int(work.download(most, np.int32, 1)[0])


def _write(work: Blocks, shape: Shape, primitives: Primitives, tree: BinaryTree, plans: cl.Buffer,
           levels: list[Level], stack: int) -> DeviceTree:
    """Nodes and leaves, level by level."""
    counts = (sum(level.count for level in levels), sum(level.records[1] for level in levels),
              sum(level.records[2] for level in levels))
    arrays = work.empty(shape.node, counts[0]), work.empty(shape.leaf, counts[1]), work.empty(LEAF_SPHERE, counts[2])
    first = [0, 0, 0]
    for level in levels:
        work.run("write_level", level.count, *primitives.arguments, tree.nodes, plans, level.slots, level.places,
                 first[0], first[0] + level.count, first[1], first[2], *arrays)
        first = [first[0] + level.count, first[1] + level.records[1], first[2] + level.records[2]]
        work.free(level.slots, level.places)
    work.free(tree.nodes, plans, primitives.triangles, primitives.spheres)
    return DeviceTree(arrays, counts, [level.count for level in levels], stack, work.peak_bytes)
