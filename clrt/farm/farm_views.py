"""Views of a scene from many cameras, each rendered by one worker."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

from numpy.typing import NDArray

from ..rendering.compile.visible_parts import same_world
from ..rendering.renderer_options import RendererOptions
from ..scene.model import Scene
from .cluster import connect
from .orders import PictureOrder, worker_selectors
from .whole_pictures import WholePictures


def farm_views(
    scheduler: str, scenes: Iterable[Scene], options: RendererOptions, lit: bool
) -> Iterator[dict[str, NDArray[Any]]]:
    """Yield the AOVs of each scene, and "rgb" and "alpha" if `lit`, in order, from the workers of a scheduler.

    Workers keep the BVHs of a scene that differs from the one before by its camera alone. Raises DeviceError if the
    scheduler does not answer, an image was given up, or no worker is left, and UsageError for opened devices.
    """
    devices, views = worker_selectors(options.get("device")), {f"view {i}": scene for i, scene in enumerate(scenes)}
    others = {name: value for name, value in options.items() if name != "spp"}

    def order_of(name: str) -> PictureOrder:
        view, first = views[name], views["view 0"]
        common = PictureOrder(first, {**others, "device": devices or None}, options.get("spp"), lit=lit)
        return replace(common, camera=view.camera) if same_world(view, first) else replace(common, scene=view)

    early: dict[str, dict[str, Any]] = {}
    waiting = iter(views)
    expected = next(waiting, None)
    with connect(scheduler) as cluster:
        for name, found in filter(None, WholePictures(cluster, list(views), order_of, devices).results()):
            early[name] = found
            while expected in early:
                yield _layers(early.pop(expected))
                expected = next(waiting, None)


def _layers(found: dict[str, Any]) -> dict[str, NDArray[Any]]:
    """Return the layers in a result of `band_renderer.render`."""
    alpha = {} if found.get("alpha") is None else {"alpha": found["alpha"]}
    return {**found["aovs"], "rgb": found["pixels"], **alpha}
