"""How long launches took, by clocks of devices."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import pyopencl as cl
import pytest

from clrt.device.launches.launch import run_seconds


@pytest.mark.parametrize(("nanoseconds", "seconds"), [(0, 0.0), (1, 0.0), (70_000_000, 0.07)])
def test_clocks_that_do_not_tell(nanoseconds: int, seconds: float) -> None:
    """A nanosecond is what rusticl's says of every launch."""
    event = SimpleNamespace(profile=SimpleNamespace(start=5, end=5 + nanoseconds))
    assert run_seconds(cast(cl.Event, event)) == pytest.approx(seconds)
