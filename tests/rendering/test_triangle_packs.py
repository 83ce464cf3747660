"""Few triangles without a BVH, in packs that rays can skip: hits equal those of testing every triangle."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.accel.traversal_kernels import TREES
from clrt.bench.kernel_probe import Probe
from clrt.device.open import Device
from clrt.scene.model import Scene

from ..accel.cases import box
from ..covering import others
from .test_traverse import mesh

Doubles = NDArray[np.float64]
ROOM = box([-1, 0, -1], [7, 8, 7])
#: Three boxes on a room's floor, the room, a box below it, and a room that fills a pack: all have sides at y = 0.
PARTS = (
    *(box([2 * x, 0, 0], [2 * x + 1, 1, 1]) for x in range(3)),
    ROOM,
    box([-1, -1, -1], [7, 0, 7]),
    np.concatenate([ROOM, ROOM[:4]]),
)


def rays_at(seed: int) -> tuple[Doubles, Doubles]:
    """Return rays from in and around the room; a quarter go down through the boxes, on and between their diagonals."""
    rng = np.random.default_rng(seed)
    origin, direction = rng.uniform(-3, 9, (40_000, 3)), rng.normal(size=(40_000, 3))
    origin[::4] = rng.integers(0, 40, (10_000, 3)) / 8 * [1, 0.25, 0.25]
    direction[::4] = [0, -1, 0]
    return origin.astype(np.float32).astype(np.float64), direction.astype(np.float32).astype(np.float64)


@pytest.mark.parametrize("width", [8, *others(16)])
@pytest.mark.parametrize("order", [(0, 5), (3, 0), (2, 4, 3, 0, 1), (4, 0, 1, 2, 3)])
def test_hits_are_those_of_all_triangles(device: Device, order: tuple[int, ...], width: int) -> None:
    """Of hits at equal t the first triangle wins, even if it is in the last pack, in the other's lane."""
    scene = Scene(meshes=[mesh(np.concatenate([PARTS[k] for k in order]))])
    origin, direction = rays_at(len(order))
    apart, listed = Probe(device, scene, f"#define WIDTH {width}", layout="packs"), Probe(device, scene, layout="list")
    assert apart.compiled.tree.buffers["packs"]["count"][0] > 1
    places = listed.compiled.frame.points(origin)
    hits, expected = (probe("closest_hit", 4, places, direction) for probe in (apart, listed))
    assert np.array_equal(hits, expected)
    assert 1000 < np.count_nonzero(expected[:, 3] < 0) < 20_000
    limits = np.minimum(expected[:, 0], 5.0) * np.random.default_rng(1).uniform(0.5, 1.5, len(hits))
    blocked, beyond = (probe("any_hit", 1, places, direction, limits) for probe in (apart, listed))
    assert np.array_equal(blocked, beyond) and 0.2 < blocked.mean() < 0.8


@pytest.mark.programs
@pytest.mark.parametrize("layout", TREES)
def test_length_of_directions_changes_only_t(device: Device, layout: str) -> None:
    """Rays that start on or just above a floor and leave it, scaled by powers of two, so that all digits are
    preserved."""
    scene = Scene(meshes=[mesh(np.concatenate([PARTS[0], PARTS[3]]))])
    rng = np.random.default_rng(2)
    origin, direction = rng.uniform(0, 7, (40_000, 3)), rng.normal(size=(40_000, 3))
    origin[:, 1] = 10.0 ** rng.uniform(-14, -6, len(origin))
    direction[:, 1] = np.abs(direction[:, 1])
    probe = Probe(device, scene, layout=layout)
    expected = probe("closest_hit", 4, origin, direction)
    for power in (2.0**-40, 2.0**-20, 2.0**-8, 2.0**8, 2.0**20, 2.0**40):
        found = probe("closest_hit", 4, origin, direction * power)
        found[:, 0] *= power
        assert np.array_equal(found, expected), power
        blocked = probe("any_hit", 1, origin, direction * power, np.full(len(origin), 2.0**-10 / power))
        assert np.array_equal(blocked[:, 0] > 0, (expected[:, 0] < 2.0**-10)), power
