"""Stop conditions of a render: a sample count, a time, or an error, whichever is reached first."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Integral, Real
from typing import Any

from ..errors import UsageError
from ..scene.model import RenderSettings
from .error_estimate.adaptive_sampling import FLOOR_SPP

#: Number of checks of a target error between two powers of two of the samples.
CHECKS = 8


def planned_spp(settings: RenderSettings, spp: int | None, time: float | None, error: float | None) -> int | None:
    """Return the samples per pixel that `passes` takes with these stop conditions; None if only time or error stops it.
    Raises UsageError like `check_stops`."""
    check_stops(spp, time, error)
    return settings.spp if spp is None and time is None and error is None else spp


def planned_error(settings: RenderSettings, spp: int | None, time: float | None, error: float | None) -> float | None:
    """Return the estimated error at which `passes` stops with these stop conditions; None if none does."""
    return settings.error if spp is None and time is None and error is None else error


def check_stops(spp: int | None, time: float | None = None, error: float | None = None) -> None:
    """Raise UsageError unless each stop condition that is given is a finite number above 0, and spp an integer."""
    given: list[tuple[str, Any, Any]] = [("spp", spp, Integral), ("time", time, Real), ("error", error, Real)]
    for name, value, kind in given:
        if value is None:
            continue
        if not isinstance(value, kind) or isinstance(value, bool):
            raise UsageError(f"{name} is {value!r}; give a {'whole ' if kind is Integral else ''}number above 0")
        if not 0 < value < float("inf"):
            finite = "" if kind is Integral else " and finite"
            raise UsageError(f"{name} is {value}; it must be above 0{finite}")


def checked_percentile(percentile: Any) -> float | None:
    """Return the percentile, if given. Raises UsageError if it is not a number above 0 and at most 100."""
    if percentile is None:
        return None
    if not isinstance(percentile, Real) or not 0 < float(percentile) <= 100:
        raise UsageError(f"error_percentile is {percentile!r}; it must be a number above 0 and at most 100")
    return float(percentile)


@dataclass(frozen=True)
class StopConditions:
    """Stop conditions of a render, each None or given; adaptive: whether the tiles' errors distribute samples."""

    spp: int | None
    time: float | None
    error: float | None
    adaptive: bool

    @staticmethod
    def of(settings: RenderSettings, spp: int | None, time: float | None, error: float | None) -> StopConditions:
        """Return the stop conditions given, or else the scene's. Raises UsageError like `check_stops`."""
        planned, target = planned_spp(settings, spp, time, error), planned_error(settings, spp, time, error)
        return StopConditions(planned, time, target, settings.adaptive)

    def reached(self, done: int, seconds: float) -> str | None:
        """Return the stop reason if an image has reached the sample count or the time already, else None."""
        if self.time_over(done, seconds):
            return "time"
        return "spp" if done and self.spp is not None and done >= self.spp else None

    def time_over(self, done: int, seconds: float) -> bool:
        """Return whether the time is over; never for an image without samples."""
        return bool(done) and self.time is not None and seconds >= self.time

    def adapts(self, done: int) -> bool:
        """Return whether the pass after `done` samples is adaptive."""
        return self.adaptive and done >= FLOOR_SPP

    def looks(self, done: int) -> bool:
        """Return whether the target error is checked at `done` samples; it ignores time, so that all runs agree."""
        return self.error is not None and (self.adapts(done) or done % check_step(done) == 0)

    def low_enough(self, noise: float | None) -> bool:
        """Return whether the estimated error, if known, is at most the target error, if there is one."""
        return noise is not None and self.error is not None and noise <= self.error

    def room(self, done: int) -> int:
        """Return the samples that a pass after `done` may add to every pixel; 0 if the count is reached or tiles
        adapt."""
        ends = self.spp is not None and done >= self.spp or self.adapts(done)
        return 0 if ends else pass_end(done, self.spp, self.error) - done


def check_step(done: int) -> int:
    """Return the interval of sample counts, from `done` on, at whose multiples a target error is checked."""
    return max(1, (1 << done.bit_length()) // (2 * CHECKS))


def pass_end(done: int, spp: int | None, error: float | None) -> int:
    """Return the sample count at which the pass after `done` ends at the latest: a power of two, so that it enters the
    history, or `spp`, or the next check of a target error."""
    step = check_step(done)
    checked = None if error is None else done + step - done % step
    return min(end for end in (1 << done.bit_length(), spp, checked) if end is not None)
