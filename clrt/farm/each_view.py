"""Views of one scene from many cameras, each rendered by one worker."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from ..rendering.renderer_options import RendererOptions
from ..scene.model import Camera, Scene
from .cluster import connect
from .orders import PictureOrder, worker_selectors
from .whole_pictures import WholePictures


def each_view(
    scheduler: str, scene: Scene, cameras: Sequence[Camera], options: RendererOptions, lit: bool
) -> Iterator[dict[str, Any]]:
    """Yield the results of `band_renderer.render` for each camera in order, from the workers of a scheduler.

    lit: whether the images' samples are needed, not only their first hits. Raises DeviceError if the scheduler does not
    answer, an image was given up, or no worker is left, and UsageError for opened devices.
    """
    devices = worker_selectors(options.get("device"))
    others = {name: value for name, value in options.items() if name != "spp"}
    order = PictureOrder(scene, {**others, "device": devices or None}, options.get("spp"), lit=lit)
    numbers = {f"view {number}": number for number in range(len(cameras))}
    early: dict[int, dict[str, Any]] = {}
    expected = 0
    with connect(scheduler) as cluster:
        views = WholePictures(
            cluster, list(numbers), lambda name: replace(order, camera=cameras[numbers[name]]), devices
        )
        for name, found in filter(None, views.results()):
            early[numbers[name]] = found
            while expected in early:
                yield early.pop(expected)
                expected += 1
