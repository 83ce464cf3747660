"""Renders the gallery with `--error`: each render ends, and its true error is compared with the requested one.

Images are small, since a reference takes four times the samples of the longest of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import sqrt

from clrt.bench.convergence.reference import render_reference
from clrt.rendering.renderer import Renderer

from .references import STEPS, small, true_relmse
from .renders import GALLERY

ASKED = (0.05, 0.02)
SEEDS = 3
RIGHT = 1.2
SIDE = 96


def trial() -> Iterator[str]:
    ratios: dict[float, list[float]] = {asked: [] for asked in ASKED}
    yield f"{'scene':18}{'asked':>6}  samples per pixel, and true error over the one asked for, of {SEEDS} seeds"
    for path in GALLERY:
        scene = small(path, SIDE)
        for asked, found in ratios.items():
            states = [list(Renderer(scene, seed=seed).passes(error=asked))[-1] for seed in range(SEEDS)]
            most = max(state.spp for state in states)
            reference = render_reference(scene, STEPS, step_spp=-(-4 * most // STEPS))
            found += (those := [sqrt(true_relmse(state, reference)) / asked for state in states])
            yield f"{path.stem:18}{asked:6}  " + "  ".join(f"{s.spp}: {ratio:.2f}" for s, ratio in zip(states, those))
    for asked, found in ratios.items():
        within = sum(ratio <= RIGHT for ratio in found)
        yield f"asked {asked}: {within} of {len(found)} have {RIGHT} times that at most; worst {max(found):.2f}"
