"""The program of a ray query: traversal of one BVH layout, and the kernel that answers rays with it."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..accel.layouts import Layout
from ..accel.methods import HitTests
from ..accel.traversal_kernels import tree_buffers, tree_defines, tree_features, tree_files
from ..accel.wide import EMPTY
from ..device.programs.preamble import defines, scene_struct, typedefs
from ..device.programs.program import compose
from ..device.programs.struct_types import record
from ..errors import check_choice

HIT = record(t="f4", primitive="i4", u="f4", v="f4")
INSTANCE_HIT = record(t="f4", primitive="i4", u="f4", v="f4", instance="i4", pad="3i4")
COUNTS = record(triangles="i4", spheres="i4", pad="2i4")
#: Traversals of bvh8: single rays, packets of eight coherent ones (kernels/traverse/packet.cl), interleaved pools.
TRAVERSALS = ("single", "packet", "pool")
#: Rays in a work-item's pool (kernels/traverse/pool.cl), and rays that a work-item traces in total.
POOL, SHARE = 32, 512
QUERIES = ("closest_hit", "any_hit", "next_hit")


def hit_record(tree: Layout) -> np.dtype[Any]:
    """Return the record type of the hits in a BVH."""
    return INSTANCE_HIT if "instances" in tree.buffers else HIT


def program_source(
    name: str,
    traversal: str,
    tree: Layout,
    kinds: tuple[bool, bool],
    tests: HitTests,
    lanes: int,
    loop_limit: bool,
) -> str:
    """Return the source of the program for `name`, one of QUERIES, and a traversal of TRAVERSALS.

    kinds: whether there are triangles and spheres; lanes, loop_limit: of the device (see Device.lanes, loop_turns).
    """
    check_choice("query", name, QUERIES)
    check_choice("traversal", traversal, TRAVERSALS)
    hit = hit_record(tree)
    has = tree_features(*kinds) | {
        "INSTANCES": hit is INSTANCE_HIT,
        "NEXT_HIT": name == "next_hit",
        "LOOP_LIMIT": loop_limit,
    }
    values = {"LANES": lanes, **tree_defines(tree)}
    values |= {feature: 1 for feature, present in has.items() if present}
    values |= {
        "packet": {"PACKET_RAYS": 1, "EMPTY": EMPTY},
        "single": {},
        "pool": {"POOL": POOL, "SHARE": SHARE, "STOP_AT_FIRST": int(name == "any_hit")},
    }[traversal]
    preamble = "\n".join(
        [defines(values), typedefs({"Counts": COUNTS, "RayHit": hit}), scene_struct(tree_buffers(tree))]
    )
    files = tree_files(tree.name, tests, *kinds, instances=hit is INSTANCE_HIT)
    return compose(
        preamble,
        "query/query_pool.cl" if traversal == "pool" else "query/query.cl",
        files | {"PACKETS": ["traverse/packet.cl"] if traversal == "packet" else []},
    )
