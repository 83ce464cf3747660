"""Queues of path tracing on a device (kernels/integrator/queues.cl): their memory, and the launches of the stages."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from ...device.launches.launch import LaunchEvents, calling
from ...device.open import Device
from ...device.programs.program import BuiltProgram, make_kernel
from ..compile.compile_scene import CompiledScene

#: Samples whose paths are in the queues together: a large GPU is still busy when most of them have ended.
MOST_SLOTS, FEWEST_SLOTS = 1 << 23, 1 << 10
#: Maximum fraction of the device's memory for the queues, as a divisor.
SHARE = 8
#: Maximum work-items of a stage per compute unit; each takes every n-th entry of its queue. Fewer from the depth LATE
#: on, where queues are shorter and an empty launch should cost little.
WORK_ITEMS, LATE_WORK_ITEMS, LATE = 1 << 14, 1 << 11, 5
#: Bytes of a row and of a word, and their number per slot (kernels/integrator/queue_records.cl).
ROW, WORD = 16, 4
PATH_ROWS, SHADOW_ROWS, LIGHT_WORDS = 5, 4, 3


def slot_bytes(compiled: CompiledScene) -> dict[str, int]:
    """Return the bytes of a slot in each buffer, in the order of QUEUE_PARAMETERS."""
    names = "ATTENUATION", "GUIDING", "INSTANCES", "LIGHTS", "DIRECT_LIGHT", "CLAMP", "ALPHA", "CATCHER"
    has = {name: name in compiled.features for name in names}
    return {
        "paths": 2 * (PATH_ROWS + (has["ATTENUATION"] or has["GUIDING"])) * ROW,
        "hits": ROW,
        "instances": has["INSTANCES"] * WORD,
        "order": kind_count(compiled) * WORD,
        "shadows": has["LIGHTS"] * SHADOW_ROWS * ROW,
        "light": (
            LIGHT_WORDS * (1 + has["DIRECT_LIGHT"] + len(compiled.groups))
            + has["CLAMP"]
            + has["ALPHA"]
            + has["CATCHER"]
        )
        * WORD,
        "rays": WORD,
    }


def kind_count(compiled: CompiledScene) -> int:
    """Return the number of kinds by which hits are sorted (kernels/integrator/queue_sorted.cl), 0 if they are not."""
    types = sum(feature.startswith("MATERIAL_") for feature in compiled.features)
    return 1 + types if "SORT_HITS" in compiled.features else 0


class PathQueues:
    """Queues of a scene on a device, and the kernels of its stages. scene_arguments: leading arguments of the kernels.

    capacity: the most samples in a launch. The buffers are allocated when they are first needed.
    """

    def __init__(
        self, device: Device, program: BuiltProgram, compiled: CompiledScene, scene_arguments: Sequence[Any]
    ) -> None:
        self._device, self._scene = device, scene_arguments
        self._slot_bytes = slot_bytes(compiled)
        self.capacity = _capacity(device, self._slot_bytes)
        self._kinds = kind_count(compiled)
        shadows = {"PRIMITIVES", "LIGHTS"} <= set(compiled.features)
        self._stages = ["extend", *["sort_hits"] * (self._kinds > 0), "shade", *["connect"] * shadows]
        self._kernels = {
            name: make_kernel(device, program, name) for name in ("generate", *self._stages, "update_film")
        }
        self._group = min(device.group_size, *map(self._largest_group, self._kernels.values()))
        self._slots = 0
        self._held: list[cl.Buffer] = []
        self._lengths: list[cl.Buffer] = []

    @property
    def bytes(self) -> int:
        """Memory of the queues."""
        return sum(buffer.size for buffer in (*self._held, *self._lengths))

    def enqueue(self, film: cl.Buffer, tiles: cl.Buffer, launch: NDArray[Any]) -> LaunchEvents:
        """Enqueue all stages for the range in a LAUNCH record, of the image's tiles in `tiles`."""
        pixels, depths = int(launch["pixel_count"][0]), int(launch["max_depth"][0])
        slots = pixels * int(launch["sample_count"][0])
        self._reserve(slots, depths)
        lengths, zeros = self._lengths
        queues: tuple[Any, ...] = lengths, *self._held, np.uint32(self._slots)
        with calling():
            cl.enqueue_copy(self._device.queue, lengths, zeros, byte_count=lengths.size)
            first = self._run("generate", slots, *self._scene, *queues, tiles, launch[0])
            picture = {"sort_hits": (), "connect": (launch[0],)}
            for name in self._stages:
                self._kernels[name].set_args(*self._scene, *queues, *picture.get(name, (tiles, launch[0])), np.int32(0))
            for depth in range(1, (depths if slots else 1) + 1):
                most = (WORK_ITEMS if depth < LATE else LATE_WORK_ITEMS) * self._device.info.compute_units
                for name in self._stages:
                    kernel = self._kernels[name]
                    kernel.set_arg(kernel.num_args - 1, np.int32(depth))
                    self._launch(kernel, min(slots, most))
            last = self._run("update_film", pixels, *queues, film, tiles, launch[0])
            self._device.queue.flush()
        return LaunchEvents(first, last)

    def _run(self, name: str, count: int, *arguments: Any) -> cl.Event:
        self._kernels[name].set_args(*arguments)
        return self._launch(self._kernels[name], count)

    def _launch(self, kernel: cl.Kernel, count: int) -> cl.Event:
        groups = max(1, -(-count // self._group))
        return cl.enqueue_nd_range_kernel(self._device.queue, kernel, (groups * self._group,), (self._group,))

    def _largest_group(self, kernel: cl.Kernel) -> int:
        return int(kernel.get_work_group_info(cl.kernel_work_group_info.WORK_GROUP_SIZE, self._device.cl))

    def _reserve(self, slots: int, depths: int) -> None:
        """Allocate buffers for this many slots and depths, unless there are."""
        context, flags = self._device.context, cl.mem_flags.READ_WRITE
        needed = (2 + self._kinds) * (depths + 2) * WORD
        with calling():
            if not self._lengths or self._lengths[0].size < needed:
                zeros = cl.Buffer(context, flags, needed)
                cl.enqueue_copy(self._device.queue, zeros, np.zeros(needed // WORD, np.uint32))
                self._lengths = [cl.Buffer(context, flags, needed), zeros]
            if not self._held or self._slots < slots:
                self._slots = min(self.capacity, max(FEWEST_SLOTS, 1 << (slots - 1).bit_length()))
                self._held = []
                self._held = [
                    cl.Buffer(context, flags, max(ROW, size * self._slots)) for size in self._slot_bytes.values()
                ]


def _capacity(device: Device, slot_bytes: dict[str, int]) -> int:
    """Return how many slots the device has room for: a power of two."""
    info = device.info
    most = min(
        info.global_bytes // (SHARE * sum(slot_bytes.values())), info.max_alloc_bytes // max(slot_bytes.values())
    )
    return max(FEWEST_SLOTS, min(MOST_SLOTS, 1 << (max(1, most).bit_length() - 1)))
