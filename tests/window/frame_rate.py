"""Measures how smoothly the camera moves through a scene. On an idle machine with a display (or Xvfb's):

python -c "from tests.window.frame_rate import main; main('scenes/spheres.toml')"
"""

from __future__ import annotations

import json
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from imgui_bundle import imgui

from clrt.formats.load_scene import load
from clrt.live.settings import Settings
from clrt.live.snapshot import Snapshot

from .driver import Driver, drive


def main(scene: str, seconds: float = 10.0, frame_rate: float = 20.0) -> dict[str, Any]:
    """Print and return, for a camera movement of `seconds`: latency from a key press to a changed image in ms; images
    and window frames per second; median width and height of the images; and the scene's size."""
    figures: dict[str, Any] = {}

    def test(window: Driver) -> None:
        window.rest()
        window.panel("Picture")
        window.context.yield_(30)  # let the window come to rest, too
        figures.update(_walk(window, seconds))

    content = load(Path(scene))
    content.render = replace(content.render, spp=4)
    with tempfile.TemporaryDirectory() as folder:
        drive(content, test, Path(folder), Settings(frame_rate=frame_rate))
    figures["size"] = content.render.size
    print(json.dumps(figures))
    return figures


def _walk(window: Driver, seconds: float) -> dict[str, Any]:
    """Press S and W alternately for half a second each, so that the scene stays in view."""
    seen: dict[int, Snapshot] = {}
    latencies: list[float] = []
    frames, start = 0, time.perf_counter()
    while time.perf_counter() < start + seconds:
        key = imgui.Key.s if len(latencies) % 2 else imgui.Key.w
        before, pressed, answered = window.live.asked, time.perf_counter(), False
        window.context.key_down(key)
        while time.perf_counter() < pressed + 0.5 or not answered:
            window.context.yield_()
            frames += 1
            shown = window.app.viewport.shown
            assert shown is not None
            seen[shown.snapshot.number] = shown.snapshot
            if not answered and shown.snapshot.asked > before:
                answered = True
                latencies.append(1000 * (time.perf_counter() - pressed))
        window.context.key_up(key)
    took = time.perf_counter() - start
    sizes = np.median([snapshot.pixels.shape[1::-1] for snapshot in seen.values()], axis=0)
    return {
        "latency_ms": round(float(np.median(latencies)), 1),
        "worst_latency_ms": round(max(latencies), 1),
        "pictures_per_second": round(len(seen) / took, 1),
        "frames_per_second": round(frames / took, 1),
        "median_size": sizes.tolist(),
    }
