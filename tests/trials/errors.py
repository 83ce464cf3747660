"""`--error` over the gallery: it ends, and how the true error is beside the one that was asked for."""

from __future__ import annotations

from collections.abc import Iterator
from math import sqrt

from clrt.rendering.renderer import Renderer

from .references import true_relmse, with_references

ASKED = (0.05, 0.02)
SEEDS = 3
RIGHT = 1.2


def trial() -> Iterator[str]:
    ratios: dict[float, list[float]] = {asked: [] for asked in ASKED}
    yield f"{'scene':18}{'asked':>6}  samples a pixel, and true error over the one asked for, of {SEEDS} seeds"
    for path, scene, reference in with_references():
        for asked, found in ratios.items():
            told = []
            for seed in range(SEEDS):
                renderer = Renderer(scene, seed=seed)
                for state in renderer.passes(error=asked):
                    pass
                found.append(sqrt(true_relmse(state, reference)) / asked)
                told.append(f"{state.spp}: {found[-1]:.2f}")
            yield f"{path.stem:18}{asked:6}  " + "  ".join(told)
    for asked, found in ratios.items():
        within = sum(ratio <= RIGHT for ratio in found)
        yield f"asked {asked}: {within} of {len(found)} have {RIGHT} times that at most; worst {max(found):.2f}"
