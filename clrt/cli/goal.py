"""Stopping criteria of a render and its estimated end, for the progress display."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import floor
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..rendering.renderer import State


class RenderSpeed:
    """Current speed of a render, which varies with other programs' load, and with where samples are taken."""

    WINDOW = 10.0

    def __init__(self) -> None:
        self._seen: deque[tuple[float, int]] = deque()

    def add(self, seconds: float, samples: int) -> None:
        """Record the number of samples of all pixels after `seconds`."""
        self._seen.append((seconds, samples))
        while len(self._seen) > 2 and seconds - self._seen[1][0] >= self.WINDOW:
            self._seen.popleft()

    @property
    def rate(self) -> float:
        """Samples per second over the last WINDOW seconds, or since the previous record; initially since the start."""
        (start, before), (end, samples) = self._seen[0], self._seen[-1]
        if end <= start or samples <= before:
            start, before = 0.0, 0
        return (samples - before) / max(end - start, 1e-9)


class FrameSpeed:
    """Speed of rendering the frames of an animation. Suspended time, which the clock does not count, is left out."""

    def __init__(self) -> None:
        self._begun: tuple[float, int] | None = None

    def left(self, now: float, done: int, count: int) -> float | None:
        """Return the seconds until all `count` frames are done, of which `done` are; None before the first one is.

        now: of a clock. The frames done at the first call do not count: they are from an earlier run.
        """
        if self._begun is None:
            self._begun = now, done
        start, before = self._begun
        return (now - start) / (done - before) * (count - done) if done > before else None


def duration(seconds: float) -> str:
    """Format a time to go: in seconds below two minutes, then in minutes, then in hours."""
    if seconds < 119.5:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7170 else f"{seconds / 3600:.1f} h"


@dataclass(frozen=True)
class Goal:
    """Stopping criteria, as far as known. percentile: of the tiles that must reach the error."""

    spp: int | None
    seconds: float | None
    error: float | None
    percentile: float | None = None

    def done(self, state: State) -> float:
        """Return the fraction done, 0 to 1."""
        parts = [state.spp / self.spp] if self.spp else []
        parts += [state.seconds / self.seconds] if self.seconds else []
        parts += [(self.error / state.stops_by) ** 2] if self.error and state.stops_by else []
        return min(1.0, max(parts, default=0.0))

    def percent(self, state: State) -> str:
        """Format the fraction done, rounded down: 100 % is reached at the end only."""
        return f"{floor(100 * self.done(state)):3} %  "


def time_left(state: State, goal: Goal, rate: float) -> float | None:
    """Return the seconds until the first criterion is met at `rate` samples per second; None if unknown.

    The squared noise is proportional to 1/samples.
    """
    ends = [] if goal.seconds is None else [goal.seconds - state.seconds]
    if goal.spp is not None and rate > 0:
        ends.append((goal.spp * state.film.pixels.size - state.film.samples) / rate)
    if goal.error is not None and state.stops_by and rate > 0:
        ends.append(((state.stops_by / goal.error) ** 2 - 1) * state.film.samples / rate)
    return max(0.0, min(ends)) if ends else None
