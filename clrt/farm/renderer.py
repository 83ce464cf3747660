"""A renderer whose devices are those of a cluster's workers; the machine that it runs on needs none."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import DeviceError
from ..rendering.aovs import seen_first
from ..rendering.features import warn_of_darkness
from ..rendering.renderer import Renderer, State
from ..scene.model import Camera, Scene
from ..scene.validate import validate
from .cluster import Cluster
from .orders import Order
from .picture import FarmPicture

#: What a checkpoint calls those that rendered, before they are known.
FARM = "a farm"


class FarmRenderer(Renderer):
    """A scene on a cluster. What is said of `Renderer` holds; `device` is of each worker's devices.

    simulated: samples a second of workers that only sleep, to measure all the rest (simulated.py).
    """

    session: FarmPicture

    def __init__(self, scene: Scene, cluster: Cluster, *, simulated: float | None = None,
                 **options: Any) -> None:
        self._cluster, self._simulated = cluster, simulated
        super().__init__(scene, **options)

    def passes(self, *, spp: int | None = None, time: float | None = None, error: float | None = None,
               reference: NDArray[np.float32] | None = None) -> Iterator[State]:
        """See `Renderer.passes`. Where the cluster fails what is done is kept in the checkpoint."""
        try:
            yield from super().passes(spp=spp, time=time, error=error, reference=reference)
        except DeviceError:
            self._keep(last=True)
            if self._checkpoints is not None:
                self._checkpoints.wait()
            raise

    def _open(self, device: str | int | Sequence[str | int] | None, lanes: int | None,
              on_phase: Callable[[str], None]) -> None:
        validate(self.scene)
        selectors = () if device is None else (device,) if isinstance(device, str | int) else tuple(device)
        self.devices = []
        self._lanes, self._selectors = lanes, selectors

    def _make_picture(self) -> FarmPicture:
        order = Order(self.scene, self.choices, self._lanes, self._planned_spp, self._selectors,
                      self._simulated)
        picture = FarmPicture(self._cluster, order, self.choices.pixel)
        facts = picture.dispatch.wait_for()[0].facts or {}
        warn_of_darkness(self.scene, facts["report"]["kernel"]["features"])
        return picture

    def look(self, camera: Camera) -> None:
        """Begins another picture. Of many, each is better rendered by one worker (wholes.py)."""
        validate(Scene(camera=camera, render=self.settings))
        self.scene = replace(self.scene, camera=camera)
        self.session = self._make_picture()
        self._begin()

    @property
    def name(self) -> str:
        """Of all devices that render."""
        return self._told("name") or FARM

    def machine(self) -> dict[str, Any]:
        """What a report says of the workers; of what they built, what one of them did."""
        reports = [each.facts["report"] for each in self.session.dispatch.everyone() if each.facts]
        return {**reports[0], "platform": self._told("platform"), "driver": self._told("driver"),
                "moved_bytes": self.session.moved_bytes, "devices": self.session.shares()}

    def guides(self) -> dict[str, NDArray[np.float32]]:
        """See `render_guides`."""
        return self.session.drawn(None)

    def _seen_first(self) -> dict[str, NDArray[np.generic]]:
        seen = seen_first(self._aovs)
        return {**self.session.drawn(seen)} if seen else {}

    def _told(self, what: str) -> str:
        """What all workers said of themselves, each thing once."""
        if not hasattr(self, "session"):
            return ""
        return " + ".join(dict.fromkeys(str(each.facts[what]) for each in self.session.dispatch.everyone()
                                        if each.facts))
