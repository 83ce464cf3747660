"""Functions that drivers' threads call, and a process that ends meanwhile."""

from __future__ import annotations

import sys
import time
from traceback import walk_stack

import pyopencl as cl

from clrt.device import callbacks
from clrt.device.open import Device


def test_one_that_is_under_way_is_expected(device: Device) -> None:
    """To its last line: a process that ends before that would be aborted."""
    called = list[None]()

    def function() -> None:
        called.append(None)
        sys.setprofile(lambda *_: time.sleep(0.02))     # another thread gets on wherever one can, until this one ends

    event = cl.UserEvent(device.context)
    callbacks.when_complete(event, function)
    assert callbacks._expected
    event.set_status(cl.command_execution_status.COMPLETE)
    while callbacks._expected:
        pass
    running = [frame.f_code.co_filename for each in sys._current_frames().values() for frame, _ in walk_stack(each)]
    assert called and callbacks.__file__ not in running
