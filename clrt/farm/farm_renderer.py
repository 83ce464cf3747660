"""A renderer on the devices of a cluster's workers; the client needs none."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Unpack, cast

import numpy as np
from numpy.typing import NDArray

from ..device.open import Selectors
from ..errors import DeviceError
from ..rendering.accumulation.scene_on_device import SceneOnDevice
from ..rendering.compile.film_record import film_pixel
from ..rendering.render_warnings import PictureWarnings
from ..rendering.renderer import Renderer, State
from ..rendering.renderer_options import RendererOptions
from ..scene.model import Camera, Scene
from ..scene.validation.validate import validate
from .cluster import Cluster
from .farm_picture import FarmAccumulation
from .orders import Order, worker_selectors

#: Device name in a checkpoint before the workers are known.
FARM = "a farm"


class FarmRenderer(Renderer):
    """Renderer of a scene on a cluster. It is used like `Renderer`; `device` selects among each worker's devices.

    simulated: samples per second of workers that only sleep, to measure the overhead (simulated_workers.py).
    """

    def __init__(
        self, scene: Scene, cluster: Cluster, *, simulated: float | None = None, **options: Unpack[RendererOptions]
    ) -> None:
        self._cluster, self._simulated = cluster, simulated
        super().__init__(scene, **options)

    def passes(
        self,
        *,
        spp: int | None = None,
        time: float | None = None,
        error: float | None = None,
        reference: NDArray[np.float32] | None = None,
    ) -> Iterator[State]:
        """See `Renderer.passes`. If the cluster fails, the samples so far are kept in the checkpoint."""
        try:
            yield from super().passes(spp=spp, time=time, error=error, reference=reference)
        except DeviceError:
            self._progress.save(last=True)
            if self._checkpoints is not None:
                self._checkpoints.wait()
            raise

    def _open(self, device: Selectors, on_phase: Callable[[str], None], before: Renderer | None) -> None:
        validate(self.scene)
        self.devices, self._selectors = [], worker_selectors(device)

    def _make_picture(self, before: Sequence[SceneOnDevice] = ()) -> FarmAccumulation:
        order = Order(self.scene, self.choices, self._planned_spp, self._selectors, self._simulated)
        picture = FarmAccumulation(self._cluster, order, film_pixel(self.scene, self.choices))
        facts = picture.dispatch.wait_for()[0].facts or {}
        self.warnings = PictureWarnings(self.scene, facts["report"]["kernel"]["features"])
        return picture

    def _turn_to(self, camera: Camera) -> None:
        """Start a new image. Many images are better rendered by one worker each (whole_pictures.py)."""
        self._show(replace(self.scene, camera=camera))

    def _show(self, scene: Scene) -> None:
        validate(scene)
        self.scene = scene
        self._progress.session = self._new_picture()

    @property
    def session(self) -> FarmAccumulation:
        """The samples of the image, on this client."""
        return cast(FarmAccumulation, super().session)

    @property
    def name(self) -> str:
        """Return the names of all devices that render."""
        return (self.session.told("name") if hasattr(self, "_progress") else "") or FARM
