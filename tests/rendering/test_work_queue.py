"""Scheduling of work: however it is split, each tile's samples are rendered once and in order."""

from __future__ import annotations

import numpy as np
import pytest

from clrt.rendering.accumulation.work_queue import WorkPart, WorkQueue
from clrt.rendering.film.tiles import RUN, row_by_row, scattered, tile_by_tile


@pytest.mark.parametrize("seed", range(8))
def test_samples_come_once_and_in_their_order(seed: int) -> None:
    """Parts of all sizes are in flight together, finish in any order, and some fail and are given back."""
    rng = np.random.default_rng(seed)
    work, done = WorkQueue(np.zeros((5, 7), np.int64)), np.zeros(35, np.int64)
    in_flight: list[WorkPart] = []
    for step in range(4):
        if step % 2:
            work.double(rng.permutation(35)[: rng.integers(1, 36)])
        else:
            work = WorkQueue(np.full((5, 7), done.max()))
            done[:] = done.max()
            work.add_to_all(int(rng.integers(1, 40)))
        while work.parts or in_flight:
            share = work.cut(
                int(rng.integers(0, 200)),
                int(rng.integers(1, 9)),
                int(rng.integers(9, 40)),
                int(rng.integers(1, 60)),
                in_flight,
            )
            assert share is not None or in_flight
            in_flight += [share] if share else []
            if not share or rng.random() < 0.5:
                ended = in_flight.pop(int(rng.integers(len(in_flight))))
                if rng.random() < 0.2:
                    work.give_back(ended)
                    continue
                tiles = work.tiles[ended.first : ended.end]
                assert np.all(done[tiles] == ended.samples)
                done[tiles] += ended.more
        work.settle()
        assert np.array_equal(done, work.samples.ravel())


@pytest.mark.parametrize("seed", range(8))
def test_what_was_lost_is_in_hand_again(seed: int) -> None:
    """Parts with unknown outcome, some of them rendered: the film's sample counts decide what is left."""
    rng = np.random.default_rng(seed)
    work, done = WorkQueue(rng.integers(0, 3, (5, 7))), np.zeros(35, np.int64)
    done[:] = work.samples.ravel()
    work.double(rng.permutation(np.flatnonzero(done))[:20])
    expected = work.then.copy()
    while not np.array_equal(work.samples, expected):
        for _ in range(int(rng.integers(1, 4))):
            if (share := work.cut(int(rng.integers(0, 20)), int(rng.integers(1, 9)))) and rng.random() < 0.5:
                done[work.tiles[share.first : share.end]] += share.more * (
                    done[work.tiles[share.first : share.end]] == share.samples
                )
        work.take_stock(done.reshape(5, 7))
    assert np.array_equal(done, expected.ravel()) and not work.parts


@pytest.mark.parametrize(
    "most, least, expected",
    [
        (100, 1, WorkPart(0, 10, 3, 8)),
        (16, 1, WorkPart(0, 2, 3, 8)),
        (4, 1, WorkPart(0, 1, 3, 4)),
        (4, 4, WorkPart(0, 4, 3, 1)),
        (0, 5, WorkPart(0, 5, 3, 1)),
        (40, 10, WorkPart(0, 10, 3, 4)),
    ],
)
def test_a_share_is_no_larger_than_asked(most: int, least: int, expected: WorkPart) -> None:
    """In tiles times samples, down to one sample of the fewest tiles; the remainder is queued after the other tiles."""
    work = WorkQueue(np.full((2, 5), 3))
    work.add_to_all(8)
    assert work.cut(most, least) == expected and work.left == 80 - (expected.end - expected.first) * expected.more
    if expected.more < 8:
        assert work.parts[-1] == WorkPart(0, expected.end, 3 + expected.more, 8 - expected.more)


@pytest.mark.parametrize("count", [1, 2, 3, 7, 64, 100, 1023, 4096])
def test_every_stretch_is_spread(count: int) -> None:
    """Among k consecutive runs the gaps are at most (1 + golden ratio) times the optimum, plus a constant."""
    order = scattered(count * RUN)
    assert sorted(order) == list(range(count * RUN))
    assert sorted(scattered(count)) == list(range(count))
    runs = order.reshape(count, RUN)
    assert np.all(np.diff(runs, axis=1) == 1)
    for k in (k for k in (2, 5, 13, 40) if k < count):
        for first in range(0, count - k, max(1, count // 7)):
            places = np.sort(runs[first : first + k, 0]) // RUN
            gaps = np.diff([*places, places[0] + count])
            assert gaps.max() <= 2.7 * count / k + 3


@pytest.mark.parametrize("size", [(8, 8), (1, 1), (61, 44), (64, 7)])
def test_tile_by_tile_and_back(size: tuple[int, int]) -> None:
    """A tile is eight rows of eight pixels."""
    values = np.arange(size[0] * size[1]).reshape(size[1], size[0])
    tiles = tile_by_tile(values)
    assert np.array_equal(row_by_row(tiles, size), values)
    inside = np.pad(values, ((0, -size[1] % 8), (0, -size[0] % 8)))[:8, :8]
    assert np.array_equal(tiles[0], inside.ravel())
