"""Contestants of `clrt bench converge`: configurations of the renderer, and other renderers."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import UsageError
from ...rendering.renderer import Renderer
from ...scene.model import Scene

#: Configurations by name, as keywords of Renderer; the first is the baseline of the others.
CHOICES: dict[str, dict[str, Any]] = {
    "clrt": {},
    "clrt, stratified": {"sampler": "stratified"},
    "clrt, independent": {"sampler": "independent"},
    "clrt, lanes 1": {"lanes": 1},
    "clrt, bvh2": {"layout": "bvh2"},
}
#: Configurations compared only on request. unplanned: without known `spp`, as with --time or --error.
MORE_CHOICES: dict[str, dict[str, Any]] = {
    "clrt, adaptive": {"adaptive": True},
    "clrt, guided": {"guiding": "on"},
    "clrt, lanes 8": {"lanes": 8},
    "clrt, lanes 16": {"lanes": 16},
    "clrt, paths in lanes": {"paths": "lanes"},
    "clrt, unplanned": {"spp": None},
}
#: Other renderers: pip package, and the module of this package with their `contestants(scene, file)`.
PEERS = {"mitsuba": "mitsuba_renderer", "bpy": "cycles_renderer"}


class Picture(NamedTuple):
    """A rendered image. pixels: (h, w, 3) float32; seconds, cpu_seconds (of all cores): rendering time, excluding
    loading and compilation. noise: √relMSE as estimated by the renderer, or None."""

    spp: int
    seconds: float
    cpu_seconds: float
    pixels: NDArray[np.float32]
    noise: float | None = None


#: Renders an image with a number of samples per pixel (or slightly more) and a seed.
Contestant = Callable[[int, int], Picture]


def choices_on(
    scene: Scene, devices: Sequence[int], choices: Mapping[str, Mapping[str, Any]] = CHOICES
) -> dict[str, Contestant]:
    """Return the renderer with each of `choices` on each device, whose index is in the names if there are several."""
    return {
        f"{name} (device {index})" if len(devices) > 1 else name: partial(_render, scene, index, options)
        for index in devices
        for name, options in choices.items()
    }


def peers_of(scene: Scene, file: Path | None = None) -> tuple[dict[str, Contestant], dict[str, str]]:
    """Return the contestants of all PEERS, and why a peer has none: not installed, or an unsupported scene.

    file: the scene's, which a peer reads itself if it is in its own format.
    """
    found: dict[str, Contestant] = {}
    missing = {}
    for package, module in PEERS.items():
        try:
            found |= import_module(f"..renderers.{module}", __package__).contestants(scene, file)
        except ImportError:
            missing[package] = f"not installed (pip install {package})"
        except UsageError as error:
            missing[package] = str(error)
    return found, missing


def _render(scene: Scene, device: int, options: Mapping[str, Any], spp: int, seed: int) -> Picture:
    """Render an image, timing only the samples, not the states made at powers of two of the samples.

    The states update the error estimate. Adaptive sampling depends on them, so there they are included in the time. So
    is the training of guided paths.
    """
    renderer = Renderer(scene, device=device, **{"spp": spp, "seed": seed, **options})
    seconds, cpu_seconds = renderer.training_seconds, renderer.training_cpu_seconds
    for work in (
        [partial(_passes, renderer, spp)]
        if renderer.settings.adaptive
        else [partial(_even_samples, renderer, end) for end in [*(1 << k for k in range((spp - 1).bit_length())), spp]]
    ):
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
