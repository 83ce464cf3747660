"""Grouping of triangles into packs, evaluated by counting the cost per ray."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.accel.grouping import BOX_COST, MOST, packs_of
from clrt.accel.layouts import triangle_boxes

from .cases import box, soup

Floats = NDArray[np.float32]
SIZE = 16


def packs(triangles: Floats) -> list[list[int]]:
    return [pack.tolist() for pack in packs_of(*triangle_boxes(triangles), SIZE)]


def paid(triangles: Floats, made: list[list[int]]) -> float:
    """Return the cost of a ray through the scene's box: box tests, and packs weighted by hit probability."""
    low, high = (edge.astype(np.float64) for edge in triangle_boxes(triangles))

    def area(members: list[int]) -> float:
        x, y, z = high[members].max(axis=0) - low[members].min(axis=0)
        return float(x * y + y * z + z * x)

    return sum(BOX_COST + area(pack) / area([*range(len(triangles))]) for pack in made)


@pytest.mark.parametrize("first", ["room", "things"])
def test_a_room_and_what_stands_in_it_are_apart(first: str) -> None:
    room, table, lamp = box(0, 10), box(1, 3), box(6, 7)
    triangles = np.concatenate([room, table, lamp] if first == "room" else [lamp, table, room])
    made = packs(triangles)
    assert paid(triangles, made) <= paid(triangles, [[*range(k, k + 12)] for k in (0, 12, 24)]) + 1e-9


@pytest.mark.parametrize("seed", range(4))
def test_every_triangle_is_in_one_pack_and_rays_pay_no_more(seed: int) -> None:
    rng = np.random.default_rng(seed)
    things = [box(0, 10)] + [soup(9, seed=seed) * 2 + rng.uniform(0, 8, 3).astype(np.float32) for _ in range(4)]
    triangles = np.concatenate(things)[rng.permutation(48)]
    made = packs(triangles)
    assert sorted(k for pack in made for k in pack) == [*range(48)]
    assert all(len(pack) <= SIZE and pack == sorted(pack) for pack in made)
    assert paid(triangles, made) < paid(triangles, [[*range(k, k + SIZE)] for k in range(0, 48, SIZE)])


@pytest.mark.parametrize(
    "triangles",
    [soup(0), soup(1), box(0, 1), np.ones((40, 3, 3), np.float32), np.repeat(soup(1), 40, axis=0), soup(MOST + 1)],
    ids=["none", "one", "few", "points", "copies", "many"],
)
def test_what_cannot_be_grouped_is_taken_in_its_order(triangles: Floats) -> None:
    made = packs(triangles)
    assert made == [[*range(k, min(k + SIZE, len(triangles)))] for k in range(0, len(triangles), SIZE)]
