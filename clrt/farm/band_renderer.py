"""Render whole images, or bands of large ones, on a worker."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..api import image_of
from ..output.denoise import Denoiser, denoised
from ..rendering.accumulation.accumulation import Accumulation
from ..rendering.accumulation.device_pool import DevicePool
from ..rendering.accumulation.launch_plan import LaunchPlan
from ..rendering.accumulation.multi_device import MultiDeviceAccumulation, make_pool
from ..rendering.accumulation.scene_on_device import SceneOnDevice
from ..rendering.film.tiles import TILE, tiles_of
from ..rendering.guiding.training import guided
from ..rendering.renderer import Renderer
from ..rendering.stop_conditions import planned_spp
from .orders import PictureOrder

#: The renderer of the last order: frames and bands of one scene share its BVH and program.
_kept: dict[str, Renderer] = {}


class BandRenderer(Renderer):
    """Renderer of some tile rows of an image, as if they were all of it: the size in pixels is the session's."""

    _pool: DevicePool | None = None
    _band = (0, 1)

    def begin_band(self, band: tuple[int, int]) -> None:
        """Start with tile rows first … end − 1."""
        self._band = band
        self._progress.session = self._new_picture()
        self._begin()

    def _make_picture(self, before: Sequence[SceneOnDevice] = ()) -> Accumulation:
        plan, (first, end) = LaunchPlan.of(self.settings, self._planned_spp), self._band
        (width, height), columns = plan.size, tiles_of(plan.size)[1]
        self._pool = self._pool or make_pool(self.devices, guided(self.devices, self._compiled, plan), plan)
        return MultiDeviceAccumulation(self._pool, (width, min(end * TILE, height) - first * TILE), first * columns)


def render(key: str, order: PictureOrder) -> dict[str, Any]:
    """Return the image's pixels, report, and so on, as the fields of `Image`.

    key: identifies all of the order except camera and band. Raises ClrtErrors.
    """
    denoiser = Denoiser() if order.denoise else None
    renderer = _renderer(key, order)
    guides = renderer.session.guides() if denoiser else {}
    state = None
    if order.lit:
        for state in renderer.passes(spp=order.spp, time=order.time, error=order.error):
            pass
    image = image_of(renderer, state or renderer.state())
    if denoiser is not None:
        image = denoised(image, denoiser, guides)
    found = {"pixels": np.ascontiguousarray(image.pixels), "report": image.report, "raw": image.raw, "aovs": image.aovs}
    return found if image.backdrop is not None else {**found, "alpha": image.alpha}


def _renderer(key: str, order: PictureOrder) -> Renderer:
    """Return a renderer that starts with the order's image."""
    if key not in _kept:
        _kept.clear()
        planned = planned_spp(order.scene.render, order.spp, order.time, order.error)
        kind = Renderer if order.band is None else BandRenderer
        _kept[key] = kind(order.scene, spp=planned, **order.options)
    renderer = _kept[key]
    if isinstance(renderer, BandRenderer) and order.band is not None:
        renderer.begin_band(order.band)
    else:
        renderer.look(order.camera or order.scene.camera)
    return renderer
