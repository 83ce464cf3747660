"""Arrays that live on a device, beside those of numpy. What they ask of it may raise DeviceError, or NoRoomError."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import DTypeLike, NDArray

from .driver_errors import driver_errors
from .lending import lend
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

    @driver_errors()
    def read(self, device: Device) -> NDArray[Any]:
        """A copy of the elements, (size,)."""
        values = np.empty(self.size, self.dtype)
        if self.size:
            cl.enqueue_copy(device.queue, values, self.buffer)
        return values

    @driver_errors()
    def write(self, device: Device, values: NDArray[Any] | DeviceArray, first: int = 0) -> None:
        """Puts `values`, of the same dtype, over the elements from `first` on."""
        offset = first * self.dtype.itemsize
        if not len(values):
            return
        if isinstance(values, DeviceArray):
            cl.enqueue_copy(device.queue, self.buffer, values.buffer, byte_count=values.nbytes, dst_offset=offset)
        else:
            cl.enqueue_copy(device.queue, self.buffer, np.ascontiguousarray(values), dst_offset=offset)


@driver_errors()
def empty_array(device: Device, dtype: DTypeLike, size: int) -> DeviceArray:
    """A new array whose elements are not defined."""
    kind = np.dtype(dtype)
    return DeviceArray(cl.Buffer(device.context, cl.mem_flags.READ_WRITE, max(1, size) * kind.itemsize), kind, size)


@driver_errors()
def on_device(device: Device, array: NDArray[Any] | DeviceArray) -> cl.Buffer:
    """The buffer of a device array, or a new one with a copy of a numpy array."""
    if isinstance(array, DeviceArray):
        return array.buffer
    return cl.Buffer(device.context, cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR, hostbuf=array)


@driver_errors()
def lent(device: Device, array: NDArray[Any] | DeviceArray, writable: bool = False) -> cl.Buffer:
    """A buffer to read from, or to write to as well: on a CPU the numpy array itself (see lending.py), which must not
    change then; elsewhere `on_device`."""
    if isinstance(array, DeviceArray) or device.info.type != "cpu" or not array.flags.c_contiguous:
        return on_device(device, array)
    return lend(device, array, cl.mem_flags.READ_WRITE if writable else cl.mem_flags.READ_ONLY)


def resident(device: Device, array: NDArray[Any] | DeviceArray) -> DeviceArray:
    """The device array itself, or a new one with a copy of a numpy array."""
    return array if isinstance(array, DeviceArray) else DeviceArray(on_device(device, array), array.dtype, len(array))


def on_host(device: Device, array: NDArray[Any] | DeviceArray) -> NDArray[Any]:
    """A copy of a device array, or the numpy array itself."""
    return array.read(device) if isinstance(array, DeviceArray) else array


def same_content(one: NDArray[Any] | DeviceArray | None, other: NDArray[Any] | DeviceArray | None) -> bool:
    """Whether two arrays are the same one, or hold the same bytes, as far as that is known without asking a device."""
    if not (isinstance(one, np.ndarray) and isinstance(other, np.ndarray)):
        return one is other
    if one is other or (one.dtype, one.shape) != (other.dtype, other.shape):
        return one is other
    mine, its = (np.ascontiguousarray(each).reshape(-1).view(np.uint8) for each in (one, other))
    return np.array_equal(mine, its)


def room_for(device: Device | None, dtype: DTypeLike, size: int) -> DeviceArray | NDArray[Any]:
    """Elements to be written: on the device, or in numpy without one."""
    return empty_array(device, dtype, size) if device else np.zeros(size, dtype)


def put(device: Device | None, array: DeviceArray | NDArray[Any], values: DeviceArray | NDArray[Any],
        first: int = 0) -> None:
    """Puts `values` over the elements of `array` from `first` on, as `DeviceArray.write` does."""
    if isinstance(array, DeviceArray):
        assert device is not None
        array.write(device, values, first)
    else:
        array[first:first + len(values)] = values
