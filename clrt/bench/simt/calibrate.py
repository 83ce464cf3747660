"""The model's two fitted numbers, and its error at measured points."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import exp, log, sqrt

import numpy as np

from .costs import FITTED, QUERY_REGISTERS, Fitted
from .gpus import GPUS, Gpu
from .measured import QueryPoint, ScenePoint
from .model import traversal_seconds
from .variants import Simulation, simulate
from .workloads import Sample

#: Values of Fitted.code that are tried, evenly spaced by ratio.
CODES = np.geomspace(200, 8000, 200)


@dataclass(frozen=True)
class Point:
    """A measured rate per second, and the modelled one as a function of the fitted numbers."""

    name: str
    gpu: str
    is_query: bool
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
        point.name, point.gpu, True, point.rate, lambda fitted: query_rate(simulation, gpu, sample.layout, fitted)
    )


def scene_point(point: ScenePoint, simulation: Simulation) -> Point:
    """Return the point of a scene."""

    def rate(fitted: Fitted) -> float:
        return simulation.paths / simulation.seconds(GPUS[point.gpu], point.program, fitted)

    return Point(point.name, point.gpu, False, point.rate, rate)


def fit(points: Sequence[Point], start: Fitted = FITTED) -> Fitted:
    """Return the numbers with the least squared errors: traversal by the queries, then code by the scenes.

    What no point depends on stays as in `start`.
    """
    queries = [point for point in points if point.is_query]
    scenes = [point for point in points if not point.is_query]
    fitted = start
    if queries:
        errors = [point.error(replace(fitted, traversal=1.0)) for point in queries]
        fitted = replace(fitted, traversal=exp(float(np.mean(errors))))
    if scenes:
        squares = [rms([point.error(replace(fitted, code=code)) for point in scenes]) for code in CODES]
        fitted = replace(fitted, code=float(CODES[int(np.argmin(squares))]))
    return fitted


def leave_one_out(points: Sequence[Point]) -> Mapping[str, list[float]]:
    """Return by kind the error at each point of numbers fitted to all others, log(modelled / measured).

    Points of the same name on other GPUs are left out as well.
    """
    errors: dict[str, list[float]] = {"queries": [], "scenes": []}
    for left in points:
        fitted = fit([point for point in points if point.name != left.name])
        errors["queries" if left.is_query else "scenes"].append(left.error(fitted))
    return errors


def rms(errors: Sequence[float]) -> float:
    """Return the root mean square."""
    return sqrt(float(np.mean(np.square(errors)))) if len(errors) else 0.0
