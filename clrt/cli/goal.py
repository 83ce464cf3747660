"""Where a render will stop, and when: for its progress."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import floor
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..rendering.renderer import State


class Pace:
    """How fast a render is of late: speeds change with other programs, and with where samples go."""

    WINDOW = 10.0

    def __init__(self) -> None:
        self._seen: deque[tuple[float, int]] = deque()

    def add(self, seconds: float, samples: int) -> None:
        """So many samples, of all pixels, were there after so many seconds."""
        self._seen.append((seconds, samples))
        while len(self._seen) > 2 and seconds - self._seen[1][0] >= self.WINDOW:
            self._seen.popleft()

    @property
    def rate(self) -> float:
        """Samples a second in the last WINDOW seconds, or since the last time before; at first since the start."""
        (start, before), (end, samples) = self._seen[0], self._seen[-1]
        if end <= start or samples <= before:
            start, before = 0.0, 0
        return (samples - before) / max(end - start, 1e-9)


@dataclass(frozen=True)
class Goal:
    """Where a render will stop, as far as that is known. percentile: of the tiles that are to have the error."""

    spp: int | None
    seconds: float | None
    error: float | None
    percentile: float | None = None

    def done(self, state: State) -> float:
        """The part that is done, 0 to 1."""
        parts = [state.spp / self.spp] if self.spp else []
        parts += [state.seconds / self.seconds] if self.seconds else []
        parts += [(self.error / state.stops_by) ** 2] if self.error and state.stops_by else []
        return min(1.0, max(parts, default=0.0))

    def percent(self, state: State) -> str:
        """What is done for certain, rounded down: 100 % is the end, and nothing else."""
        return f"{floor(100 * self.done(state)):3} %  "


def time_left(state: State, goal: Goal, rate: float) -> float | None:
    """Seconds until the render, at so many samples a second, stops by what comes first; None where that is not known.

    Noise² falls as 1/samples.
    """
    ends = [] if goal.seconds is None else [goal.seconds - state.seconds]
    if goal.spp is not None and rate > 0:
        ends.append((goal.spp * state.film.pixels.size - state.film.samples) / rate)
    if goal.error is not None and state.stops_by and rate > 0:
        ends.append(((state.stops_by / goal.error) ** 2 - 1) * state.film.samples / rate)
    return max(0.0, min(ends)) if ends else None
