"""Binary BVH construction on the device by parallel locally-ordered clustering, PLOC (kernels/build/ploc.cl)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pyopencl as cl

from ..device.launches.data_parallel import DataParallel
from ..device.programs.struct_types import record
from .morton import Primitives

BINARY_NODE = record(lo="3f4", left="i4", hi="3f4", right="i4")
#: Search radius for nearest clusters, as in ploc.cl.
RADIUS = 8
#: Up to FEW clusters, one work-group runs the remaining rounds. A round that merges fewer than one in SLOW clusters is
#: followed by one that halves them, as in ploc.cl.
FEW, SLOW = 2048, 16


@dataclass(frozen=True, eq=False)
class BinaryTree:
    """Nodes of BINARY_NODE, one fewer than primitives, the root last; a child >= 0 is a node, ~p < 0 is primitive p.

    rounds: how many nodes each round made, in order: their children are from earlier rounds.
    """

    nodes: cl.Buffer
    rounds: list[int]

    @property
    def count(self) -> int:
        """Return the number of nodes."""
        return sum(self.rounds)


def cluster(work: DataParallel, primitives: Primitives) -> BinaryTree:
    """Build the binary BVH over at least two primitives."""
    clusters = primitives.count
    now, later = _columns(work, clusters), None
    nearest, nodes = work.empty(np.int8, clusters), work.empty(BINARY_NODE, clusters - 1)
    work.run_each("first_clusters", clusters, *primitives.arguments, *now)
    rounds: list[int] = []
    forced = False
    while clusters > FEW:
        work.run_each("nearest_clusters", clusters, *now, int(forced), nearest)
        offsets = work.empty(np.uint32, 2 * work.tiles(clusters))
        work.run_tiles("count_pairs", clusters, nearest, offsets)
        work.scan(offsets, work.tiles(clusters), 2)
        stay, joined = work.sums(2)
        later = later or _columns(work, stay)
        work.run_tiles("join_pairs", clusters, nearest, offsets, work.totals, *now, *later, nodes, sum(rounds))
        work.free(offsets)
        forced = joined * SLOW < clusters
        rounds.append(joined)
        clusters, now, later = stay, later, now
    later = later or _columns(work, clusters)
    # In at most every second round are fewer than one in SLOW clusters merged.
    most = 4 + int(math.log(FEW) / -math.log(1 - 1 / SLOW))
    made = work.empty(np.uint32, 1 + most)
    work.run_together("last_rounds", clusters, int(forced), nearest, *now, *later, nodes, sum(rounds), made)
    number, *joins = work.download(made, np.uint32, 1 + most).tolist()
    work.free(now[0], later[0], nearest, made)
    return BinaryTree(nodes, rounds + joins[:number])


def _columns(work: DataParallel, count: int) -> tuple[cl.Buffer, int]:
    """Allocate the columns of `count` clusters; return them with the pitch of their rows."""
    pitch = count + 2 * RADIUS
    return work.empty(np.float32, 7 * pitch), pitch
