"""The counted node visits and tests per ray follow from the BVH's boxes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import clrt
from clrt.accel.wide import EMPTY
from clrt.bench.rays.hard_meshes import icosphere
from clrt.bench.rays.node_visits import visits_a_ray
from clrt.bench.rays.ray_speed import Rays
from clrt.device.launches.device_arrays import DeviceArray
from clrt.device.open import Device

RNG = np.random.default_rng(2)
BALL = icosphere(3)
#: Rays nearer than this to a box's edge are excluded: kernels pad boxes, by less.
MARGIN = 1e-4


def past_the_ball(count: int) -> Rays:
    """Return rays at a distance of 1 to 1.2 from the center: they hit boxes but no triangle, so none ends early."""
    across, other = RNG.normal(size=(2, count, 3))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    direction = np.cross(across, other)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    origins = RNG.uniform(1, 1.2, (count, 1)) * across - 3 * direction
    return origins.astype(np.float32), direction.astype(np.float32), np.full(count, np.inf, np.float32)


def entered(low: NDArray[Any], high: NDArray[Any], rays: Rays, margin: float) -> NDArray[np.bool_]:
    """Return (rays, boxes): whether a ray hits a box enlarged by `margin`, by the slab test in float64."""
    origins, directions = (array[:, None].astype(np.float64) for array in rays[:2])
    one, other = (low - margin - origins) / directions, (high + margin - origins) / directions
    near, far = np.minimum(one, other).max(axis=2), np.maximum(one, other).min(axis=2)
    return np.asarray((near <= far) & (far >= 0) & (low <= high).all(axis=1))


def boxes(query: clrt.RayQuery) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Return low, high (b, 3), and the cost of entering each box: nodes and tests (b,)."""
    array = query.tree.buffers["nodes"]
    nodes = array.read(query.device) if isinstance(array, DeviceArray) else array
    if query.tree.name == "bvh2":
        return nodes["aabb_min"], nodes["aabb_max"], nodes["count"] == 0, nodes["count"]
    child = nodes["child"].ravel()
    low, high = (nodes[name].transpose(0, 2, 1).reshape(-1, 3) for name in ("lo", "hi"))
    return low, high, (child >= 0) & (child != EMPTY), child < 0


@pytest.mark.parametrize(("layout", "traversal"), [("bvh8", "pool"), ("bvh8", "single"), ("bvh2", "single")])
@pytest.mark.parametrize("any_hit", [False, True])
def test_rays_that_hit_nothing_visit_what_they_enter(
    device: Device, layout: str, traversal: str, any_hit: bool
) -> None:
    query = clrt.RayQuery(*BALL, device=device.info.index, layout=layout, builder="sah", traversal=traversal)
    assert query.frame.unit == 1
    low, high, nodes, tests = boxes(query)
    rays = past_the_ball(4000)
    small, large = (entered(low, high, rays, margin) for margin in (-MARGIN, MARGIN))
    clear = (small == large).all(axis=1) & (query.closest_hit(*rays)["primitive"] < 0)
    assert clear.sum() > 1000
    visits = visits_a_ray(query, (rays[0][clear], rays[1][clear], rays[2][clear]), any_hit=any_hit)
    root = 1 if layout == "bvh8" else 0  # the root's own box is not included
    assert visits["nodes"] == pytest.approx(root + (large[clear] @ nodes.astype(int)).mean())
    assert visits["tests"] == pytest.approx((large[clear] @ tests.astype(int)).mean())
    assert visits["tests"] > 0.05


def test_lists_test_all_up_to_the_first_that_blocks(device: Device) -> None:
    """Three stacked triangles seen from both sides: the order of the list counts, not that along the ray."""
    vertices = np.array([[x, y, z] for x, y in ((-1, -1), (1, -1), (0, 1)) for z in range(3)])
    faces = np.arange(9).reshape(3, 3).T
    origins = np.array([[0, 0, 5], [0, 0, -5], [3, 3, 5]], np.float32)
    directions = np.array([[0, 0, -1], [0, 0, 1], [0, 0, -1]], np.float32)
    rays = origins, directions, np.full(3, np.inf, np.float32)
    query = clrt.RayQuery(vertices, faces, device=device.info.index, layout="list")
    assert visits_a_ray(query, rays, any_hit=False) == {"nodes": 0, "tests": 3}
    assert visits_a_ray(query, rays, any_hit=True) == {"nodes": 0, "tests": pytest.approx((1 + 1 + 3) / 3)}


def test_counting_changes_no_other_program(device: Device) -> None:
    query = clrt.RayQuery(*BALL, device=device.info.index)
    before = query.source("closest_hit", "single")
    visits_a_ray(query, past_the_ball(10), any_hit=False)
    assert query.source("closest_hit", "single") == before and "#define COUNT_VISITS" not in before
