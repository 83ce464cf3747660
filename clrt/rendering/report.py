"""What a render did, as the JSON object of `--report`."""

from __future__ import annotations

from typing import Any

from ..device.open import name_of
from .identity import scene_hash
from .renderer import Renderer, State


def render_report(renderer: Renderer, state: State) -> dict[str, Any]:
    """The report's fields, as listed in docs/report.md. `state` is the last one."""
    compiled, session = renderer.compiled, renderer.session
    infos = [device.info for device in renderer.devices]
    (width, height), settings = session.size, renderer.settings
    samples = state.film.samples
    seconds = renderer.seconds or float("nan")
    return {
        "scene": renderer.scene.name, "scene_hash": scene_hash(renderer.scene), "version": _version(),
        "device": name_of(renderer.devices), "platform": " + ".join(dict.fromkeys(info.platform for info in infos)),
        "driver": " + ".join(dict.fromkeys(info.driver for info in infos)),
        "width": width, "height": height, "spp": state.spp,
        "max_depth": settings.max_depth, "seed": settings.seed, "integrator": settings.integrator,
        "shadows": settings.shadows, "sampler": settings.sampler, "filter": settings.filter,
        "adaptive": settings.adaptive,
        "seconds": renderer.seconds,
        "samples": samples, "samples_per_second": samples / seconds,
        "rays": state.film.rays, "rays_per_second": state.film.rays / seconds,
        "stop_reason": renderer.stop_reason, "noise": state.noise, "nonfinite_samples": state.film.nonfinite_samples,
        "bvh": tree_report(renderer),
        "kernel": {"build_seconds": session.build_seconds, "cached": session.cached,
                   "features": compiled.features, "longest_launch_seconds": session.longest_launch},
        "peak_device_bytes": session.device_bytes, "history": renderer.history,
        **({"devices": session.shares()} if len(infos) > 1 else {}),
        **({} if state.tile_noise is None else {"tile_noise": state.tile_noise}),
        **({} if state.relmse is None else {"relmse": state.relmse, "noise_ratio": state.noise_ratio}),
    }


def tree_report(renderer: Renderer) -> dict[str, Any]:
    """The tree's part of the report."""
    tree, counts = renderer.compiled.tree, renderer.compiled.counts[0]
    return {"triangles": int(counts["triangles"]), "spheres": int(counts["spheres"]),
            "instances": renderer.compiled.instances, "nodes": tree.nodes,
            "bytes": tree.bytes, "build_seconds": tree.build_seconds, "sah_cost": tree.sah_cost,
            "layout": tree.name, "builder": tree.builder, "depth": tree.depth}


def _version() -> str:
    from importlib.metadata import version

    return version("clrt")
