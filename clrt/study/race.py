"""Contestants in turns: what a busy machine does meets all of them alike, so ratios hold where seconds do not."""

from __future__ import annotations

from collections.abc import Callable
from statistics import median
from typing import Any, NamedTuple

ROUNDS = 7


class Contestant(NamedTuple):
    """run: does the work once, returns its seconds and processor seconds; rays: how many that were.

    agrees: the part of the rays for which it finds what the first contestant does.
    """

    run: Callable[[], tuple[float, float]]
    rays: int
    agrees: float = 1.0


def race(contestants: dict[str, Contestant], rounds: int = ROUNDS) -> dict[str, dict[str, Any]]:
    """Of each contestant the medians over rounds in which all run once; they should be warm.

    ratio, cpu_ratio: rays a second, and a processor second, of the first contestant over this one's; rounds: what the
    medians are of.
    """
    taken: dict[str, list[tuple[float, float]]] = {name: [] for name in contestants}
    for _ in range(rounds):
        for name, contestant in contestants.items():
            taken[name].append(contestant.run())
    medians = {name: [median(each) for each in zip(*seconds)] for name, seconds in taken.items()}
    first = next(iter(contestants))
    per_ray = {name: [value / contestants[name].rays for value in values] for name, values in medians.items()}
    return {name: {"rays": contestants[name].rays, "seconds": seconds, "cpu_seconds": cpu_seconds,
                   "mrays": 1e-6 / per_ray[name][0], "ratio": per_ray[name][0] / per_ray[first][0],
                   "cpu_ratio": per_ray[name][1] / max(per_ray[first][1], 1e-12), "agrees": contestants[name].agrees,
                   "rounds": taken[name]}
            for name, (seconds, cpu_seconds) in medians.items()}
