"""Ratio of estimated to true error for each scene of the gallery at several sample counts."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite
from statistics import median

from clrt.bench.convergence.calibration import RIGHT, calibration, noise_ratio
from clrt.rendering.renderer import Renderer

from .references import true_relmse, with_references

LEVELS = (2, 4, 8, 16, 32, 64, 128, 256)
#: Images of fewer samples are left out of the last lines: two samples give a single difference.
FEWEST = (4, 8)
#: Other seeds than those by which the estimator's constants were chosen.
SEEDS = range(100, 103)


def trial() -> Iterator[str]:
    every: dict[int, list[float]] = {spp: [] for spp in LEVELS}
    yield f"{'scene':18}" + "".join(f"{spp:>7}" for spp in LEVELS) + f"  samples per pixel; median of {len(SEEDS)}"
    for path, scene, reference in with_references():
        medians = []
        for spp in LEVELS:
            ratios = []
            for seed in SEEDS:
                for state in Renderer(scene, spp=spp, seed=seed).passes(spp=spp):
                    pass
                error = true_relmse(state, reference) + reference.relmse
                ratios.append(noise_ratio(state.noise or 0.0, error, reference.relmse))
            medians.append(median(ratios))
            every[spp] += filter(isfinite, ratios)
        yield f"{path.stem:18}" + "".join(f"{ratio:7.2f}" for ratio in medians)
    for fewest in FEWEST:
        ratios = [ratio for spp in LEVELS if spp >= fewest for ratio in every[spp]]
        told, low = calibration(ratios), sum(ratio * RIGHT < 1 for ratio in ratios)
        yield (
            f"of {told['pictures']} pictures of {fewest} samples or more {told['within']:.1%} are right to {RIGHT}, "
            f"{low / len(ratios):.1%} are told too low; median {told['median']:.2f}, worst {told['worst']:.2f}"
        )
