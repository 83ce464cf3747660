"""Convert errors of the OpenCL driver to clrt's exceptions."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pyopencl as cl

from ..errors import DeviceError, NoRoomError
from .contexts import share_no_more


@contextmanager
def driver_errors() -> Iterator[None]:
    """Convert errors of driver calls, as a context manager or decorator.

    Raises NoRoomError if the device runs out of memory, and DeviceError for any other error.
    """
    try:
        yield
    except cl.MemoryError as error:
        raise NoRoomError(f"the device is out of memory: {error}") from error
    except cl.Error as error:
        share_no_more()
        raise DeviceError(f"the device failed: {error}") from error
