"""Gallery scenes at a small size, with references that estimate their own noise."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import clrt
from clrt.bench.convergence.reference import Reference, render_reference
from clrt.output.image_error import relmse
from clrt.rendering.film.state import State

from .renders import GALLERY

#: Pixels along the longer side.
SIDE = 256
STEPS, STEP_SPP = 8, 256


def small(path: Path, side: int = SIDE) -> clrt.Scene:
    """Return the scene with `side` pixels along the longer side."""
    scene = clrt.load(path)
    width, height = (round(extent * side / max(scene.render.size)) for extent in scene.render.size)
    return replace(scene, render=replace(scene.render, size=(width, height)))


def with_references() -> Iterator[tuple[Path, clrt.Scene, Reference]]:
    """Yield each scene with its reference of 2048 samples per pixel, which is cached."""
    for path in GALLERY:
        scene = small(path)
        print(f"    {path.stem}", file=sys.stderr, flush=True)
        yield path, scene, render_reference(scene, STEPS, step_spp=STEP_SPP)


def true_relmse(state: State, reference: Reference) -> float:
    """Return the relMSE of the state's image, minus the reference's own."""
    return max(0.0, (relmse(state.pixels, reference.pixels) or 0.0) - reference.relmse)
