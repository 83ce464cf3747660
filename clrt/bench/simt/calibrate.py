"""The model's two fitted numbers, and its error at measured points."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import exp, log, sqrt

import numpy as np

from .costs import FITTED, QUERY_REGISTERS, Fitted
from .gpus import GPUS, Gpu
from .measured import QueryPoint, ScenePoint
from .model import traversal_seconds
from .variants import Program, Simulation, simulate
from .workloads import Sample

#: Values of Fitted.code that are tried, evenly spaced by ratio.
CODES = np.geomspace(200, 8000, 200)


@dataclass(frozen=True)
class Point:
    """A measured rate per second, and the modelled one as a function of the fitted numbers. kind: "queries", a variant,
    or a stage of queues."""

    name: str
    gpu: str
    kind: str
    measured: float
    modelled: Callable[[Fitted], float]

    def error(self, fitted: Fitted) -> float:
        """Return log(modelled / measured)."""
        return log(self.modelled(fitted) / self.measured)


def query_rate(simulation: Simulation, gpu: Gpu, layout: str, fitted: Fitted) -> float:
    """Return the modelled rays per second of a query."""
    stages = simulation.traversals.values()
    return simulation.rays / sum(traversal_seconds(gpu, each, QUERY_REGISTERS[layout], fitted) for each in stages)


def query_point(point: QueryPoint, sample: Sample) -> Point:
    """Return the point of a query."""
    gpu = GPUS[point.gpu]
    simulation = simulate(sample.visits, "megakernel", gpu.width, sample.layout, sample.data_bytes)
    return Point(
        point.name, point.gpu, "queries", point.rate, lambda fitted: query_rate(simulation, gpu, sample.layout, fitted)
    )


def scene_point(point: ScenePoint, simulation: Simulation, program: Program) -> Point:
    """Return the point of a scene, or of a stage."""
    gpu = GPUS[point.gpu]

    def rate(fitted: Fitted) -> float:
        stages = simulation.stages(gpu, program, fitted)
        return simulation.paths / (stages[point.stage] if point.stage else sum(stages.values()))

    return Point(point.name, point.gpu, point.stage or point.variant, point.rate, rate)


def fit(points: Sequence[Point], start: Fitted = FITTED) -> Fitted:
    """Return the numbers with the least squared errors: traversal by queries, code by megakernels, shade by that stage.

    What no point depends on stays as in `start`.
    """
    kinds: dict[str, list[Point]] = {}
    for point in points:
        kinds.setdefault(point.kind, []).append(point)
    fitted = start
    if queries := kinds.get("queries"):
        fitted = replace(fitted, traversal=exp(_mean_error(queries, replace(fitted, traversal=1.0))))
    if shades := kinds.get("shade"):
        fitted = replace(fitted, shade=exp(_mean_error(shades, replace(fitted, shade=1.0))))
    if megakernels := kinds.get("megakernel"):
        errors = [rms([point.error(replace(fitted, code=code)) for point in megakernels]) for code in CODES]
        fitted = replace(fitted, code=float(CODES[int(np.argmin(errors))]))
    return fitted


def _mean_error(points: Sequence[Point], fitted: Fitted) -> float:
    return float(np.mean([point.error(fitted) for point in points]))


def leave_one_out(points: Sequence[Point]) -> list[float]:
    """Return the error at each point of numbers fitted to all others, log(modelled / measured).

    Points of the same name on other GPUs are left out as well.
    """
    return [left.error(fit([point for point in points if point.name != left.name])) for left in points]


def rms(errors: Sequence[float]) -> float:
    """Return the root mean square."""
    return sqrt(float(np.mean(np.square(errors)))) if len(errors) else 0.0
