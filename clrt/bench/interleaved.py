"""Interleaved timing of contestants: load from other processes affects all equally, so ratios remain reliable."""

from __future__ import annotations

from collections.abc import Callable
from statistics import median
from typing import Any, NamedTuple

ROUNDS = 7


class Contestant(NamedTuple):
    """A contestant. run: does the work once, and returns its seconds and processor seconds; rays: their number.

    agrees: the fraction of rays for which its result agrees with the first contestant's.
    """

    run: Callable[[], tuple[float, float]]
    rays: int
    agrees: float = 1.0


def race(contestants: dict[str, Contestant], rounds: int = ROUNDS) -> dict[str, dict[str, Any]]:
    """Return each contestant's medians over rounds in which all run once; they should be warmed up.

    ratio, cpu_ratio: rays per second, and per processor second, of the first contestant over this one's; rounds: the
    measurements of each round.
    """
    taken: dict[str, list[tuple[float, float]]] = {name: [] for name in contestants}
    for _ in range(rounds):
        for name, contestant in contestants.items():
            taken[name].append(contestant.run())
    medians = {name: [median(each) for each in zip(*seconds)] for name, seconds in taken.items()}
    first = next(iter(contestants))
    per_ray = {name: [value / contestants[name].rays for value in values] for name, values in medians.items()}
    return {
        name: {
            "rays": contestants[name].rays,
            "seconds": seconds,
            "cpu_seconds": cpu_seconds,
            "mrays": 1e-6 / per_ray[name][0],
            "ratio": per_ray[name][0] / per_ray[first][0],
            "cpu_ratio": per_ray[name][1] / max(per_ray[first][1], 1e-12),
            "agrees": contestants[name].agrees,
            "rounds": taken[name],
        }
        for name, (seconds, cpu_seconds) in medians.items()
    }
