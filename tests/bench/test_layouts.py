"""All layouts are measured with the same rays and give the same answers."""

from __future__ import annotations

import numpy as np
import pytest

import clrt
from clrt.accel.methods import TREELESS
from clrt.bench.rays.hard_meshes import icosphere
from clrt.bench.rays.layout_speed import measure_layouts
from clrt.bench.rays.workloads import closed_room
from clrt.device.open import Device

BALL = icosphere(4)


@pytest.mark.parametrize("builder", [None, "midpoint"])
def test_all_layouts_answer_alike(device: Device, builder: str | None) -> None:
    result = measure_layouts(*BALL, quick=True, device=device.info.index, builder=builder)
    names = ["bvh8, single", "bvh8, packet", "bvh8, pool", "bvh2", "cwbvh", "packs", "list"]
    assert list(result["trees"]) == names and result["triangles"] == 5120 + 12
    assert list(result["kinds"]) == ["primary", "bounce", "shadow", "occluded"]
    for kind, rows in result["kinds"].items():
        assert list(rows) == names and all(row["differ"] == 0 and row["agrees"] == 1 for row in rows.values())
        assert all(row["mrays"] > 0 and row["mrays_call"] > 0 for row in rows.values())
        assert rows["list"]["rays"] < rows["bvh2"]["rays"] <= 128 * 128, "a list gets fewer"
        for row in rows.values():
            assert row["hits"] == 1 if kind in ("primary", "bounce") else 0 < row["hits"] <= 1
    for name, tree in result["trees"].items():
        query = clrt.RayQuery(
            *closed_room(*BALL),
            device=device.info.index,
            layout=tree["layout"],
            builder=builder if name not in TREELESS else None,
        )
        assert tree["bytes_per_triangle"] * 5132 == pytest.approx(query.tree.bytes)
        assert (tree["builder"], tree["sah_cost"]) == (query.tree.builder, query.tree.sah_cost)


def test_one_layout_alone(device: Device) -> None:
    result = measure_layouts(*BALL, quick=True, device=device.info.index, layout="bvh2", triangle="moller_trumbore")
    assert list(result["trees"]) == ["bvh2"] and np.isclose(result["kinds"]["primary"]["bvh2"]["ratio"], 1)
