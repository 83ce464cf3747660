"""Renders with checkpoints, and whether two are the same."""

from __future__ import annotations

from typing import Any

from clrt.device.open import Device
from clrt.rendering.renderer import Renderer, State
from clrt.scene.model import Scene

from .test_noise import room

SIZE = (61, 44)


def renderer(device: Device, scene: Scene | None = None, **options: Any) -> Renderer:
    """At SIZE, with checkpoints as often as their cost allows, if there are any."""
    given = {"size": SIZE, "seed": 1, "spp": 24, "checkpoint_seconds": 0.0, **options}
    return Renderer(scene or room(), device=device.info.index, **given)


def run(running: Renderer, **stops: float) -> State:
    """Where it ends with these stop conditions."""
    return list(running.passes(**stops))[-1]  # type: ignore[arg-type]


def same(a: Renderer, b: Renderer) -> bool:
    """Whether film, samples, estimate and what the history says of powers of two are the same bit for bit."""
    histories = [{entry["spp"]: entry["noise"] for entry in r.history if entry["spp"] & (entry["spp"] - 1) == 0}
                 for r in (a, b)]
    films = [(r.session.film().pixels, r.session.tile_samples, *r._convergence.noise.arrays()) for r in (a, b)]
    return histories[0] == histories[1] and all(x.tobytes() == y.tobytes() for x, y in zip(*films))
