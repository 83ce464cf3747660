"""Convergence: relMSE by samples and by time, for interleaved contestants with several seeds."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from math import inf, log, nan
from pathlib import Path
from statistics import fmean, linear_regression, median
from typing import Any, NamedTuple

import numpy as np

from ...output.image_error import mean_ratios, relmse
from ...scene.model import Scene
from .bias import mean_tests
from .calibration import noise_ratio
from .contestants import CHOICES, Contestant, Picture, choices_on, peers_of
from .reference import STEP_SPP, Reference, render_reference

#: Samples per pixel, until the time is used up.
POWERS = [2**power for power in range(32)]


class Effort(NamedTuple):
    """Extent of a measurement. seconds: time limit per image; seeds: images per number of samples; spp: the numbers of
    samples per pixel, ascending; steps, step_spp: see reference.py.
    """

    seconds: float = 10.0
    seeds: int = 5
    steps: int = 32
    step_spp: int = STEP_SPP
    spp: Sequence[int] = POWERS


QUICK = Effort(seconds=1.0, seeds=3, steps=2)
#: Images of a scene agree unless all of a channel's means deviate by more than this fraction, in the same direction.
AGREES = 0.005


class Point(NamedTuple):
    """Time and error of one image; mean_ratio: per channel, against the reference.

    noise: the √relMSE that the renderer estimated; NaN if it estimates none.
    """

    spp: int
    seconds: float
    cpu_seconds: float
    relmse: float
    mean_ratio: list[float]
    noise: float = nan


#: Points by contestant and samples per pixel, one per seed.
Points = dict[str, dict[int, list[Point]]]


def measure_convergence(
    scenes: Sequence[Scene],
    devices: Sequence[int],
    effort: Effort,
    *,
    peers: bool = False,
    choices: Mapping[str, Mapping[str, Any]] = CHOICES,
    given: Reference | None = None,
    files: Sequence[Path | None] = (),
    say: Callable[[str], None] = lambda message: None,
) -> Iterator[dict[str, Any]]:
    """Yield the results of `clrt bench converge`, scene by scene.

    scene, size, max_depth; reference: `spp` (0: given) and its own `relmse`; missing: why a peer is not among the
    contestants; and contestants: the result of `figures`. given: the reference; by default one is rendered per scene.
    files: of the scenes, for peers. say: called first with the reasons for missing peers, then for each step of a
    reference that is not cached. Raises what `Renderer` raises.
    """
    others = [
        peers_of(scene, file) if peers else ({}, {}) for scene, file in zip(scenes, files or [None] * len(scenes))
    ]
    for scene, (_, missing) in zip(scenes, others):
        for package, why in missing.items():
            say(f"{scene.name}: without {package}: {why}")
    for scene, (rivals, missing) in zip(scenes, others):

        def on_step(step: int, name: str = scene.name) -> None:
            say(f"{name}: step {step + 1} of {effort.steps} of its reference")

        reference = given or render_reference(
            scene, effort.steps, device=devices[0], step_spp=effort.step_spp, on_step=on_step
        )
        points = take_turns(choices_on(scene, devices, choices) | rivals, reference, effort)
        yield {
            "scene": scene.name,
            "size": scene.render.size,
            "max_depth": scene.render.max_depth,
            "reference": {"spp": reference.spp, "relmse": reference.relmse},
            "missing": missing,
            "contestants": figures(points, reference),
        }


def take_turns(contestants: Mapping[str, Contestant], reference: Reference, effort: Effort) -> Points:
    """Render images of effort's numbers of samples, for each contestant until the next would exceed its seconds."""
    points: Points = {name: {} for name in contestants}
    for seed in range(effort.seeds):
        running = list(contestants)
        for spp, following in zip(effort.spp, [*effort.spp[1:], inf]):
            for name in running:
                picture = contestants[name](spp, seed)
                points[name].setdefault(spp, []).append(_compare(picture, reference))
            running = [name for name in running if points[name][spp][-1].seconds * following / spp <= effort.seconds]
    return {name: {spp: row for spp, row in rows.items() if len(row) == effort.seeds} for name, rows in points.items()}


def _compare(picture: Picture, reference: Reference) -> Point:
    error = relmse(picture.pixels, reference.pixels)
    ratios = mean_ratios(picture.pixels, reference.pixels)
    return Point(
        picture.spp,
        picture.seconds,
        picture.cpu_seconds,
        nan if error is None else error,
        [nan if ratio is None else ratio for ratio in ratios],
        nan if picture.noise is None else picture.noise,
    )


def figures(points: Points, reference: Reference) -> dict[str, dict[str, Any]]:
    """Return results by contestant, in lists by samples: spp; seconds, cpu_seconds (medians); relmse (mean over seeds).

    relmse_range: the minimum and maximum over seeds. The reference's own relMSE is subtracted from both. last: index
    into these lists of the most samples whose error still exceeds the reference's own. There: msamples (per second);
    relmse_seconds and relmse_cpu_seconds, relMSE times seconds, which is constant while errors fall with the square
    root of time; ratio, cpu_ratio: these over the first contestant's.
    slope: of log relMSE over log samples, up to last (−1 for independent samples). For the most samples of all: each
    channel's mean_ratio to the reference, whether it agrees with 1 (see AGREES), and the results of `mean_tests`.
    noise_ratio: by samples and seeds, see `noise_ratio`. NaN: undefined.
    """
    rows = {name: _averages(levels, reference.relmse) for name, levels in points.items()}
    pixels = reference.total.shape[0] * reference.total.shape[1]
    for row in rows.values():
        clear = [k for k, error in enumerate(row["relmse"]) if error > reference.relmse]
        last = clear[-1] if clear else 0
        spp, seconds, cpu_seconds, error = (row[key][last] for key in ("spp", "seconds", "cpu_seconds", "relmse"))
        row |= {
            "last": last,
            "msamples": 1e-6 * spp * pixels / seconds,
            "relmse_seconds": error * seconds,
            "relmse_cpu_seconds": error * cpu_seconds,
            "slope": _slope([row["spp"][k] for k in clear], [row["relmse"][k] for k in clear]),
        }
    first = next(iter(rows.values()))
    for row in rows.values():
        row |= {
            "ratio": _over(row["relmse_seconds"], first["relmse_seconds"]),
            "cpu_ratio": _over(row["relmse_cpu_seconds"], first["relmse_cpu_seconds"]),
        }
    tests = mean_tests(
        {name: np.array([point.mean_ratio for point in levels[max(levels)]]) for name, levels in points.items()},
        reference.means,
    )
    return {name: row | tests[name] for name, row in rows.items()}


def _averages(levels: Mapping[int, Sequence[Point]], own: float) -> dict[str, Any]:
    """Return a contestant's results by samples. own: the reference's relMSE."""
    channels = list(zip(*(point.mean_ratio for point in levels[max(levels)])))
    return {
        "spp": [level[0].spp for level in levels.values()],
        "seconds": [median(point.seconds for point in level) for level in levels.values()],
        "cpu_seconds": [median(point.cpu_seconds for point in level) for level in levels.values()],
        "relmse": [fmean(point.relmse for point in level) - own for level in levels.values()],
        "relmse_range": [
            [choose(point.relmse for point in level) - own for choose in (min, max)] for level in levels.values()
        ],
        "noise_ratio": [[noise_ratio(point.noise, point.relmse, own) for point in level] for level in levels.values()],
        "mean_ratio": [fmean(channel) for channel in channels],
        "agrees": not any(min(channel) > 1 + AGREES or max(channel) < 1 - AGREES for channel in channels),
    }


def _slope(samples: Sequence[int], errors: Sequence[float]) -> float:
    """Return the slope of the least-squares line through the logarithms."""
    return linear_regression([log(n) for n in samples], [log(e) for e in errors]).slope if len(samples) > 1 else nan


def _over(value: float, first: float) -> float:
    return value / first if first > 0 else nan
