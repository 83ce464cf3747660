"""BVH layouts compared: the same rays and triangles, in interleaved runs; the hits must be bitwise equal."""

from __future__ import annotations

import time
from statistics import median
from typing import Any

import numpy as np

from ...accel.methods import TREELESS
from ...queries.mesh import RayQuery
from ...queries.query_program import TRAVERSALS
from ..interleaved import Contestant, race
from .node_visits import visits_a_ray
from .ray_speed import Floats, Run, differing, every
from .workloads import Faces, Workload, closed_room, workloads

#: Layout and traversal by name.
CONTESTANTS: dict[str, tuple[str, str | None]] = {
    **{f"bvh8, {traversal}": ("bvh8", traversal) for traversal in TRAVERSALS},
    "bvh2": ("bvh2", None),
    "cwbvh": ("cwbvh", None),
    **{layout: (layout, None) for layout in TREELESS},
}
SIZE, QUICK_SIZE = (800, 800), (128, 128)
#: Most rays times triangles for brute force, which traces an evenly spaced subset of the rays.
LIST_TESTS = 1 << 24
COUNTED = 16
ROUNDS, QUICK_ROUNDS = 7, 3


def measure_layouts(
    vertices: Floats,
    faces: Faces,
    *,
    layout: str | None = None,
    builder: str | None = None,
    quick: bool = False,
    **options: Any,
) -> dict[str, Any]:
    """Return the results of `clrt bench rays` without a ray file: the mesh in a closed room, see `workloads`.

    vertices: (n, 3); faces: (m, 3); layout: only this one; builder: for BVH layouts; options: see RayQuery. trees: by
    contestant; kinds: for each kind of rays the result of `race` for each contestant, and mrays_call: including the
    call from Python; hits: the fraction of its rays that hit; differ: for how many of its rays the result is not
    bitwise equal to the first contestant's; nodes, tests: see `visits_a_ray`, for every COUNTED-th ray.
    """
    scene = closed_room(vertices, faces)
    chosen = CONTESTANTS if layout is None else {layout: (layout, None)}
    trees, queries = {}, {}
    for name, (each, traversal) in chosen.items():
        start = time.perf_counter()
        queries[name] = RayQuery(
            *scene, layout=each, builder=None if each in TREELESS else builder, traversal=traversal, **options
        )
        trees[name] = _tree(queries[name], time.perf_counter() - start, len(scene[1]))
    first = next(iter(queries.values()))
    kinds = workloads(*scene, vertices, first.closest_hit, QUICK_SIZE if quick else SIZE)
    return {
        "device": first.device.info.name,
        "platform": first.device.info.platform,
        "device_type": first.device.info.type,
        "triangles": len(scene[1]),
        "trees": trees,
        "kinds": {
            kind.name: _measure(queries, kind, len(scene[1]), QUICK_ROUNDS if quick else ROUNDS) for kind in kinds
        },
    }


def _tree(query: RayQuery, seconds: float, triangles: int) -> dict[str, Any]:
    """Describe a BVH. build_seconds: of the query, from arrays to the BVH on the device; tree_seconds: of the BVH."""
    tree = query.tree
    return {
        "layout": tree.name,
        "builder": tree.builder,
        "build_seconds": seconds,
        "tree_seconds": tree.build_seconds,
        "nodes": tree.nodes,
        "depth": tree.depth,
        "stack": tree.stack,
        "sah_cost": tree.sah_cost,
        "bytes_per_triangle": tree.bytes / triangles,
    }


def _measure(queries: dict[str, RayQuery], kind: Workload, triangles: int, rounds: int) -> dict[str, dict[str, Any]]:
    few = -(-len(kind.rays[2]) * triangles // LIST_TESTS)
    steps = {name: few if query.tree.name in TREELESS else 1 for name, query in queries.items()}
    runs = {
        name: Run(query, query.any_hit if kind.any_hit else query.closest_hit, every(steps[name], kind.rays))
        for name, query in queries.items()
    }
    result = race({name: Contestant(run, len(run.answers)) for name, run in runs.items()}, rounds)
    expected = next(iter(runs.values())).answers
    for name, run in runs.items():
        answers, counted = run.answers, every(max(steps[name], COUNTED), kind.rays)
        differ = int(np.count_nonzero(differing(expected[:: steps[name]], answers)))
        result[name] |= {
            "mrays_call": 1e-6 * len(answers) / median(run.calls),
            "differ": differ,
            "agrees": 1 - differ / len(answers),
            "hits": float(np.mean(answers if kind.any_hit else answers["primitive"] >= 0)),
            **visits_a_ray(queries[name], counted, any_hit=kind.any_hit),
        }
    return result
