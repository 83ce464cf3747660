"""When a render ends: at so many samples, after a time, or at an error, whatever comes first."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Integral, Real
from typing import Any

from ..errors import UsageError
from ..scene.model import RenderSettings
from .adaptive import FLOOR_SPP

#: With a wanted error the noise is looked at so many times between two powers of two of the samples.
CHECKS = 8


def planned_spp(settings: RenderSettings, spp: int | None, time: float | None, error: float | None) -> int | None:
    """How many samples a pixel `passes` takes with these stop conditions; None where only time or error ends it.
    UsageError as of `check_stops`."""
    check_stops(spp, time, error)
    return settings.spp if spp is None and time is None and error is None else spp


def check_stops(spp: int | None, time: float | None = None, error: float | None = None) -> None:
    """UsageError unless each stop condition that is given is a number above 0 and finite, spp a whole one."""
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
    """It; UsageError unless it is one, if it is given."""
    if percentile is None:
        return None
    if not isinstance(percentile, Real) or not 0 < float(percentile) <= 100:
        raise UsageError(f"error_percentile is {percentile!r}; it must be a number above 0 and at most 100")
    return float(percentile)


@dataclass(frozen=True)
class Limits:
    """The stop conditions of a render, each None or given; adaptive: whether tiles get samples by their error."""

    spp: int | None
    time: float | None
    error: float | None
    adaptive: bool

    @staticmethod
    def of(settings: RenderSettings, spp: int | None, time: float | None, error: float | None) -> Limits:
        """Those given, or else the samples of the scene. UsageError as of `check_stops`."""
        return Limits(planned_spp(settings, spp, time, error), time, error, settings.adaptive)

    def reached(self, done: int, seconds: float) -> str | None:
        """The stop reason where a picture has so many samples already, or has taken so long."""
        if self.time_over(done, seconds):
            return "time"
        return "spp" if done and self.spp is not None and done >= self.spp else None

    def time_over(self, done: int, seconds: float) -> bool:
        """Whether its time is; never of a picture without samples."""
        return bool(done) and self.time is not None and seconds >= self.time

    def adapts(self, done: int) -> bool:
        """Whether the pass after `done` samples goes by the error of the tiles."""
        return self.adaptive and done >= FLOOR_SPP

    def looks(self, done: int) -> bool:
        """Whether the wanted error is compared with the noise of so many samples; never by time, so all runs agree."""
        return self.error is not None and (self.adapts(done) or done % check_step(done) == 0)

    def low_enough(self, noise: float | None) -> bool:
        """Whether the noise, if it is known, is at most the wanted error, if there is one."""
        return noise is not None and self.error is not None and noise <= self.error

    def room(self, done: int) -> int:
        """Samples that a pass after `done` may add to every pixel; none where the count is reached, or tiles adapt."""
        ends = self.spp is not None and done >= self.spp or self.adapts(done)
        return 0 if ends else pass_end(done, self.spp, self.error) - done


def check_step(done: int) -> int:
    """From `done` samples on a wanted error is looked at wherever they are a multiple of this."""
    return max(1, (1 << done.bit_length()) // (2 * CHECKS))


def pass_end(done: int, spp: int | None, error: float | None) -> int:
    """The samples at which the pass after `done` ends at the latest: a power of two, so that the history has them, or
    `spp`, or where a wanted error is looked at."""
    step = check_step(done)
    checked = None if error is None else done + step - done % step
    return min(end for end in (1 << done.bit_length(), spp, checked) if end is not None)
