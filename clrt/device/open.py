"""A device opened for work: its context, queue and the choices that follow from its kind."""

from __future__ import annotations

from dataclasses import dataclass

import pyopencl as cl
from pyopencl import CommandQueue, Context

from ..errors import DeviceError
from . import pocl
from .describe import DeviceInfo
from .discover import choose


@dataclass(frozen=True)
class Device:
    """An opened device. Its queue runs in order."""

    info: DeviceInfo
    cl: cl.Device
    context: Context
    queue: CommandQueue

    @property
    def vectors(self) -> bool:
        """Whether the program writes its vectors: on a CPU, unless its driver joins work-items as a GPU does."""
        return self.info.type == "cpu" and self.cl.native_vector_width_float > 1

    @property
    def lanes(self) -> int:
        """Paths a work-item follows: one on a GPU, whose hardware joins work-items; a vector of them on a CPU."""
        return 8 if self.vectors else 1

    @property
    def local_size(self) -> int:
        """Work-items of a group. On a CPU one: its compiler then has no loop over work-items to write around."""
        return 1 if self.vectors else 64

    @property
    def layout(self) -> str:
        """The tree layout that suits the device: eight boxes at a time where there are vectors, else compressed."""
        return "bvh8" if self.vectors else "cwbvh"


def open_device(selector: str | int | None = None) -> Device:
    """Opens the device that `selector` names (see `choose`); DeviceError where that fails."""
    info, device = choose(selector)
    if info.platform == "Portable Computing Language":
        pocl.name_processor(device)
    try:
        context = Context([device])
        return Device(info, device, context, CommandQueue(context))
    except cl.Error as error:
        raise DeviceError(f"{info.name} ({info.platform}) cannot be opened: {error}") from error
