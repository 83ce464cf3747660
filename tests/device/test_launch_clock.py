"""Run times of launches by the devices' clocks."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import pyopencl as cl
import pytest

from clrt.device.launches.launch import run_seconds


@pytest.mark.parametrize(("nanoseconds", "seconds"), [(0, 0.0), (1, 0.0), (70_000_000, 0.07)])
def test_clocks_that_do_not_tell(nanoseconds: int, seconds: float) -> None:
    """rusticl reports one nanosecond for every launch."""
    event = SimpleNamespace(profile=SimpleNamespace(start=5, end=5 + nanoseconds))
    assert run_seconds(cast(cl.Event, event)) == pytest.approx(seconds)
