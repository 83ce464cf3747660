"""Arrays in device memory, next to numpy's. Functions that call the device may raise DeviceError or NoRoomError."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import DTypeLike, NDArray

from ..driver_errors import driver_errors
from ..open import Device
from .lent_memory import lend


@dataclass(frozen=True, eq=False)
class DeviceArray:
    """`size` elements of `dtype` in a buffer, which may be longer."""

    buffer: cl.Buffer
    dtype: np.dtype[Any]
    size: int

    @property
    def nbytes(self) -> int:
        """Return the size of the elements in bytes."""
        return self.size * self.dtype.itemsize

    def __len__(self) -> int:
        return self.size

    @driver_errors()
    def read(self, device: Device, into: NDArray[Any] | None = None) -> NDArray[Any]:
        """Return a copy of the elements, (size,), in a new array or the contiguous one given."""
        values = np.empty(self.size, self.dtype) if into is None else into
        if self.size:
            cl.enqueue_copy(device.queue, values, self.buffer)
        return values

    @driver_errors()
    def write(self, device: Device, values: NDArray[Any] | DeviceArray, first: int = 0) -> None:
        """Overwrite the elements from index `first` on with `values`, which have the same dtype."""
        offset = first * self.dtype.itemsize
        if not len(values):
            return
        if isinstance(values, DeviceArray):
            cl.enqueue_copy(device.queue, self.buffer, values.buffer, byte_count=values.nbytes, dst_offset=offset)
        else:
            cl.enqueue_copy(device.queue, self.buffer, np.ascontiguousarray(values), dst_offset=offset)


@driver_errors()
def empty_array(device: Device, dtype: DTypeLike, size: int) -> DeviceArray:
    """Allocate an array with undefined contents."""
    kind = np.dtype(dtype)
    return DeviceArray(cl.Buffer(device.context, cl.mem_flags.READ_WRITE, max(1, size) * kind.itemsize), kind, size)


@driver_errors()
def on_device(device: Device, array: NDArray[Any] | DeviceArray) -> cl.Buffer:
    """Return the buffer of a device array, or a new buffer with a copy of a numpy array.

    NVIDIA's driver copies an array four times slower when it creates the buffer than by a command.
    """
    if isinstance(array, DeviceArray):
        return array.buffer
    if device.info.type == "cpu" or not array.nbytes:
        return cl.Buffer(device.context, cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR, hostbuf=array)
    buffer = cl.Buffer(device.context, cl.mem_flags.READ_WRITE, array.nbytes)
    cl.enqueue_copy(device.queue, buffer, np.ascontiguousarray(array))
    return buffer


@driver_errors()
def lent(device: Device, array: NDArray[Any] | DeviceArray, writable: bool = False) -> cl.Buffer:
    """Return a buffer to read from, or also to write to if `writable`.

    On a CPU it wraps the numpy array itself without a copy (see lent_memory.py), which must then not change; elsewhere
    it is that of `on_device`.
    """
    if isinstance(array, DeviceArray) or device.info.type != "cpu" or not array.flags.c_contiguous:
        return on_device(device, array)
    return lend(device, array, cl.mem_flags.READ_WRITE if writable else cl.mem_flags.READ_ONLY)


def resident(device: Device, array: NDArray[Any] | DeviceArray) -> DeviceArray:
    """Return the device array itself, or copy a numpy array into a new one."""
    return array if isinstance(array, DeviceArray) else DeviceArray(on_device(device, array), array.dtype, len(array))


def on_host(device: Device, array: NDArray[Any] | DeviceArray) -> NDArray[Any]:
    """Return a copy of a device array, or the numpy array itself."""
    return array.read(device) if isinstance(array, DeviceArray) else array


def same_content(one: NDArray[Any] | DeviceArray | None, other: NDArray[Any] | DeviceArray | None) -> bool:
    """Return whether two arrays are the same object or, if in numpy, hold the same bytes. No device is read."""
    if not (isinstance(one, np.ndarray) and isinstance(other, np.ndarray)):
        return one is other
    if one is other or (one.dtype, one.shape) != (other.dtype, other.shape):
        return one is other
    mine, its = (np.ascontiguousarray(each).reshape(-1).view(np.uint8) for each in (one, other))
    return np.array_equal(mine, its)


def room_for(device: Device | None, dtype: DTypeLike, size: int) -> DeviceArray | NDArray[Any]:
    """Allocate `size` elements to be written: on the device, or in numpy (zeros) without one."""
    return empty_array(device, dtype, size) if device else np.zeros(size, dtype)


def put(
    device: Device | None, array: DeviceArray | NDArray[Any], values: DeviceArray | NDArray[Any], first: int = 0
) -> None:
    """Overwrite the elements of `array` from index `first` on with `values`, as `DeviceArray.write` does."""
    if isinstance(array, DeviceArray):
        assert device is not None
        array.write(device, values, first)
    else:
        array[first : first + len(values)] = values
