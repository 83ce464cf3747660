"""Designs that the model compares: how lanes are formed, and the time that a GPU takes for each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .costs import QUERY_REGISTERS, SHARED_INSTRUCTIONS, SHARED_SHADE, STATE_BYTES, TRAVERSAL_INSTRUCTIONS, Fitted
from .gpus import Gpu
from .misses import line_stream, miss_curve
from .model import Traversal, shading_seconds, traversal_seconds
from .visits import CONNECT, EXTEND, Ints, Visits
from .warps import TYPE_BITS, Passes, Warps, in_paths, in_queues, shading_passes, traversal_passes

#: Megakernel; queues of rays and surfaces; queues with surfaces sorted by type of material.
VARIANTS = ("megakernel", "queues", "sorted")
STAGES = {EXTEND: "extend", CONNECT: "connect"}


@dataclass(frozen=True)
class Program:
    """A scene's programs as compiled: registers per lane and instructions of the megakernel, and instructions of the
    queues' stage shade."""

    registers: int
    instructions: int
    shade: int


@dataclass(frozen=True)
class Simulation:
    """A variant simulated with warps of a width. traversals, traced: by stage, and how many rays; shading: a pass per
    type of material in a warp; unsorted: the same without sorting; segments: warps that trace a segment; types: of
    materials in the scene."""

    variant: str
    width: int
    paths: int
    rays: int
    surfaces: int
    segments: int
    types: int
    traversals: dict[str, Traversal]
    traced: dict[str, int]
    shading: Passes
    unsorted: Passes
    shaded_warps: int

    def seconds(self, gpu: Gpu, program: Program, fitted: Fitted) -> float:
        """Return the modelled seconds on a GPU whose warps have this width."""
        return sum(self.stages(gpu, program, fitted).values())

    def stages(self, gpu: Gpu, program: Program, fitted: Fitted) -> dict[str, float]:
        """Return the seconds of each stage.

        The megakernel's registers hold in all its code, those of queues by stage. A stage of queues takes at least the
        time to read and write its state.
        """
        megakernel = self.variant == "megakernel"
        seconds = {
            stage: traversal_seconds(
                gpu, each, program.registers if megakernel else QUERY_REGISTERS[each.layout], fitted
            )
            for stage, each in self.traversals.items()
        }
        if megakernel:
            code = max(0, program.instructions - TRAVERSAL_INSTRUCTIONS)
            executed = self._executed(self.shading, code, SHARED_INSTRUCTIONS)
            slowed = max(1.0, code / fitted.code)
            seconds["shade"] = shading_seconds(gpu, self.segments, executed * slowed)
            return seconds
        share = self._executed(self.shading, program.shade, SHARED_SHADE)
        share /= self._executed(self.unsorted, program.shade, SHARED_SHADE)
        seconds["shade"] = shading_seconds(gpu, self.segments, fitted.shade * program.shade * share)
        handled = self.traced | {"shade": self.surfaces}
        return {
            stage: max(each, handled[stage] * STATE_BYTES[stage] / (gpu.memory_gbs * 1e9))
            for stage, each in seconds.items()
        }

    def _executed(self, passes: Passes, code: int, shared: int) -> float:
        """Return the instructions that a warp executes: `shared` ones, and others by the types of material it meets."""
        met = passes.passes / (self.shaded_warps * self.types) if self.shaded_warps else 1.0
        return min(code, shared) + max(0, code - shared) * met


def simulate(
    visits: Visits, variant: str, width: int, layout: str, data_bytes: int, position: Ints | None = None
) -> Simulation:
    """Simulate a variant of VARIANTS. position: of each path among the lanes."""
    warps = (
        in_paths(visits, width, position)
        if variant == "megakernel"
        else in_queues(visits, width, position, by_material=variant == "sorted")
    )
    extended = (visits.stage == EXTEND) & (visits.number == 0)
    return Simulation(
        variant,
        width,
        visits.paths,
        visits.rays,
        len(visits.material),
        len(np.unique(warps.of_ray[extended])),
        len(np.unique(visits.material & TYPE_BITS)),
        {
            name: _traversal(visits, warps, layout, data_bytes, stage)
            for stage, name in STAGES.items()
            if (visits.stage == stage).any()
        },
        {name: int(np.count_nonzero(visits.stage == stage)) for stage, name in STAGES.items()},
        shading_passes(visits, warps),
        shading_passes(visits, in_queues(visits, width, position) if variant == "sorted" else warps),
        len(np.unique(warps.of_surface)),
    )


def _traversal(visits: Visits, warps: Warps, layout: str, data_bytes: int, stage: int) -> Traversal:
    chosen = visits.stage == stage
    misses = miss_curve(line_stream(visits, warps, layout, chosen))
    return Traversal(layout, traversal_passes(visits, warps, layout, chosen), misses, data_bytes)
