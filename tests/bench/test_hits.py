"""`clrt bench hits` on small cases: all layouts and builders are covered, nothing differs, and errors are counted."""

from __future__ import annotations

import numpy as np
import pytest

import clrt
from clrt.accel.methods import TREELESS
from clrt.bench.numerics.aimed_rays import all_rays, rays_of_kinds
from clrt.bench.numerics.hit_agreement import Case, Effort, measure_case
from clrt.bench.rays.hard_meshes import icosphere, soup
from clrt.bench.rays.ray_speed import differing
from clrt.device.open import Device
from clrt.queries.query_program import HIT

EFFORT = Effort(rays=300, subdivisions=0, soup=0, list_tests=1 << 17, exact_tests=1 << 18)
CASES = {"icosphere": Case("icosphere", icosphere(2), True), "soup": Case("soup", soup(500), False)}


@pytest.mark.parametrize("name", CASES)
def test_nothing_differs_and_every_way_is_taken(device: Device, name: str) -> None:
    case = CASES[name]
    result = measure_case(case, [device.info.index, device.info.index], EFFORT)
    ways = {(way["layout"], way["builder"], way["traversal"]) for way in result["ways"]}
    trees = {(layout, builder, "single") for layout in ("bvh8", "bvh2", "cwbvh") for builder in ("sah", "midpoint")}
    trees |= {("bvh8", builder, way) for builder in ("ploc", "reinsertion", "sah") for way in ("packet", "pool")}
    assert ways >= trees | {("list", "sah", "single"), ("packs", "sah", "single"), ("bvh8", "ploc", "single")}
    assert len(result["ways"]) == 2 * len(ways) and not any("error" in way for way in result["ways"])
    assert all(way["differ"] == {"random": 0, "vertices": 0, "edges": 0, "axes": 0} for way in result["ways"])
    few = {way["rays"] for way in result["ways"] if way["layout"] in TREELESS}
    assert result["rays"] == 1200 and few == {-(-1200 // -(-1200 * result["triangles"] // EFFORT.list_tests))}
    assert result["exact"]["wrong"] == 0 and 0.2 < result["exact"]["decided"] / result["exact"]["rays"] <= 1
    assert result["escaped"] == (0 if case.closed else None)


def test_hits_through_holes_are_counted(device: Device) -> None:
    """A mesh declared closed lacks every other triangle, but has all vertices and edges."""
    vertices, faces = icosphere(2)
    result = measure_case(Case("sieve", (vertices, faces[::2]), True), [device.info.index], EFFORT)
    kinds = rays_of_kinds(vertices, faces[::2], EFFORT.rays)
    hits = clrt.RayQuery(vertices, faces[::2], device=device.info.index, layout="list").closest_hit(*all_rays(kinds))
    assert result["escaped"] == np.sum(hits["primitive"][300:900] < 0) > 10
    assert result["exact"]["wrong"] == 0


def test_differing_counts_bits() -> None:
    one = np.zeros(6, HIT)
    one["t"][3] = np.nan
    other = one.copy()
    other["t"][0], other["u"][1], other["primitive"][2] = -0.0, 1e-45, 7
    assert differing(one, other).tolist() == [True, True, True, False, False, False]
    assert differing(one[::2], other[::2]).tolist() == [True, True, False]
    assert differing(np.array([True, False]), np.array([True, True])).tolist() == [False, True]
