"""Callbacks on driver threads: a process that exits waits for them."""

from __future__ import annotations

import sys
import time
from traceback import walk_stack

import pyopencl as cl
import pytest

from clrt.device.launches import event_callbacks
from clrt.device.open import Device
from clrt.threads import Event, beside


def test_one_that_is_under_way_is_expected(device: Device) -> None:
    """A callback counts as expected until its last line: a process that ends earlier would be aborted."""
    called = list[None]()

    def function() -> None:
        called.append(None)
        sys.setprofile(lambda *_: time.sleep(0.02))  # lets other threads run at every call

    event = cl.UserEvent(device.context)
    event_callbacks.when_complete(event, function)
    assert event_callbacks._expected
    event.set_status(cl.command_execution_status.COMPLETE)
    while event_callbacks._expected:
        pass
    running = [frame.f_code.co_filename for each in sys._current_frames().values() for frame, _ in walk_stack(each)]
    assert called and event_callbacks.__file__ not in running


def test_all_that_come_one_by_one_are_waited_for(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Together they take longer than the wait for one; one that never comes ends it."""
    monkeypatch.setattr(event_callbacks, "_expected", set())
    monkeypatch.setattr(event_callbacks, "_python_ends", Event())
    monkeypatch.setattr(event_callbacks, "LAST_WAIT", 0.6)
    events = [cl.UserEvent(device.context) for _ in range(6)]
    for event in events:
        event_callbacks.when_complete(event, lambda: None)

    def complete() -> None:
        for event in events[1:]:
            time.sleep(0.2)
            event.set_status(cl.command_execution_status.COMPLETE)

    completed = beside(complete)
    event_callbacks._await_them()
    completed()
    assert len(event_callbacks._expected) == 1
    events[0].set_status(cl.command_execution_status.COMPLETE)
