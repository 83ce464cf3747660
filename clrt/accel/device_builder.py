"""BVH construction on the device: clustering, planning the wide BVH, writing its nodes and leaves (kernels/build)."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pyopencl as cl

from ..device.launches.data_parallel import DataParallel
from ..device.open import Device
from ..device.programs.preamble import defines, typedefs
from ..device.programs.program import compose
from ..device.programs.struct_types import record
from ..errors import NoRoomError, SceneError
from .bvh import FloatArray, Triangles, half_area
from .cwbvh import CWBVH_NODE, MAX_LEAF, SLOTS
from .layouts import BVH2_NODE, BVH8_NODE, LANES, LEAF_SIZES, LEAF_SPHERE, LEAF_TRIANGLE, TRIANGLE_PACK
from .morton import SHAPE, Primitives, sort_primitives
from .ploc import BINARY_NODE, SLOW, BinaryTree, cluster
from .reinsertion import MOVE, reinsert
from .wide import EMPTY, MAX_PRIMITIVES


@dataclass(frozen=True)
class BuilderLayout:
    """Requirements of a layout on the builder. writer: the kernel file that writes its records, `node` and `leaf`.

    children: per node. leaf_size: maximum primitives per leaf. pack: triangles that are intersected at the cost of one.
    leaves: the buffer of triangle records. records: node records per node, and additional ones. compressed: children
    are in their octants' slots, a node's leaves are all of one kind, and its child nodes share a stack entry.
    """

    writer: str
    children: int
    leaf_size: int
    pack: int
    node: np.dtype[np.void]
    leaf: np.dtype[np.void]
    leaves: str
    records: tuple[int, int] = (1, 0)
    compressed: bool = False


#: Factors that turn a box's sides and area into fractions of the scene's, and values to add if the scene's is 0.
WORLD = record(per_side="3f4", per_area="f4", no_side="3f4", no_area="f4")

#: Approximate maximum bytes per primitive of the largest array: packs of only two triangles take 160.
LARGEST_ARRAY = 192

SHAPES = {
    "bvh8": BuilderLayout("build/bvh8.cl", LANES, LANES, LANES, BVH8_NODE, TRIANGLE_PACK, "packs"),
    "bvh2": BuilderLayout("build/bvh2.cl", 2, LEAF_SIZES["sah"], 1, BVH2_NODE, LEAF_TRIANGLE, "leaf_triangles", (2, 2)),
    "cwbvh": BuilderLayout(
        "build/cwbvh.cl", SLOTS, MAX_LEAF, MAX_LEAF, CWBVH_NODE, LEAF_TRIANGLE, "leaf_triangles", compressed=True
    ),
}


@dataclass(frozen=True, eq=False)
class DeviceTree:
    """Records on the device, with their numbers: nodes, leaf records of triangles, spheres.

    nodes, depth, stack, sah_cost, level_sizes: as in Layout; if the root's box has no area, sah_cost is the number of
    records.
    """

    arrays: tuple[cl.Buffer, cl.Buffer, cl.Buffer]
    counts: tuple[int, int, int]
    nodes: int
    depth: int
    stack: int
    sah_cost: float
    level_sizes: list[int]
    peak_bytes: int


def fits(device: Device | None, count: int) -> bool:
    """Return whether the arrays for this many primitives fit the device's largest buffer."""
    return device is not None and count * LARGEST_ARRAY <= device.info.max_alloc_bytes


def build_tree(
    device: Device, shape: BuilderLayout, triangles: Triangles, spheres: FloatArray, reinsertions: int = 0
) -> DeviceTree:
    """Build the BVH over at least two primitives: triangles, spheres (s, 4), with finite coordinates below 1e18.

    reinsertions: number of optimisation passes. Raises SceneError for more than MAX_PRIMITIVES in all, and NoRoomError.
    """
    if (count := len(triangles) + len(spheres)) > MAX_PRIMITIVES:
        raise SceneError(f"{count} primitives, but a device builds BVHs over {MAX_PRIMITIVES}; use the builder sah")
    if not fits(device, count):
        raise NoRoomError(
            f"building a BVH over {count} primitives needs larger buffers than the "
            f"{device.info.max_alloc_bytes} bytes that {device.info.name} allows; use the builder sah"
        )
    source = program_source(shape, len(triangles) > 0, len(spheres) > 0, reinsertions > 0)
    work = DataParallel(device, source, count * SHAPE * 4)
    primitives = sort_primitives(work, triangles, spheres)
    tree = cluster(work, primitives)
    if reinsertions:
        tree = reinsert(work, primitives, tree, reinsertions)
    plan = _plan(work, shape, primitives, tree)
    levels, stack = _open(work, shape, plan)
    return _write(work, shape, plan, levels, stack)


def program_source(shape: BuilderLayout, triangles: bool, spheres: bool, reinsertions: bool) -> str:
    """Return the builder's program, for scenes with triangles, with spheres, and with reinsertion passes."""
    values = {
        "CHILDREN": shape.children,
        "LEAF_SIZE": shape.leaf_size,
        "PACK": shape.pack,
        "EMPTY": EMPTY,
        "SLOW": SLOW,
        "LANES": math.prod(shape.leaf["primitive"].shape),
        "TRIANGLES": int(triangles),
        "SPHERES": int(spheres),
        "GROUPS": int(shape.compressed),
        "ONE_KIND": int(shape.compressed and triangles and spheres),
    }
    records = {
        "BinaryNode": BINARY_NODE,
        "Move": MOVE,
        "World": WORLD,
        "Node": shape.node,
        "Triangles": shape.leaf,
        "LeafSphere": LEAF_SPHERE,
    }
    files = {
        "REINSERTION": ["build/reinsert.cl"] if reinsertions else [],
        "SLOTS": ["build/slots_octant.cl" if shape.compressed else "build/slots.cl"],
        "WRITER": [shape.writer],
    }
    return compose("\n".join([defines(values), typedefs(records)]), "build/builder.cl", files)


class _Plan(NamedTuple):
    """A binary BVH with a decision per node: kept, made a leaf, or opened. area: half the root's surface area."""

    primitives: Primitives
    tree: BinaryTree
    plans: cl.Buffer
    area: float

    @property
    def arguments(self) -> Sequence[cl.Buffer | int]:
        """Return the first arguments of the kernels that process a level."""
        return *self.primitives.arguments, self.tree.nodes, self.plans


@dataclass(frozen=True, eq=False)
class _Level:
    """A level of the wide BVH: `count` nodes, their slots and record positions, and the stack entries above each.

    records: numbers of child nodes and of leaf records for triangles and spheres.
    """

    count: int
    slots: cl.Buffer
    places: cl.Buffer
    waiting: cl.Buffer
    records: tuple[int, int, int]

    @property
    def arrays(self) -> tuple[cl.Buffer, cl.Buffer, cl.Buffer]:
        """Return the arrays on the device."""
        return self.slots, self.places, self.waiting


def _plan(work: DataParallel, shape: BuilderLayout, primitives: Primitives, tree: BinaryTree) -> _Plan:
    """Plan the wide BVH in the rounds of the binary one, as each depends on those before. The last node is the root."""
    root, world = tree.count - 1, np.zeros(1, WORLD)
    top = work.download(tree.nodes, BINARY_NODE, 1, root)
    size, area = top["hi"] - top["lo"], half_area(top["lo"], top["hi"])
    for per, none, whole in (("per_side", "no_side", size), ("per_area", "no_area", area)):
        some = whole > np.finfo(np.float32).tiny
        world[per], world[none] = np.divide(1, whole, out=np.zeros_like(whole), where=some), ~some
    plans, leaves = work.empty(np.uint32, tree.count), work.empty(np.float32, 2 * tree.count)
    costs = work.empty(np.float32, tree.count * (shape.children - 1))
    for first, count in zip(itertools.accumulate(tree.rounds, initial=0), tree.rounds):
        work.run_each(
            "plan_nodes", count, *primitives.arguments, tree.nodes, first, root, world[0], plans, costs, leaves
        )
    work.free(costs, leaves)
    return _Plan(primitives, tree, plans, float(area[0]))


def _open(work: DataParallel, shape: BuilderLayout, plan: _Plan) -> tuple[list[_Level], int]:
    """Return the levels of the wide BVH and its maximum traversal stack size. Starts at a node above the root."""
    slots = np.full(shape.children, EMPTY, np.int32)
    slots[0] = plan.tree.count - 1
    nothing, most = np.zeros(3, np.uint32), work.zeros(np.int32, 1)
    levels = [_Level(1, work.upload(slots), work.upload(nothing), work.upload(nothing), (1, 0, 0))]
    while below := levels[-1].records[0]:
        above, places = levels[-1], work.empty(np.uint32, 3 * below)
        children, waiting = work.empty(np.int32, below * shape.children), work.empty(np.int32, below)
        work.run_each("open_level", above.count, *plan.arguments, *above.arrays, below, children, places, waiting, most)
        work.scan(places, below, 3)
        nodes, triangles, spheres = work.sums(3)
        levels.append(_Level(below, children, places, waiting, (nodes, triangles, spheres)))
    work.free(*levels[0].arrays)
    return levels[1:], int(work.download(most, np.int32, 1)[0])


def _write(work: DataParallel, shape: BuilderLayout, plan: _Plan, levels: list[_Level], stack: int) -> DeviceTree:
    """Write nodes and leaves, level by level."""
    sizes, records = [level.count for level in levels], [level.records for level in levels]
    each, besides = shape.records
    counts = sum(sizes) * each + besides, sum(r[1] for r in records), sum(r[2] for r in records)
    arrays = work.empty(shape.node, counts[0]), work.empty(shape.leaf, counts[1]), work.empty(LEAF_SPHERE, counts[2])
    visited = work.empty(np.float32, sum(sizes))
    node = triangle = sphere = 0
    for level in levels:
        work.run_each(
            "write_level",
            level.count,
            *plan.arguments,
            level.slots,
            level.places,
            node,
            node + level.count,
            triangle,
            sphere,
            *arrays,
            visited,
        )
        node, triangle, sphere = node + level.count, triangle + level.records[1], sphere + level.records[2]
        work.free(*level.arrays)
    tiles = work.tiles(sum(sizes))
    areas = work.empty(np.float32, tiles)
    work.run_tiles("sum_areas", sum(sizes), visited, areas)
    area = plan.area + float(work.download(areas, np.float32, tiles).sum(dtype=np.float64))
    work.free(visited, areas, plan.tree.nodes, plan.plans, plan.primitives.shapes, plan.primitives.ids)
    cost = area / plan.area if plan.area else float(sum(sizes) + counts[1] + counts[2])
    level_sizes = [1] * (besides > 0) + [each * size for size in sizes]
    return DeviceTree(arrays, counts, sum(level_sizes), len(sizes), stack, cost, level_sizes, work.peak_bytes)
