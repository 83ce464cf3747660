"""Samples of the next pass may be rendered early without being visible in the film."""

from __future__ import annotations

import numpy as np
import pytest

from clrt.farm.next_pass import NextPass
from clrt.rendering.accumulation.work_queue import WorkPart, WorkQueue
from clrt.rendering.film.tiles import TILE_PIXELS

PIXEL = np.dtype([("count", np.int64)])
TILES = (4, 9)


@pytest.mark.parametrize("seed", range(6))
def test_every_pass_ends_as_if_all_had_waited(seed: int) -> None:
    """Tasks of random sizes end in any order and some are returned; the third pass differs from the one that was begun
    early."""
    rng = np.random.default_rng(seed)
    work, ahead = WorkQueue(np.zeros(TILES, np.int64)), NextPass(np.zeros((36, TILE_PIXELS), PIXEL))
    in_flight: list[tuple[WorkQueue, WorkPart]] = []
    early = 0
    work.add_to_all(5)
    for following, end in ((7, 5), (4, 12), (9, 14)):
        ahead.plan(work, following)
        while work.parts or any(of is work for of, _ in in_flight):
            found = ahead.cut(work, int(rng.integers(1, 60)), 2, 9, [part for _, part in in_flight])
            assert found or in_flight
            in_flight += [found] if found else []
            if found and rng.random() < 0.6:
                continue
            of, part = in_flight.pop(int(rng.integers(len(in_flight))))
            if rng.random() < 0.2:
                of.give_back(part)
                continue
            tiles = of.tiles[part.first : part.end]
            pixels = ahead.film[tiles]
            assert np.all(pixels["count"] == part.samples)
            pixels["count"] += part.more
            ahead.take(of, tiles, pixels)
            early += of is not work
            assert np.all(ahead.shown()["count"] <= end)
        work.settle()
        assert np.all(ahead.shown()["count"] == end) and np.all(work.samples == end)
        if end == 12:
            ahead.forget()
            in_flight.clear()
            work.add_to_all(2)
        else:
            assert ahead.work
            work = ahead.work
            ahead.begin()
    assert early
