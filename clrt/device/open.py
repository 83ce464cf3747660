"""A device opened for work: its context, queue, and the settings that depend on its kind."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from dataclasses import dataclass

import pyopencl as cl
from pyopencl import CommandQueue, Context

from ..errors import DeviceError, UsageError
from .contexts import SharedContext, shared_by
from .device_info import DeviceInfo
from .discovery.discover import choose
from .launches.fork_safety import check_process
from .launches.hang_watchdog import take_any_time
from .pocl import cpu_name

#: Name of PoCL's platform.
POCL = "Portable Computing Language"
#: Queues record launch times.
TIMED = cl.command_queue_properties.PROFILING_ENABLE


@dataclass(frozen=True)
class Device:
    """An opened device. In a process forked from the one that opened it, `queue` and `context` raise UsageError."""

    info: DeviceInfo
    cl: cl.Device
    shared: SharedContext
    _queue: CommandQueue

    @property
    def queue(self) -> CommandQueue:
        """Return the in-order command queue of this device."""
        check_process()
        return self._queue

    @property
    def context(self) -> Context:
        """Return the OpenCL context of this device."""
        check_process()
        return self.shared.context

    @property
    def vectors(self) -> bool:
        """Return whether kernels use explicit vectors: on a CPU, unless its driver vectorises over work-items."""
        return self.info.type == "cpu" and self.cl.native_vector_width_float > 1

    @property
    def lanes(self) -> int:
        """Return the SIMD width, in paths per work-item: 1 on a GPU, whose hardware vectorises over work-items."""
        return 8 if self.vectors else 1

    @property
    def is_pocl(self) -> bool:
        """Return whether the driver is PoCL, which compiles kernels at their first launch and caches them itself."""
        return self.info.platform == POCL

    @property
    def packs(self) -> bool:
        """Return whether one instruction compacts lanes (kernels/core/mask.cl), which wavefront path tracing needs."""
        return self.vectors and self.is_pocl and platform.machine().lower() in ("x86_64", "amd64")

    @property
    def fuses(self) -> bool:
        """Return whether fma is a hardware instruction. Intel's runtime and Oclgrind have it without reporting it."""
        return self.vectors or self.info.type == "simulator" or bool(self.cl.single_fp_config & cl.device_fp_config.FMA)

    @property
    def local_size(self) -> int:
        """Return the work-group size. On a CPU it is 1, so that the compiler generates no loop over work-items."""
        return 1 if self.vectors else 64

    @property
    def group_size(self) -> int:
        """Return the work-group size of the queues' kernels (rendering/accumulation/path_queues.py): the measured one,
        else 128, which is up to a tenth faster than 64 and than 256 on an NVIDIA H200 (docs/measurements/gpus.md)."""
        if self.vectors:
            return 1
        return self.info.tuning.group_size if self.info.tuning else 128

    @property
    def layout(self) -> str:
        """Return the BVH layout: the measured one; else "bvh8" (eight boxes per SIMD test) with explicit vectors, and
        "cwbvh" without."""
        if self.info.tuning:
            return self.info.tuning.layout
        return "bvh8" if self.vectors else "cwbvh"


#: One device or several, by name (see `choose`) or open; None is the best.
Selectors = str | int | Device | Sequence[str | int | Device] | None


def open_devices(selectors: Selectors) -> list[Device]:
    """Open the devices that `selectors` names (see `choose`); those already open are returned as they are.

    Raises DeviceError if a device cannot be opened, and UsageError for an empty list.
    """
    if isinstance(selectors, Sequence) and not selectors:
        raise UsageError(f"device is {selectors!r}; give at least one, or leave it out for the best")
    several = list(selectors) if isinstance(selectors, Sequence) and not isinstance(selectors, str) else [selectors]
    return [each if isinstance(each, Device) else open_device(each) for each in several]


def name_of(devices: Sequence[Device]) -> str:
    """Return the distinct names of the devices in one line."""
    return " + ".join(dict.fromkeys(device.info.name for device in devices))


def open_device(selector: str | int | None = None) -> Device:
    """Open the device that `selector` names (see `choose`). Raises DeviceError if that fails."""
    info, device = choose(selector)
    if info.platform == POCL:
        cpu_name.name_processor(device)
    if info.type == "simulator":
        take_any_time()
    try:
        shared = shared_by(device)
        return Device(info, device, shared, CommandQueue(shared.context, properties=TIMED))
    except cl.Error as error:
        raise DeviceError(f"{info.name} ({info.platform}) cannot be opened: {error}") from error
