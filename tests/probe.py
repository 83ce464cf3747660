"""Calls functions of the kernels on arrays: a scene's program with tests/kernels/probe.cl behind it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import ArrayLike, NDArray

from clrt.device.open import Device
from clrt.device.program import build
from clrt.rendering.compile import Choices, compile_scene
from clrt.scene.model import Scene

Rows = NDArray[np.float64]
ENTRIES = '#line 1 "probe.cl"\n' + (Path(__file__).parent / "kernels" / "probe.cl").read_text(encoding="utf-8")


def choices(device: Device, **chosen: Any) -> Choices:
    """The device's own choices, but for those given."""
    return replace(Choices(device.lanes, device.layout), **chosen)


class Probe:
    """One scene on one device. `defines`: C text put in front of the program; `chosen`: see Choices."""

    def __init__(self, device: Device, scene: Scene, defines: str = "", **chosen: Any) -> None:
        self.compiled = compile_scene(scene, choices(device, **chosen))
        self._device = device
        self._program = build(device, "\n".join([defines, self.compiled.source, ENTRIES])).program
        flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
        self._scene = [cl.Buffer(device.context, flags, hostbuf=array) for _, array in self.compiled.buffers.values()]

    def __call__(self, entry: str, rows: int, *inputs: ArrayLike, **scalars: int) -> Rows:
        """Runs the kernel probe_`entry` and returns its (n, rows) output.

        inputs: (n,) or (n, k) each, side by side what the kernel reads, as float32. scalars: the kernel's last
        arguments, each a uint, in its order.
        """
        columns = [np.asarray(a, np.float32) for a in inputs]
        given = np.ascontiguousarray(np.column_stack(columns).T)
        n = given.shape[1]
        answer = np.empty((rows, n), np.float32)
        context, queue = self._device.context, self._device.queue
        source = cl.Buffer(context, cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR, hostbuf=given)
        target = cl.Buffer(context, cl.mem_flags.WRITE_ONLY, answer.nbytes)
        kernel = cl.Kernel(self._program, f"probe_{entry}")
        kernel.set_args(*self._scene, self.compiled.counts[0], np.uint32(n), source, target,
                        *map(np.uint32, scalars.values()))
        local = self._device.local_size
        groups = -(-n // (self.compiled.choices.lanes * local))
        cl.enqueue_nd_range_kernel(queue, kernel, (groups * local,), (local,))
        cl.enqueue_copy(queue, answer, target)
        return answer.T.astype(np.float64)
