"""Time of simulated passes on a GPU.

A scheduler's resident warps take turns: each issues the instructions of a pass, then waits for its own dependent
instructions and for its loads. That is a closed queue with a delay, whose throughput mean value analysis gives exactly
(Reiser and Lavenberg 1980). Loads also take a cycle of the core for each cache line of each instruction, and memory its
bandwidth; the slowest of these counts.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from .costs import INSTRUCTIONS, LOADS, LONE_CYCLES, Fitted
from .gpus import Gpu
from .misses import MissCurve
from .visits import LEAVES
from .warps import LINE, Passes


@dataclass(frozen=True)
class Traversal:
    """Simulated traversal. misses: of the lines touched; data_bytes: of the scene."""

    layout: str
    passes: Mapping[int, Passes]
    misses: MissCurve
    data_bytes: int


def cycles_per_pass(issue: float, wait: float, warps: int) -> float:
    """Return the cycles between passes of a scheduler with `warps` warps, each of which issues and then waits."""
    queued = interval = 0.0
    for number in range(1, warps + 1):
        response = issue * (1 + queued)
        interval = (wait + response) / number
        queued = response / interval
    return interval


def traversal_seconds(gpu: Gpu, traversal: Traversal, registers: int, fitted: Fitted) -> float:
    """Return the seconds that all cores take for these passes."""
    warps, cycles, missed_bytes = gpu.in_flight(registers), 0.0, 0.0
    missed = traversal.misses.ratio(gpu.l1_bytes // LINE)
    kept = min(1.0, gpu.l2_bytes / max(1, traversal.data_bytes))
    beyond = kept * gpu.l2_cycles + (1 - kept) * gpu.memory_cycles
    for kind, passes in traversal.passes.items():
        if not passes.passes:
            continue
        issue = INSTRUCTIONS[traversal.layout][kind] * gpu.cycles
        lines = LOADS[traversal.layout][kind] * passes.lines / passes.passes
        touched = passes.touched / passes.passes
        any_missed = 1 - (1 - missed) ** touched
        load = 0.0 if kind == LEAVES else gpu.l1_cycles + (beyond - gpu.l1_cycles) * any_missed + lines
        wait = (LONE_CYCLES - 1) * issue + load
        interval = max(cycles_per_pass(issue, wait, warps) / gpu.schedulers, lines)
        cycles += passes.passes * interval
        missed_bytes += passes.touched * missed * LINE * (1 - kept)
    computed = fitted.traversal * cycles / (gpu.cores * gpu.ghz * 1e9)
    return max(computed, missed_bytes / (gpu.memory_gbs * 1e9))


def shading_seconds(gpu: Gpu, warps: int, cycles: float) -> float:
    """Return the seconds in which all cores shade `warps` warps, each of which takes a scheduler so many cycles."""
    return warps * cycles * gpu.cycles / (gpu.schedulers * gpu.cores * gpu.ghz * 1e9)
