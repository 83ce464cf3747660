"""What a driver refuses or fails at, as errors of clrt."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pyopencl as cl

from ..errors import DeviceError, NoRoomError
from .contexts import share_no_more


@contextmanager
def driver_errors() -> Iterator[None]:
    """Around calls of a driver, or before a function that makes some: NoRoomError where the device has not enough
    memory, and DeviceError for whatever else it says."""
    try:
        yield
    except cl.MemoryError as error:
        raise NoRoomError(f"the device has not enough memory: {error}") from error
    except cl.Error as error:
        share_no_more()
        raise DeviceError(f"the device failed: {error}") from error
