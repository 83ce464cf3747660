"""Traversal statistics: nodes and intersection tests per ray, counted by the traversal (kernels/traverse/visits.cl)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...device.programs.struct_types import record
from ...queries.base import TreeQuery
from .ray_speed import Rays

#: Counts by what is visited (kernels/traverse/visits.cl).
VISITS = record(nodes="u4", leaves="u4", tests="u4", spheres="u4", instances="u4", closest="u4", blocked="u4", pad="u4")


class _Counting(TreeQuery):
    """Query with the same results as another one that also counts; up to 2^32 visits."""

    def __init__(self, query: TreeQuery) -> None:
        tree = replace(query.tree, buffers={**query.tree.buffers, "visits": np.zeros(1, VISITS)})
        counts = int(query._counts["triangles"][0]), int(query._counts["spheres"][0])
        super().__init__(query.device, tree, counts, query.frame, query._tests, query._traversal)


def visits_a_ray(query: TreeQuery, rays: Rays, *, any_hit: bool) -> dict[str, float]:
    """Return `nodes` and `tests` per ray, for closest hits or for any hit."""
    counting = _Counting(query)
    (counting.any_hit if any_hit else counting.closest_hit)(*rays)
    counted = counting.tree.buffers["visits"].read(query.device)[0]
    return {name: int(counted[name]) / len(rays[2]) for name in ("nodes", "tests")}
