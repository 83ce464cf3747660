"""`--error` over the gallery: it ends, and how the true error is beside the one that was asked for.

The truth is a reference of 2048 samples a pixel, kept in the cache; its own error is taken away.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from math import sqrt

import clrt
from clrt.output.compare import relmse
from clrt.rendering.renderer import Renderer
from clrt.study.reference import render_reference

from .renders import GALLERY

#: Pixels along the longer side.
SIDE = 256
ASKED = (0.05, 0.02)
SEEDS = 3
RIGHT = 1.2


def trial() -> Iterator[str]:
    ratios: dict[float, list[float]] = {asked: [] for asked in ASKED}
    yield f"{'scene':18}{'asked':>6}  samples a pixel, and true error over the one asked for, of {SEEDS} seeds"
    for path in GALLERY:
        scene = clrt.load(path)
        scale = SIDE / max(scene.render.size)
        width, height = (round(extent * scale) for extent in scene.render.size)
        scene = replace(scene, render=replace(scene.render, size=(width, height)))
        print(f"    {path.stem}", file=sys.stderr, flush=True)
        reference = render_reference(scene, 8, step_spp=256)
        for asked, found in ratios.items():
            told = []
            for seed in range(SEEDS):
                renderer = Renderer(scene, seed=seed)
                for state in renderer.passes(error=asked):
                    pass
                error = (relmse(state.pixels, reference.pixels) or 0.0) - reference.relmse
                found.append(sqrt(max(0.0, error)) / asked)
                told.append(f"{state.spp}: {found[-1]:.2f}")
            yield f"{path.stem:18}{asked:6}  " + "  ".join(told)
    for asked, found in ratios.items():
        within = sum(ratio <= RIGHT for ratio in found)
        yield f"asked {asked}: {within} of {len(found)} have {RIGHT} times that at most; worst {max(found):.2f}"
