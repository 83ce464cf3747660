"""Frames of the theses' experiments at their resolutions (see bench/theses)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

from ...accel.methods import TREELESS
from ...device.discovery.discover import choose
from ..theses.experiments import DEPTHS, Effort, Experiment, experiments, measure_experiment
from .request import Item, Request, Row

EFFORT = Effort(seconds=1.0, rounds=50, depths=DEPTHS)
QUICK = Effort(seconds=0.0, rounds=1, detail=1, smaller=256, part=1, depths=DEPTHS[:1])


def items(request: Request) -> Iterator[Item]:
    """Yield the experiments; those without a BVH are left to GPUs, as they take CPUs minutes."""
    effort, gpu = QUICK if request.quick else EFFORT, choose(request.device)[0].type == "gpu"
    for experiment in experiments(effort):
        chosen = experiment if gpu and not request.quick else _with_trees(experiment)
        yield Item(experiment.name, partial(_measure, chosen, effort, request.device))


def _with_trees(experiment: Experiment) -> Experiment:
    variants = [each for each in experiment.variants if each.options.get("layout") not in TREELESS]
    names = {each.name for each in variants}
    return replace(experiment, variants=variants, ratios=[pair for pair in experiment.ratios if names >= {*pair}])


def _measure(experiment: Experiment, effort: Effort, device: str) -> Row:
    result = measure_experiment(experiment, effort, device=device)
    width, height = result["size"]
    return {**{name: result[name] for name in ("title", "machine", "triangles", "rows")}, "size": f"{width}x{height}"}
