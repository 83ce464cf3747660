"""A device opened for work: its context, queue and the choices that follow from its kind."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from dataclasses import dataclass

import pyopencl as cl
from pyopencl import CommandQueue, Context

from ..errors import DeviceError, UsageError
from . import pocl
from .contexts import Shared, shared_by
from .describe import DeviceInfo
from .discover import choose
from .fork import check_process
from .pulse import take_any_time

#: The name of PoCL's platform.
POCL = "Portable Computing Language"
#: Launches tell how long they ran.
TIMED = cl.command_queue_properties.PROFILING_ENABLE


@dataclass(frozen=True)
class Device:
    """An opened device. In a process that was forked from that which opened it, queue and context are a UsageError."""

    info: DeviceInfo
    cl: cl.Device
    shared: Shared
    _queue: CommandQueue

    @property
    def queue(self) -> CommandQueue:
        """Which runs in order."""
        check_process()
        return self._queue

    @property
    def context(self) -> Context:
        """Of its buffers and programs."""
        check_process()
        return self.shared.context

    @property
    def vectors(self) -> bool:
        """Whether the program writes its vectors: on a CPU, unless its driver joins work-items as a GPU does."""
        return self.info.type == "cpu" and self.cl.native_vector_width_float > 1

    @property
    def lanes(self) -> int:
        """Paths a work-item follows: one on a GPU, whose hardware joins work-items; a vector of them on a CPU."""
        return 8 if self.vectors else 1

    @property
    def is_pocl(self) -> bool:
        """Whether its driver is PoCL, which compiles kernels as they are first launched, and keeps them itself."""
        return self.info.platform == POCL

    @property
    def packs(self) -> bool:
        """Whether lanes are put side by side by one instruction (kernels/mask.cl), which waves of paths need."""
        return self.vectors and self.is_pocl and platform.machine().lower() in ("x86_64", "amd64")

    @property
    def fuses(self) -> bool:
        """Whether fma is an instruction there. Intel's runtime and Oclgrind have it without saying so."""
        return (self.vectors or self.info.type == "simulator"
                or bool(self.cl.single_fp_config & cl.device_fp_config.FMA))

    @property
    def local_size(self) -> int:
        """Work-items of a group. On a CPU one: its compiler then has no loop over work-items to write around."""
        return 1 if self.vectors else 64

    @property
    def layout(self) -> str:
        """The tree layout that suits the device: eight boxes at a time where there are vectors, else compressed."""
        return "bvh8" if self.vectors else "cwbvh"


#: One device or several, by names (see `choose`) or open; None is the best.
Selectors = str | int | Device | Sequence[str | int | Device] | None


def open_devices(selectors: Selectors) -> list[Device]:
    """Opens the devices that are named (see `choose`), at least one; DeviceError where that fails.

    Those that are open already are taken as they are. UsageError where there are no names.
    """
    if isinstance(selectors, Sequence) and not selectors:
        raise UsageError(f"device is {selectors!r}; name at least one, or leave it out for the best")
    several = list(selectors) if isinstance(selectors, Sequence) and not isinstance(selectors, str) else [selectors]
    return [each if isinstance(each, Device) else open_device(each) for each in several]


def name_of(devices: Sequence[Device]) -> str:
    """Their names in one line, each once."""
    return " + ".join(dict.fromkeys(device.info.name for device in devices))


def open_device(selector: str | int | None = None) -> Device:
    """Opens the device that `selector` names (see `choose`); DeviceError where that fails."""
    info, device = choose(selector)
    if info.platform == POCL:
        pocl.name_processor(device)
    if info.type == "simulator":
        take_any_time()
    try:
        shared = shared_by(device)
        return Device(info, device, shared, CommandQueue(shared.context, properties=TIMED))
    except cl.Error as error:
        raise DeviceError(f"{info.name} ({info.platform}) cannot be opened: {error}") from error
