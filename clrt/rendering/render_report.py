"""Report of a render, as the JSON object of `--report`."""

from __future__ import annotations

from typing import Any

from ..scene.cryptomatte import NAMES, manifest_of
from .checkpoint.identity import scene_hash, values_of
from .compile.features import biased_by
from .renderer import Renderer, State


def render_report(renderer: Renderer, state: State) -> dict[str, Any]:
    """Return the report's fields, as listed in docs/report.md. `state` is the last one."""
    settings = renderer.settings
    width, height = settings.size
    samples = state.film.samples
    seconds = renderer.seconds or float("nan")
    return {
        "scene": renderer.scene.name,
        "scene_hash": scene_hash(renderer.scene),
        "version": _version(),
        "device": renderer.name,
        "width": width,
        "height": height,
        "spp": state.spp,
        "view": renderer.scene.display.view,
        **{name: value for name, value in values_of(settings, renderer.choices).items() if name != "size"},
        "seconds": renderer.seconds,
        **({"training_seconds": renderer.training_seconds} if renderer.training_seconds else {}),
        "samples": samples,
        "samples_per_second": samples / seconds,
        "rays": state.film.rays,
        "rays_per_second": state.film.rays / seconds,
        "stop_reason": renderer.stop_reason,
        "noise": state.noise,
        "nonfinite_samples": state.film.nonfinite_samples,
        "biased_by": (biases := biased_by(settings)),
        "warnings": renderer.warnings.of(state.film),
        **({"clamped_part": state.film.clamped_part} if biases else {}),
        **({"cryptomatte": found} if (found := _manifests(renderer)) else {}),
        **renderer.session.machine(renderer.devices),
        "history": renderer.history,
        **({} if state.tile_noise is None else {"tile_noise": state.tile_noise}),
        **({} if state.relmse is None else {"relmse": state.relmse, "noise_ratio": state.noise_ratio}),
    }


def _manifests(renderer: Renderer) -> dict[str, dict[str, str]]:
    """Return the manifest of each Cryptomatte layer among the AOVs."""
    return {name: manifest_of(renderer.scene, name) for name in renderer.first_hits if name in NAMES}


def _version() -> str:
    from importlib.metadata import version

    return version("clrt")
