"""Data-parallel primitives: kernels over `count` items, one or a block of consecutive ones per work-item."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import DTypeLike, NDArray

from ..driver_errors import driver_errors
from ..open import Device
from ..programs.program import build, make_kernel
from .device_arrays import lent
from .driver_loop_limits import loop_turns
from .huge_pages import advise_huge_pages

#: Work-items per compute unit, and the minimum number of items per work-item.
WORK_ITEMS = {"cpu": 16, "gpu": 512}
SMALLEST_BLOCK = {"cpu": 256, "gpu": 16}
#: Upper bound on a kernel's loop iterations per item.
ITEM_TURNS = 1024
#: Maximum number of items per launch and compute unit. On a CPU, where PoCL compiles a kernel again for launches with
#: an offset other than 0, as many as take a tenth of a second.
LAUNCH_ITEMS = {"cpu": 1 << 20, "gpu": 1 << 17}
#: Work-items that scan cooperatively where that pays, as in build/scan.cl, and the number of elements per work-group.
SCAN_ITEMS, SCAN_PART = 256, 8192
#: Consecutive items per work-group of kernels whose work-items share them, and its most work-items (build/tiles.cl).
TILE, TILE_ITEMS = 2048, 64


class DataParallel:
    """The kernels of one program and the arrays that they share, all on one in-order queue.

    Kernels launched by `run`, `run_each` and `run_tiles` take `uint count, uint block` first, where `block` is the
    number of items per work-item, or per work-group; the program includes build/scan.cl. `peak_bytes` is the peak
    memory of its arrays; data_bytes: their approximate total size. Launches are short, so waiting for them need not
    handle signals. All methods may raise DeviceError.
    """

    def __init__(self, device: Device, source: str, data_bytes: int = 0) -> None:
        self.device = device
        self.program = build(device, source, data_bytes)
        self.peak_bytes = 0
        self._bytes = 0
        self._kernels: dict[str, cl.Kernel] = {}
        self._totals = self.empty(np.uint32, 4)

    @driver_errors()
    def empty(self, dtype: DTypeLike, count: int) -> cl.Buffer:
        """Allocate an array of `count` elements, at least one, with undefined contents."""
        array = cl.Buffer(self.device.context, cl.mem_flags.READ_WRITE, max(1, count) * np.dtype(dtype).itemsize)
        if self.device.info.type == "cpu":
            advise_huge_pages(self.device.queue, array)
        return self._counted(array)

    def zeros(self, dtype: DTypeLike, count: int) -> cl.Buffer:
        """Allocate an array of zeros, copied from the host.

        PoCL fills a buffer forty times slower than it copies one, and Oclgrind reports filled memory as uninitialised.
        """
        return self.upload(np.zeros(count, dtype))

    @driver_errors()
    def upload(self, values: NDArray[Any]) -> cl.Buffer:
        """Return a copy of `values` on the device."""
        array = self.empty(values.dtype, values.size)
        if values.size:
            cl.enqueue_copy(self.device.queue, array, np.ascontiguousarray(values))
        return array

    def lend(self, values: NDArray[Any]) -> cl.Buffer:
        """Return a buffer to read `values` from until `finish`: on a CPU the array itself, elsewhere a copy."""
        if not values.size:
            return self.upload(values)
        return self._counted(lent(self.device, np.ascontiguousarray(values)))

    @driver_errors()
    def finish(self) -> None:
        """Wait for all enqueued commands."""
        self.device.queue.finish()

    @driver_errors()
    def download(self, array: cl.Buffer, dtype: DTypeLike, count: int, first: int = 0) -> NDArray[Any]:
        """Return `count` elements of an array after all enqueued commands have completed."""
        values = np.empty(count, dtype)
        if count:
            cl.enqueue_copy(self.device.queue, values, array, src_offset=first * values.itemsize)
        return values

    def free(self, *arrays: cl.Buffer) -> None:
        """Release arrays after the launches that use them."""
        for array in arrays:
            self._bytes -= array.size
            array.release()

    @property
    def _kind(self) -> str:
        return "cpu" if self.device.info.type == "cpu" else "gpu"

    def block(self, count: int) -> int:
        """Return the number of items per work-item."""
        units = self.device.info.compute_units
        block = max(SMALLEST_BLOCK[self._kind], -(-count // (WORK_ITEMS[self._kind] * units)))
        turns = loop_turns(self.device)
        return block if turns is None else max(1, min(block, turns // ITEM_TURNS))

    def number(self, count: int) -> int:
        """Return the number of blocks."""
        return -(-count // self.block(count))

    def run(self, name: str, count: int, *arguments: Any) -> None:
        """Run kernel `name` over `count` items, a block per work-item, in launches that are each short.

        Python ints are passed as uint, floats as float. The only index that kernels may use is their global id.
        """
        self._run(name, count, self.block(count), self.device.local_size, arguments)

    def run_each(self, name: str, count: int, *arguments: Any) -> None:
        """Do as `run` for items that are independent: on a GPU each has a work-item, so that neighboring work-items
        access neighboring memory."""
        block = self.block(count) if self._kind == "cpu" else 1
        self._run(name, count, block, self.device.local_size, arguments)

    def run_tiles(self, name: str, count: int, *arguments: Any) -> None:
        """Do as `run` with a tile of items per work-group, whose index is global id / local size."""
        local = min(self.device.local_size, TILE_ITEMS)
        self._run(name, count, self._tile(count), local, arguments, items=local)

    def tiles(self, count: int) -> int:
        """Return the number of tiles."""
        return -(-count // self._tile(count))

    def _tile(self, count: int) -> int:
        return self.block(count) if self._kind == "cpu" else TILE

    def _run(self, name: str, count: int, block: int, local: int, arguments: Sequence[Any], items: int = 1) -> None:
        """Run a kernel over blocks, each of which has `items` work-items."""
        values = np.uint32(count), np.uint32(block), *map(_scalar, arguments)
        groups = -(-(-(-count // block) * items) // local)
        most = max(1, LAUNCH_ITEMS[self._kind] * self.device.info.compute_units * items // (block * local))
        for first in range(0, groups, most):
            self._launch(name, min(most, groups - first), local, values, first)

    def run_together(self, name: str, *arguments: Any) -> None:
        """Run kernel `name` in a single work-group.

        It has SCAN_ITEMS work-items, or one if larger groups do not pay, limited by the kernel's register use.
        """
        values = tuple(map(_scalar, arguments))
        with driver_errors():
            most = self._kernel(name, values).get_work_group_info(
                cl.kernel_work_group_info.WORK_GROUP_SIZE, self.device.cl
            )
        self._launch(name, 1, min(self._group, most), values)

    def scan(self, values: cl.Buffer, count: int, arrays: int = 1) -> None:
        """Compute exclusive prefix sums, in place, of `arrays` consecutive arrays of `count` numbers in `values`.

        The sum of each array is then in `totals`.
        """
        parts = 1 if self.device.local_size == 1 else -(-count // SCAN_PART)
        if parts == 1:
            return self._scan(values, count, arrays, 1, self._totals)
        sums = self.empty(np.uint32, arrays * parts)
        self._scan(values, count, arrays, parts, sums)
        self._scan(sums, parts, arrays, 1, self._totals)
        self.run_each("add_before", arrays * count, values, count, parts, sums)
        self.free(sums)

    def sums(self, arrays: int = 1) -> list[int]:
        """Return the `totals` of the last scan."""
        return [int(total) for total in self.download(self._totals, np.uint32, arrays)]

    def _scan(self, values: cl.Buffer, count: int, arrays: int, parts: int, totals: cl.Buffer) -> None:
        self._launch("scan", arrays * parts, self._group, (values, np.uint32(count), np.uint32(parts), totals))

    @property
    def _group(self) -> int:
        return 1 if self.device.local_size == 1 else SCAN_ITEMS

    @driver_errors()
    def _launch(self, name: str, groups: int, local: int, values: Sequence[Any], first: int = 0) -> None:
        kernel = self._kernel(name, values)
        kernel.set_args(*values)
        cl.enqueue_nd_range_kernel(self.device.queue, kernel, (groups * local,), (local,), (first * local,))

    def _kernel(self, name: str, values: Sequence[Any]) -> cl.Kernel:
        """Return the kernel, created at its first launch for arguments of these types."""
        if name not in self._kernels:
            self._kernels[name] = make_kernel(self.device, self.program, name)
            # Without declared types pyopencl tries each argument's type at every launch, by exceptions.
            self._kernels[name].set_arg_types([None if isinstance(v, cl.Buffer) else v.dtype for v in values])
        return self._kernels[name]

    @property
    def totals(self) -> cl.Buffer:
        """Return the buffer with the sums of the last scan."""
        return self._totals

    def _counted(self, array: cl.Buffer) -> cl.Buffer:
        self._bytes += array.size
        self.peak_bytes = max(self.peak_bytes, self._bytes)
        return array


def _scalar(argument: Any) -> Any:
    kinds = {int: np.uint32, float: np.float32}
    return kinds[type(argument)](argument) if type(argument) in kinds else argument
