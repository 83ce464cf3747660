"""Calls kernel functions on arrays: a scene's program with kernels/bench/probe.cl in place of integrator/path.cl."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..accel.methods import HitTests
from ..device.launches.device_arrays import empty_array, on_device
from ..device.launches.launch import run_kernel
from ..device.open import Device
from ..device.programs.program import build, make_kernel
from ..rendering.compile.choices import Choices
from ..rendering.compile.compile_scene import compile_scene
from ..scene.model import Scene

Doubles = NDArray[np.float64]


def choices(device: Device, **chosen: Any) -> Choices:
    """Return the device's own choices with the given changes: fields of Choices and of HitTests."""
    tests = HitTests(**{name: chosen.pop(name) for name in ("triangle", "box", "sphere") if name in chosen})
    return replace(Choices(device.lanes, device.layout, tests=tests), **chosen)


class Probe:
    """A scene's program on a device, with entry points for single functions.

    defines: C text that precedes the program; changes: replacements of kernel text, to check that a test detects them;
    chosen: see `choices`.
    """

    def __init__(
        self, device: Device, scene: Scene, defines: str = "", changes: Mapping[str, str] | None = None, **chosen: Any
    ) -> None:
        self.compiled = compile_scene(scene, choices(device, **chosen), "bench/probe.cl")
        source = f"{defines}\n{self.compiled.source}"
        for text, other in (changes or {}).items():
            source = source.replace(text, other)
        self._device = device
        self._program = build(device, source)
        self._scene = [on_device(device, array) for _, array in self.compiled.buffers.values()]

    def __call__(self, entry: str, rows: int, *inputs: ArrayLike, **scalars: int) -> Doubles:
        """Run the kernel probe_`entry` and return its (n, rows) output.

        inputs: (n,) or (n, k) each, the columns that the kernel reads, as float32. scalars: the kernel's last
        arguments, each a uint, in its order.
        """
        device, given = self._device, np.ascontiguousarray(np.column_stack(inputs).T, np.float32)
        n = given.shape[1]
        answer = empty_array(device, np.float32, rows * n)
        kernel, source = make_kernel(device, self._program, f"probe_{entry}"), on_device(device, given)
        kernel.set_args(
            *self._scene,
            self.compiled.counts[0],
            np.uint32(n),
            source,
            answer.buffer,
            *map(np.uint32, scalars.values()),
        )
        run_kernel(device, kernel, -(-n // (self.compiled.choices.lanes * device.local_size)))
        return answer.read(device).reshape(rows, n).T.astype(np.float64)
