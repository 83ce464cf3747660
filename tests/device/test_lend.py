"""An array that is lent to a device lives until the commands that use it have ended, whatever becomes of its buffer."""

from __future__ import annotations

import gc
import time
import weakref

import numpy as np
import pyopencl as cl

from clrt.device.launches.lent_memory import lend, settle
from clrt.device.open import Device

SECONDS = 20.0


def test_an_array_outlives_its_buffer_as_long_as_commands_use_it(device: Device) -> None:
    array, written = np.zeros(4096, np.float32), np.ones(4096, np.float32)
    alive = weakref.ref(array)
    buffer = lend(device, array, cl.mem_flags.READ_WRITE)
    gate = cl.UserEvent(device.context)
    command = cl.enqueue_copy(device.queue, buffer, written, is_blocking=False, wait_for=[gate])
    del array
    settle()  # as whoever lends or returns another array does
    del buffer
    gc.collect()
    lent = alive()
    gate.set_status(cl.command_execution_status.COMPLETE if lent is not None else -1)  # −1: the command is canceled
    assert lent is not None
    command.wait()
    del lent
    end = time.perf_counter() + SECONDS
    while alive() is not None and time.perf_counter() < end:
        settle()
    assert alive() is None
