"""What `clrt bench converge` compares: the renderer by its choices, and other renderers."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import UsageError
from ..rendering.renderer import Renderer
from ..scene.model import Scene

#: Choices of the renderer by name, for its keywords; the first is what the others are compared with.
CHOICES: dict[str, dict[str, Any]] = {
    "clrt": {}, "clrt, stratified": {"sampler": "stratified"}, "clrt, independent": {"sampler": "independent"},
    "clrt, lanes 1": {"lanes": 1}, "clrt, bvh2": {"layout": "bvh2"}}
#: Those that are compared only if asked for; unplanned: as with --time or --error, when no `spp` is known.
MORE_CHOICES: dict[str, dict[str, Any]] = {
    "clrt, adaptive": {"adaptive": True}, "clrt, lanes 8": {"lanes": 8}, "clrt, lanes 16": {"lanes": 16},
    "clrt, paths in lanes": {"paths": "lanes"}, "clrt, unplanned": {"spp": None}}
#: Other renderers: what pip calls them, and the module beside this one whose `contestants(scene)` they are.
PEERS = {"mitsuba": "mitsuba_renderer", "bpy": "cycles_renderer"}


class Picture(NamedTuple):
    """pixels: (h, w, 3) float32 of so many samples; seconds, cpu_seconds (of all cores): what they took once all was
    loaded and compiled. noise: √relMSE as the renderer tells it, where it does."""

    spp: int
    seconds: float
    cpu_seconds: float
    pixels: NDArray[np.float32]
    noise: float | None = None


#: Renders a picture with so many samples a pixel, or few more, and a seed.
Contestant = Callable[[int, int], Picture]


def choices_on(scene: Scene, devices: Sequence[int],
               choices: Mapping[str, Mapping[str, Any]] = CHOICES) -> dict[str, Contestant]:
    """The renderer with each of `choices` on each device, named with the device's number where there are several."""
    return {f"{name} (device {index})" if len(devices) > 1 else name: partial(_render, scene, index, options)
            for index in devices for name, options in choices.items()}


def peers_of(scene: Scene) -> tuple[dict[str, Contestant], dict[str, str]]:
    """The contestants of all PEERS, and why a peer has none: it is not installed, or cannot draw the scene."""
    found: dict[str, Contestant] = {}
    missing = {}
    for package, module in PEERS.items():
        try:
            found |= import_module(f".{module}", __package__).contestants(scene)
        except ImportError:
            missing[package] = f"not installed (pip install {package})"
        except UsageError as error:
            missing[package] = str(error)
    return found, missing


def _render(scene: Scene, device: int, options: Mapping[str, Any], spp: int, seed: int) -> Picture:
    """The clock stands still while states are made: at powers of two of the samples, for the noise that they tell.

    Adaptive sampling needs the states, so there it runs.
    """
    renderer = Renderer(scene, device=device, **{"spp": spp, "seed": seed, **options})
    seconds, cpu_seconds = 0.0, 0.0
    for work in [partial(_passes, renderer, spp)] if renderer.settings.adaptive else [
            partial(_even_samples, renderer, end) for end in [*(1 << k for k in range((spp - 1).bit_length())), spp]]:
        start, cpu = time.perf_counter(), time.process_time()
        work()
        renderer.session.wait()
        seconds += time.perf_counter() - start
        cpu_seconds += time.process_time() - cpu
        state = renderer.state()
    return Picture(spp, seconds, cpu_seconds, state.pixels, state.noise)


def _passes(renderer: Renderer, spp: int) -> None:
    for _ in renderer.passes(spp=spp):
        pass


def _even_samples(renderer: Renderer, spp: int) -> None:
    session = renderer.session
    while session.samples_done < spp:
        for _ in session.render(min(spp - session.samples_done, session.pass_limit())):
            pass
