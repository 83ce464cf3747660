"""The results of `clrt bench simt`: errors at measured points, simulated warps, and rates predicted for GPUs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from math import exp
from typing import Any

import numpy as np

from ...device.open import Device
from ...scene.model import Scene
from .calibrate import Point, fit, leave_one_out, query_point, query_rate, rms, scene_point
from .costs import FITTED, INSTRUCTIONS, QUERY_REGISTERS
from .gpus import GPUS, Gpu
from .groups import held, warps_in_groups
from .measured import measured_programs, measured_queries, measured_scenes
from .variants import STAGES, VARIANTS, Program, Simulation, simulate
from .visits import EXTEND, KINDS, Ints, Visits, label
from .warps import LINE, Warps, in_paths, in_queues, traversal_passes
from .workloads import Sample, by_rows, sampled_paths, sampled_queries

LAYOUTS = tuple(INSTRUCTIONS)
#: Work-group sizes that are compared, in lanes.
GROUPS = (32, 64, 128, 256)
#: The GPU whose caches and warps are simulated where none is named.
REFERENCE = "H200"
#: A scene's program, if it has not been measured: about the median of the gallery's.
USUAL = Program(registers=208, instructions=6500, shade=4000)
#: Rates in Grays/s that others published for their own kernels and scenes, which this model does not have: GPU, source,
#: lowest and highest.
PUBLISHED = {
    "RTX 4070 Ti": (
        "tray_racing 2024: primary and ambient occlusion rays at 1920x1080 in 2.75 to 3.53 ms, mean of eight scenes",
        (1.17e9, 1.51e9),
    )
}


@dataclass(frozen=True)
class Effort:
    """How much is simulated. rays, paths: in a sample; largest: side of the largest image whose rays are made."""

    rays: int = 32768
    paths: int = 32768
    largest: int = 2048


QUICK = Effort(rays=4096, paths=4096, largest=800)


class Queries:
    """Samples of queries, each made once."""

    def __init__(self, device: Device, effort: Effort) -> None:
        self._device, self._effort = device, effort
        self._made: dict[tuple[str, int, int], dict[str, Sample]] = {}

    def samples(self, layout: str, subdivisions: int, side: int) -> dict[str, Sample]:
        """Return the samples by kind of rays."""
        key = layout, subdivisions, side
        if key not in self._made:
            self._made[key] = sampled_queries(self._device, *key, self._effort.rays)
        return self._made[key]

    def points(self) -> Iterator[Point]:
        """Yield the measured points that the effort allows."""
        for point in measured_queries():
            if point.side <= self._effort.largest:
                yield query_point(point, self.samples(point.layout, point.subdivisions, point.side)[point.kind])


def scene_points(name: str, sample: Sample) -> Iterator[Point]:
    """Yield the measured points of a scene, by its file's name without suffix, in the sample's layout."""
    simulations: dict[tuple[str, int], Simulation] = {}
    for point in measured_scenes():
        if (point.scene, point.layout) == (name, sample.layout):
            key = point.variant, GPUS[point.gpu].width
            if key not in simulations:
                simulations[key] = simulate(sample.visits, *key, sample.layout, sample.data_bytes)
            yield scene_point(point, simulations[key], measured_programs()[name])


def errors_at(points: Iterable[Point]) -> dict[str, Any]:
    """Return measured and modelled rates, and the errors with the stored numbers and with those fitted to all others.

    factor: by kind of points, exp of the root mean square of log(modelled / measured), each left out of the fit.
    """
    listed = list(points)
    left_out = leave_one_out(listed)
    rows = [
        {
            "gpu": point.gpu,
            "kind": point.kind,
            "point": point.name,
            "measured": point.measured,
            "modelled": point.modelled(FITTED),
            "left_out": exp(error),
        }
        for point, error in zip(listed, left_out)
    ]
    kinds = dict.fromkeys(point.kind for point in listed)
    factor = {kind: exp(rms([e for p, e in zip(listed, left_out) if p.kind == kind])) for kind in kinds}
    return {"fitted": asdict(fit(listed)), "factor": factor, "rows": rows}


def warps_of(sample: Sample, layout: str) -> dict[str, Any]:
    """Return by variant and stage: passes per ray, lanes that work, lines per load of 16 bytes and misses."""
    gpu = GPUS[REFERENCE]
    result: dict[str, Any] = {}
    for variant in VARIANTS:
        simulation = simulate(sample.visits, variant, gpu.width, layout, sample.data_bytes)
        result[variant] = {name: _stage(simulation, name) for name in simulation.traversals}
        result[variant]["shade"] = {"lanes": simulation.shading.utilisation(gpu.width)}
    return result


def _stage(simulation: Simulation, name: str) -> dict[str, Any]:
    traversal = simulation.traversals[name]
    issued = worked = 0
    for kind, passes in traversal.passes.items():
        cost = INSTRUCTIONS[traversal.layout][kind]
        issued += cost * passes.passes * simulation.width
        worked += cost * passes.lanes
    kinds = {
        KINDS[kind]: {
            "passes": passes.passes,
            "lanes": passes.utilisation(simulation.width),
            "touched": passes.touched / passes.passes,
        }
        for kind, passes in traversal.passes.items()
        if passes.passes
    }
    return {
        "lanes": worked / issued if issued else 1.0,
        "missed": traversal.misses.ratio(GPUS[REFERENCE].l1_bytes // LINE),
        "kinds": kinds,
    }


def orders_of(sample: Sample, layout: str) -> dict[str, Any]:
    """Return what camera rays do if a warp's pixels are a tile of 8x4, or a row of 32."""
    visits, gpu = sample.visits, GPUS[REFERENCE]
    chosen = (visits.stage == EXTEND) & (visits.segment == 0)
    result = {}
    for name, position in (("tiles of 8x4", None), ("rows of 32", by_rows(visits.paths))):
        passes = traversal_passes(visits, in_paths(visits, gpu.width, position), layout, chosen)
        result[name] = {
            KINDS[kind]: {"passes": each.passes, "lanes": each.utilisation(gpu.width), "touched": each.touched}
            for kind, each in passes.items()
            if each.passes
        }
    return result


def groups_of(sample: Sample, layout: str, program: Program) -> dict[str, Any]:
    """Return by work-group size the resident warps of a core, and the fraction of that time in which they work.

    For the megakernel, and for queues that extend paths.
    """
    visits, gpu = sample.visits, GPUS[REFERENCE]
    paths, queues = in_paths(visits, gpu.width), in_queues(visits, gpu.width)
    kinds = {
        "megakernel": (program.registers, _work(visits, paths, layout, visits.path // gpu.width)),
        "extend": (QUERY_REGISTERS[layout], _work(visits, queues, layout, queues.of_ray, EXTEND)),
    }
    return {
        name: {
            group: {
                "warps": warps_in_groups(gpu, registers, group),
                "held": held(work, max(1, group // gpu.width)),
            }
            for group in GROUPS
        }
        for name, (registers, work) in kinds.items()
    }


def _work(visits: Visits, warps: Warps, layout: str, holder: Ints, stage: int | None = None) -> Ints:
    """Return the instructions of the passes of each holder of a place, numbered per ray; of all stages or one."""
    seen = np.ones(len(visits.ray), bool) if stage is None else (visits.stage == stage)[visits.ray]
    ray, kind = visits.ray[seen], visits.kind[seen]
    _, first = np.unique(label(warps.of_ray[ray], visits.turn[seen], visits.place[seen], kind), return_index=True)
    costs = np.array([INSTRUCTIONS[layout][each] for each in sorted(INSTRUCTIONS[layout])])
    work = np.bincount(holder[ray][first], costs[kind[first]])
    return np.asarray(work[np.unique(holder[ray])], np.int64)


def predicted_queries(queries: Queries, gpus: Mapping[str, Gpu], side: int) -> dict[str, Any]:
    """Return rays per second by GPU, layout and kind: the bumpy sphere of 49 152 triangles, side² primary rays."""
    widths = {gpu.width for gpu in gpus.values()}
    simulations = {
        (layout, kind, width): simulate(sample.visits, "megakernel", width, layout, sample.data_bytes)
        for layout in LAYOUTS
        for kind, sample in queries.samples(layout, 6, side).items()
        for width in widths
    }
    rates: dict[str, Any] = {name: {layout: {} for layout in LAYOUTS} for name in gpus}
    for name, gpu in gpus.items():
        for (layout, kind, width), simulation in simulations.items():
            if width == gpu.width:
                rates[name][layout][kind] = query_rate(simulation, gpu, layout, FITTED)
    return rates


def predicted_scene(samples: Mapping[str, Sample], program: Program, gpus: Mapping[str, Gpu]) -> dict[str, Any]:
    """Return by GPU, layout and variant: samples and rays per second, and each stage's fraction of the time."""
    result: dict[str, Any] = {name: {layout: {} for layout in samples} for name in gpus}
    for layout, sample in samples.items():
        for variant in VARIANTS:
            simulations = {
                width: simulate(sample.visits, variant, width, layout, sample.data_bytes)
                for width in {gpu.width for gpu in gpus.values()}
            }
            for name, gpu in gpus.items():
                result[name][layout][variant] = _rates(simulations[gpu.width], gpu, program)
    return result


def _rates(simulation: Simulation, gpu: Gpu, program: Program) -> dict[str, float]:
    stages = simulation.stages(gpu, program, FITTED)
    seconds = sum(stages.values())
    shares = {stage: stages.get(stage, 0.0) / seconds for stage in (*STAGES.values(), "shade")}
    return {"samples": simulation.paths / seconds, "rays": simulation.rays / seconds, **shares}


def sampled_scene(device: Device, scene: Scene, effort: Effort, size: int = 1024) -> dict[str, Sample]:
    """Return samples of a scene's paths by layout."""
    return {layout: sampled_paths(device, scene, layout, size, effort.paths) for layout in LAYOUTS}


def points_of(scenes: Mapping[str, Mapping[str, Sample]]) -> Iterator[Point]:
    """Yield the measured points of scenes, by name and layout."""
    for name, samples in scenes.items():
        for sample in samples.values():
            yield from scene_points(name, sample)
