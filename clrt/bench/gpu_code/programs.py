"""The programs that clrt compiles on a GPU: one lane per work-item, the layout cwbvh unless another is chosen."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...accel import device_builder, refit
from ...accel.layouts import Layout, pack
from ...accel.methods import HitTests
from ...check import floats, integers, kernel_calls
from ...device.launches.driver_loop_limits import turns_source
from ...formats.load_scene import load
from ...queries import query_program
from ...rendering.accumulation.first_hits import first_hit_program
from ...rendering.aovs import AOVS
from ...rendering.compile.choices import Choices
from ...rendering.compile.compile_scene import QUEUES, compile_scene
from ..gpu.shipped_scenes import shipped_scenes

#: Choices of a device that is a GPU (see device/open.py), and with a kernel per stage of path tracing.
ON_GPU = Choices(lanes=1, layout="cwbvh")
BY_QUEUES = replace(ON_GPU, paths="queues")
#: Layouts that GPUs use, the default first.
LAYOUTS = ("cwbvh", "bvh2")
#: The scenes whose programs of other kinds are compiled, too: AOVs, and the rasterizer.
AOV_SCENE, RASTER_SCENE = "textures", "local"
TESTS = HitTests()


@dataclass(frozen=True)
class GpuProgram:
    """The text of a program, by a name such as scene/dragon."""

    name: str
    source: str


def scene_programs(paths: Iterable[Path]) -> Iterator[GpuProgram]:
    """Yield the programs that compute the images of scenes: the megakernel, and for paths the kernels of the queues."""
    for path in paths:
        scene = load(path)
        megakernel, queues = (compile_scene(scene, choices) for choices in (ON_GPU, BY_QUEUES))
        yield GpuProgram(f"scene/{path.stem}", megakernel.source)
        if queues.entry == QUEUES:
            yield GpuProgram(f"queues/{path.stem}", queues.source)


def all_programs() -> Iterator[GpuProgram]:
    """Yield the programs of the gallery, of ray queries, BVH builders and refits, AOVs, the rasterizer and checks."""
    scenes = shipped_scenes()
    yield from scene_programs(scenes)
    yield from _other_programs({path.stem: path for path in scenes})
    for layout in LAYOUTS:
        yield from _queries(layout)
        yield GpuProgram(
            f"build/{layout}", device_builder.program_source(device_builder.SHAPES[layout], True, True, True)
        )
    yield GpuProgram("refit/bvh2", refit.program_source("bvh2"))
    yield from _checks()


def _other_programs(scenes: dict[str, Path]) -> Iterator[GpuProgram]:
    compiled = compile_scene(load(scenes[AOV_SCENE]), ON_GPU)
    yield GpuProgram("aov/first_hit", first_hit_program(compiled, AOVS)[0])
    yield GpuProgram("aov/denoiser_guides", compiled.source_of("aov/denoiser_guides.cl"))
    scene = load(scenes[RASTER_SCENE])
    compiled = compile_scene(replace(scene, render=replace(scene.render, integrator="raster")), ON_GPU)
    yield GpuProgram("raster/image", compiled.source)
    yield GpuProgram("raster/outline", compiled.source_of("raster/outline.cl"))


def _queries(layout: str) -> Iterator[GpuProgram]:
    """Yield the queries of triangles; that for any hit has the same program as that for the closest one."""
    for name in ("closest_hit", "next_hit"):
        source = query_program.program_source(name, "single", _one_triangle(layout), (True, False), TESTS, 1, False)
        yield GpuProgram(f"query/{layout}/{name}", source)


def _one_triangle(layout: str) -> Layout:
    return pack(layout, "sah", np.eye(3, dtype=np.float32)[None], np.zeros((0, 4), np.float32))


def _checks() -> Iterator[GpuProgram]:
    rows = {
        "floats": floats.ROWS,
        "integers": (*integers.INTEGERS, *integers.COMPARISONS),
        "words": tuple(integers.WORDS),
    }
    for file in kernel_calls.FILES:
        yield GpuProgram(f"check/{file}", kernel_calls.source(file, 1, rows.get(file, ())))
    yield GpuProgram("check/loops", turns_source())
