"""Helpers that render with checkpoints and compare two renders."""

from __future__ import annotations

from typing import Any

from clrt.device.open import Device
from clrt.rendering.renderer import Renderer, State
from clrt.scene.model import Scene

from .test_noise import room

SIZE = (61, 44)


def renderer(device: Device, scene: Scene | None = None, **options: Any) -> Renderer:
    """Return a renderer at SIZE that, if given a checkpoint, writes it as often as the cost limit allows."""
    given = {"size": SIZE, "seed": 1, "spp": 24, "checkpoint_seconds": 0.0, **options}
    return Renderer(scene or room(), device=device.info.index, **given)


def run(running: Renderer, **stops: float) -> State:
    """Render until these stop conditions hold and return the last state."""
    return list(running.passes(**stops))[-1]  # type: ignore[arg-type]


def same(a: Renderer, b: Renderer) -> bool:
    """Return whether film, sample counts, estimate and the history at powers of two are equal bit for bit."""
    histories = [
        {entry["spp"]: entry["noise"] for entry in r.history if entry["spp"] & (entry["spp"] - 1) == 0} for r in (a, b)
    ]
    films = [(r.session.film().pixels, r.session.tile_samples, *r._progress.convergence.noise.arrays()) for r in (a, b)]
    return histories[0] == histories[1] and all(x.tobytes() == y.tobytes() for x, y in zip(*films))
