"""Tests of the clocks that count only the time in which the process runs, not time suspended."""

from __future__ import annotations

import time

import numpy as np
import pytest

from clrt.awake import LONGEST, AwakeClock, wait_awake, watched_clock
from clrt.threads import BEAT, Event

RNG = np.random.default_rng(5)


class Time:
    """Fake system clock that the test advances."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 1000.0
        monkeypatch.setattr("clrt.awake.time.perf_counter", lambda: self.now)


def test_a_long_time_between_looks_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each of 200 random gaps counts for at most LONGEST; reading `seconds` changes nothing."""
    system = Time(monkeypatch)
    clock, expected = AwakeClock(3.0), 3.0
    for gap in RNG.exponential(LONGEST, 200):
        for part in (0.5, 1.0):
            system.now += 0.5 * gap
            assert clock.seconds == pytest.approx(expected + min(part * gap, LONGEST))
        expected += min(gap, LONGEST)
        assert clock.look() == pytest.approx(expected)
    clock.set(7.0)
    assert clock.seconds == 7.0


def test_waiting_leaves_a_suspension_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """An hour that passes within one wait does not count; an event that is set is found."""
    system, event, looks = Time(monkeypatch), Event(), list[float]()

    def wait(seconds: float) -> bool:
        looks.append(seconds)
        system.now += 3600.0 if len(looks) == 3 else seconds
        return False

    monkeypatch.setattr(event, "wait", wait)
    assert not wait_awake(event, 5.0)
    assert len(looks) == pytest.approx((5.0 - LONGEST) / BEAT + 1, abs=2)
    event.set()
    assert wait_awake(event, 5.0)


def test_nobody_else_has_to_look_at_a_watched_clock() -> None:
    with watched_clock(2.0) as clock:
        start = time.perf_counter()
        while time.perf_counter() < start + 2 * LONGEST:
            time.sleep(0.05)
        assert clock.seconds > 2.0 + LONGEST + BEAT
