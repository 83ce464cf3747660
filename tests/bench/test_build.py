"""`clrt bench build`: consistent figures, rays by mesh size, and fresh processes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import clrt
from clrt.accel.builders import BUILDERS
from clrt.bench.rays.build_speed import measure_builders, measure_growth
from clrt.bench.rays.cold_start import measure_fresh
from clrt.bench.rays.hard_meshes import icosphere
from clrt.bench.rays.workloads import Workload, camera_rays, closed_room
from clrt.device.open import Device

SCENE = closed_room(*icosphere(3))
RAYS = camera_rays(np.array([0.0, 0.2, 2.5]), np.zeros(3), (50, 40))


def test_builders_figures_fit_each_other(device: Device) -> None:
    result = measure_builders(SCENE, device)
    count, builders = result["triangles"], result["builders"]
    assert count == 1280 + 12 and {"sah", "midpoint", "embree"} <= set(builders)
    ours = {name: row for name, row in builders.items() if name != "embree"}
    for name, row in builders.items():
        assert row["mtriangles"] * row["seconds"] == pytest.approx(count / 1e6)
        assert 0 < row["seconds"] and 0 < row["first_seconds"] and 20 < row["bytes_per_triangle"] < 500
    for name, row in ours.items():
        query = clrt.RayQuery(*SCENE, device=device.info.index, builder=name)
        assert row["bytes_per_triangle"] * count == pytest.approx(query.tree.bytes)
        tree = query.tree
        assert (row["sah_cost"], row["depth"], row["stack"]) == (tree.sah_cost, tree.depth, tree.stack)
        assert row["cost_ratio"] * builders["sah"]["sah_cost"] == pytest.approx(row["sah_cost"])
        on_device = name not in BUILDERS
        assert (row["peak_bytes_per_triangle"] or 0) > (row["bytes_per_triangle"] if on_device else -1)
    assert builders["sah"]["cost_ratio"] == 1 < builders["midpoint"]["cost_ratio"]


def test_growth_fits_the_races_own_seconds(device: Device) -> None:
    scenes = {len(scene[1]): scene for scene in (SCENE, closed_room(*icosphere(1)), closed_room(*icosphere(4)))}
    queries = {size: clrt.RayQuery(*scene, device=device.info.index) for size, scene in scenes.items()}
    kinds = {size: [Workload("primary", False, RAYS), Workload("shadow", True, RAYS)] for size in scenes}
    result = measure_growth(queries, kinds)
    assert list(result["kinds"]) == list(result["fits"]) == ["primary", "shadow"]
    for kind, rows in result["kinds"].items():
        assert list(map(int, rows)) == list(scenes) and all(row["rays"] == 2000 for row in rows.values())
        seconds = [row["seconds"] / row["rays"] for row in rows.values()]
        slope, at_one = np.polyfit(np.log2(list(scenes)), seconds, 1)
        assert (result["fits"][kind]["a"], result["fits"][kind]["b"]) == pytest.approx((at_one, slope))


def test_a_new_process_finds_the_same_hits(device: Device, tmp_path: Path) -> None:
    hits = np.sum(clrt.RayQuery(*SCENE, device=device.info.index).closest_hit(*RAYS)["primitive"] >= 0)
    for _ in range(2):
        figures = measure_fresh(SCENE, RAYS, tmp_path, device=device.info.index, builder="midpoint")
        assert figures["hits"] == hits > 100
        assert 0 < figures["tree_seconds"] < figures["build_seconds"] and figures["answer_seconds"] > 0
        assert figures["peak_bytes"] > 3e7
    assert any(tmp_path.iterdir()), "programs are kept where it was said"
    with pytest.raises(clrt.ClrtError, match="builder 'none' is unknown"):
        measure_fresh(SCENE, RAYS, builder="none")
