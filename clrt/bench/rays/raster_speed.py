"""First hits of a camera, rasterized and traced through the same positions (kernels/bench/raster_hits.cl)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...device.launches.device_arrays import empty_array, on_device
from ...device.launches.launch import run_kernel
from ...device.open import Device
from ...device.programs.preamble import typedefs
from ...device.programs.program import build, make_kernel
from ...device.programs.struct_types import record
from ...rendering.accumulation.launch_plan import LaunchPlan
from ...rendering.accumulation.raster_bins import RasterBins
from ...rendering.compile.compile_scene import compile_scene
from ...rendering.film.tiles import TILE_PIXELS, tiles_of
from ...scene.model import Scene
from ..kernel_probe import choices

#: x, y: position in the image, from −1 to 1; t, u, v, primitive, instance: the hit as in the kernels.
SEEN = record(x="f4", y="f4", t="f4", u="f4", v="f4", primitive="i4", instance="i4", pad="i4")


def seen_both_ways(device: Device, scene: Scene, sample: int = 0, **chosen: Any) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return (height, width) SEEN records, rasterized and traced, one sample per pixel; chosen: see `choices`."""
    scene = replace(scene, render=replace(scene.render, integrator="raster"))
    compiled = compile_scene(scene, choices(device, first_hits=True, **chosen), device=device)
    width, height = size = scene.render.size
    launch = LaunchPlan(size, 1, scene.render.seed, scene.render.spp).record(compiled)
    tiles = np.arange(np.prod(tiles_of(size)), dtype=np.uint32)
    launch["pixel_count"], launch["first_sample"] = len(tiles) * TILE_PIXELS, sample
    arguments = [*(on_device(device, array) for _, array in compiled.buffers.values()), compiled.counts[0]]
    program = build(device, compiled.source_of("bench/raster_hits.cl", typedefs({"Seen": SEEN})))
    kernel = make_kernel(device, program, "raster_hits")
    seen = [empty_array(device, SEEN, width * height) for _ in range(2)]
    given = [*(each.buffer for each in seen), on_device(device, tiles), launch[0]]  # kernels keep no references
    bins = RasterBins(device, compiled, arguments)
    kernel.set_args(*arguments, *given, *bins.of(launch, {}))
    run_kernel(device, kernel, -(-len(tiles) * TILE_PIXELS // (compiled.choices.lanes * device.local_size)))
    rasterised, traced = (each.read(device).reshape(height, width) for each in seen)
    return rasterised, traced
