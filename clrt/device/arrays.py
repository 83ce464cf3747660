"""Arrays that live on a device, beside those of numpy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from .open import Device


@dataclass(frozen=True, eq=False)
class DeviceArray:
    """`size` elements of `dtype` in a buffer, which may be longer."""

    buffer: cl.Buffer
    dtype: np.dtype[Any]
    size: int

    @property
    def nbytes(self) -> int:
        """Size of the elements."""
        return self.size * self.dtype.itemsize

    def __len__(self) -> int:
        return self.size

    def read(self, device: Device) -> NDArray[Any]:
        """A copy of the elements, (size,)."""
        values = np.empty(self.size, self.dtype)
        if self.size:
            cl.enqueue_copy(device.queue, values, self.buffer)
        return values


def on_device(device: Device, array: NDArray[Any] | DeviceArray) -> cl.Buffer:
    """The buffer of a device array, or a new one with a copy of a numpy array; kernels may only read it."""
    if isinstance(array, DeviceArray):
        return array.buffer
    return cl.Buffer(device.context, cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR, hostbuf=array)
