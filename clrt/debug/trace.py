"""Tracing of one pixel's samples on a device, recording every vertex of their paths."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..device.launches.device_arrays import empty_array
from ..device.launches.launch import wait_for
from ..device.open import Device
from ..device.programs.program import make_kernel
from ..errors import UsageError
from ..rendering.accumulation.checked_loops import check_paths
from ..rendering.accumulation.launch_plan import LaunchPlan, first_launch_samples
from ..rendering.accumulation.scene_on_device import SceneOnDevice
from ..rendering.compile.choices import Choices
from ..rendering.compile.compile_scene import DEBUG, CompiledScene, compile_scene
from ..rendering.compile.features import WITH_LIGHT
from ..rendering.error_estimate.adaptive_sampling import most_planned
from ..rendering.guiding.training import guided
from ..scene.model import RenderSettings, Scene
from ..scene.on_ground import on_ground
from .record import VERTEX, PathEnd, vertex_preamble

#: Maximum records per launch, unless a single sample needs more.
MOST_RECORDS = 1 << 15
#: Samples with a component brighter than this, or not finite, are dropped (kernels/film/film.cl).
BRIGHTEST = np.float32(1e31)


@dataclass(frozen=True)
class PixelPaths:
    """Paths of a pixel's samples, in order.

    rows: (n,) VERTEX records, path by path, in the frame of the compiled scene. starts: (spp,) where each path begins.
    values: (spp, 3) float32, the samples as the render adds them up.
    """

    scene: Scene
    compiled: CompiledScene
    pixel: tuple[int, int]
    rows: NDArray[Any]
    starts: NDArray[np.int64]
    values: NDArray[np.float32]

    @property
    def kept(self) -> NDArray[np.bool_]:
        """(spp,) which samples the film accepts: those that are finite."""
        with np.errstate(invalid="ignore"):
            return np.asarray(np.all(np.abs(self.values) <= BRIGHTEST, axis=1))

    @property
    def value(self) -> NDArray[np.float64]:
        """(3,) mean of the accepted samples, i.e. the pixel of the render; 0 if there are none."""
        kept = self.values[self.kept].astype(np.float64)
        return np.asarray(kept.mean(axis=0) if len(kept) else np.zeros(3))

    @property
    def depth(self) -> NDArray[np.int64]:
        """(n,) path depth of each vertex, from 1."""
        return np.arange(len(self.rows)) - np.repeat(self.starts, self.lengths) + 1

    @property
    def lengths(self) -> NDArray[np.int64]:
        """(spp,) number of vertices of each path."""
        return np.diff(np.append(self.starts, len(self.rows)))


def trace_pixel(scene: Scene, device: Device, pixel: tuple[int, int], choices: Choices = Choices()) -> PixelPaths:
    """Trace all `scene.render.spp` samples of the pixel (column, row), counted from the upper left corner, exactly as a
    render with the scene's settings does.

    Raises UsageError if the pixel is outside the image, or the integrator does not trace paths; SceneError, DeviceError
    and KernelError like a render.
    """
    settings = scene.render
    _check(settings, pixel)
    plan = LaunchPlan.of(settings, most_planned(settings.spp, settings.adaptive))
    compiled = compile_scene(on_ground(scene), choices, DEBUG, device)
    if choices.guiding == "on":
        rendered, *_ = guided([device], [compile_scene(on_ground(scene), choices, device=device)], plan)
        compiled = replace(compiled, buffers=rendered.buffers)
    compiled = replace(compiled, preamble=f"{compiled.preamble}\n{vertex_preamble()}")
    launch, depth = plan.record(compiled), plan.max_depth
    launch["first_pixel"] = pixel[1] * settings.size[0] + pixel[0]
    batch = min(settings.spp, max(1, min(first_launch_samples(compiled), MOST_RECORDS // depth)))
    on_device = SceneOnDevice(device, compiled, launch, batch * depth * VERTEX.itemsize)
    kernel = make_kernel(device, on_device.program, compiled.kernel)
    with on_device.allocating():
        records = empty_array(device, VERTEX, batch * depth)
    rows, lengths, values = [], [], []
    for first in range(0, settings.spp, batch):
        count = min(batch, settings.spp - first)
        launch["first_sample"], launch["sample_count"] = first, count
        kernel.set_args(*on_device.scene_arguments, records.buffer, launch[0])
        wait_for(on_device.enqueue(kernel, count))
        paths = records.read(device).reshape(batch, depth)[:count]
        check_paths(device, int(np.sum(paths["end"][:, 0] == PathEnd.LOOPS)), count)
        length = 1 + np.argmax(paths["end"] != PathEnd.NONE, axis=1)
        used = np.arange(depth) < length[:, None]
        rows.append(paths[used])
        lengths.append(length)
        values.append(_sums(paths, used))
    starts = np.cumsum(np.concatenate(lengths)) - np.concatenate(lengths)
    return PixelPaths(scene, compiled, pixel, np.concatenate(rows), starts, np.concatenate(values))


def contributions(rows: NDArray[Any], part: str) -> NDArray[np.float32]:
    """Return (n, 3) float32: what VERTEX records contribute to their samples by `part`, "emission" or "direct"."""
    return np.asarray(rows[part] * rows[f"{part}_clamp"][:, None])


def _check(settings: RenderSettings, pixel: tuple[int, int]) -> None:
    width, height = settings.size
    if settings.integrator not in WITH_LIGHT:
        raise UsageError(f'integrator "{settings.integrator}" traces no paths; choose {" or ".join(WITH_LIGHT)}')
    if not (0 <= pixel[0] < width and 0 <= pixel[1] < height):
        raise UsageError(
            f"pixel {pixel[0]},{pixel[1]} is outside the image of {width}x{height}; X must be 0 to "
            f"{width - 1} and Y 0 to {height - 1}, counted from the upper left corner"
        )


def _sums(paths: NDArray[Any], used: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return (count, 3), each path's contributions in float32, summed in the order of the render."""
    total = np.zeros((len(paths), 3), np.float32)
    with np.errstate(invalid="ignore", over="ignore"):
        for depth in range(paths.shape[1]):
            for part in ("emission", "direct"):
                total += np.where(used[:, depth, None], contributions(paths[:, depth], part), np.float32(0))
    return total
