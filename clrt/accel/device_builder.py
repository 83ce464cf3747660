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
from .morton import Primitives, sort_primitives
from .ploc import BINARY_NODE, BinaryTree, cluster
from .reinsertion import MOVE, reinsert
from .tree import FloatArray
from .wide import EMPTY


@dataclass(frozen=True)
class Shape:
    """What a layout asks of the builder. writer: the file that writes its records, `node` and `leaf`.

    children: of a node. leaf_size: most primitives of a leaf. pack: triangles that are intersected at the price of one.
    """

    writer: str
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


def build_tree(device: Device, shape: Shape, triangles: FloatArray, spheres: FloatArray,
               reinsertions: int = 0) -> DeviceTree:
    """The tree over at least two primitives: triangles (m, 3, 3), spheres (s, 4), coordinates finite, below 1e18.

    reinsertions: passes that make it better.
    """
    work = Blocks(device, program_source(shape, len(triangles) > 0, len(spheres) > 0, reinsertions > 0))
    primitives = sort_primitives(work, triangles, spheres)
    tree = cluster(work, primitives)
    if reinsertions:
        tree = reinsert(work, primitives, tree, reinsertions)
    plans = _plan(work, shape, primitives, tree)
    levels, stack = _open(work, shape, primitives, tree, plans)
    return _write(work, shape, primitives, tree, plans, levels, stack)


def program_source(shape: Shape, triangles: bool, spheres: bool, reinsertions: bool) -> str:
    """The builder's program, for scenes with triangles, with spheres, and for trees that are made better."""
    values = {"CHILDREN": shape.children, "LEAF_SIZE": shape.leaf_size, "PACK": shape.pack, "EMPTY": EMPTY,
              "TRIANGLES": int(triangles), "SPHERES": int(spheres)}
    records = {"BinaryNode": BINARY_NODE, "Move": MOVE, "Node": shape.node, "Triangles": shape.leaf,
               "LeafSphere": LEAF_SPHERE}
    files = {"REINSERTION": ["build/reinsert.cl"] if reinsertions else [], "WRITER": [shape.writer]}
    return compose("\n".join([defines(values), typedefs(records)]), "build/builder.cl", files)


def _plan(work: Blocks, shape: Shape, primitives: Primitives, tree: BinaryTree) -> cl.Buffer:
    """(nodes,) uint32: which nodes stay, become leaves or are opened."""
    plans, costs = work.empty(np.uint32, tree.count), work.empty(np.float32, tree.count * (shape.children - 1))
    node = 0
    for count in tree.rounds:
        work.run("plan_nodes", count, *primitives.arguments, tree.nodes, node, tree.count - 1, plans, costs)
        node += count
    work.free(costs)
    return plans


def _open(work: Blocks, shape: Shape, primitives: Primitives, tree: BinaryTree,
          plans: cl.Buffer) -> tuple[list[Level], int]:
    """The wide tree's levels, and the most entries on a traversal's stack."""
    most = work.upload(np.zeros(1, np.int32))
    above = np.full(shape.children, EMPTY, np.int32)
    above[0] = tree.count - 1
    levels = [Level(1, work.upload(above), work.upload(np.zeros(3, np.uint32)), (1, 0, 0))]
    waiting = work.upload(np.zeros(1, np.int32))
    while below := levels[-1].records[0]:
        slots, places = work.empty(np.int32, below * shape.children), work.empty(np.uint32, 3 * below)
        work.run("open_level", levels[-1].count, *primitives.arguments, tree.nodes, plans, levels[-1].slots,
                 levels[-1].places, waiting, below, slots, places, next_waiting := work.empty(np.int32, below), most)
        work.free(waiting)
        inner, triangles, spheres = map(int, work.scan(places, below, 3))
        levels.append(Level(below, slots, places, (inner, triangles, spheres)))
        waiting = next_waiting
    work.free(waiting, levels[0].slots, levels[0].places)
    return levels[1:], int(work.download(most, np.int32, 1)[0])


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
    work.free(tree.nodes, plans, primitives.shapes, primitives.ids)
    return DeviceTree(arrays, counts, [level.count for level in levels], stack, work.peak_bytes)
