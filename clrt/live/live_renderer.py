"""Renderer of successive requests, used only by the rendering thread."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..device.malloc_trim import give_back
from ..device.open import Device, open_devices
from ..output.denoise import Denoiser, denoised_layers
from ..rendering.accumulation.denoiser_guides import render_guides
from ..rendering.renderer import Renderer, State
from ..scene.model import Scene
from ..scene.numbered_objects import objects_of
from .image_sizing import ImageSizing
from .picks import Thing
from .settings import Selector, Settings

#: Maximum fraction of the time spent on denoising before all samples are rendered.
DENOISING = 0.25


class ImageRequest(NamedTuple):
    """Request of an image. number: of the edit or choice; moving: more requests of its kind follow immediately."""

    number: int
    scene: Scene
    settings: Settings
    moving: bool

    @property
    def size(self) -> tuple[int, int]:
        """Full size of the image, (width, height)."""
        return self.settings.size_of(self.scene.render.size)


class Superseded(Exception):
    """Raised if there is a newer request."""


class LiveRenderer:
    """Renderer that keeps what the next image can reuse from the last one.

    on_phase: called as each phase begins; raises Superseded if that is no longer needed.
    """

    def __init__(self, on_phase: Callable[[str], None]) -> None:
        self._on_phase = on_phase
        self._devices: list[Device] = []
        self._selector: object = self  # equal to no selector
        self._pace = ImageSizing()
        self.renderer: Renderer | None = None
        #: Number of program changes.
        self.programs = 0
        self._denoiser: Denoiser | None = None
        self._guides: dict[str, NDArray[np.float32]] = {}
        self._guided: Renderer | None = None  # renderer of these guides
        self._denoise_from = 0.0
        self._hit_objects: NDArray[np.generic] = np.zeros((0, 0), np.int32)  # object numbers per pixel
        self._hit_objects_of: Renderer | None = None  # renderer of these numbers

    def quick_size(self, asked: ImageRequest) -> tuple[int, int]:
        """Return the image size that meets the target frame rate during movements; the full size if that does."""
        rate = asked.settings.frame_rate
        return self._pace.size(asked.size, asked.settings.samples, 1 / rate) if rate else asked.size

    def states(self, asked: ImageRequest, size: tuple[int, int], spp: int) -> Iterator[State]:
        """Yield the image's states with increasing sample counts, up to `spp`."""
        start = time.perf_counter()
        self._guided = self._hit_objects_of = None
        self._open(asked.settings.device)
        last = self.renderer
        self.renderer = renderer = Renderer(
            asked.scene,
            device=self._devices,
            size=size,
            spp=spp,
            on_phase=self._on_phase,
            before=last,
            first_hits=True,
            **asked.settings.tracing,
        )
        changed = not (last and last.session.scene.program is renderer.session.scene.program)
        self.programs += changed
        begun = time.perf_counter()
        self._on_phase("render")
        for first, state in enumerate(renderer.passes(spp=spp)):
            if first == 0:
                preparation = begun - start - renderer.session.build_seconds
                self._pace.note(size, state.spp, preparation, time.perf_counter() - begun)
                if changed:  # some drivers compile at the first launch
                    give_back()
            yield state

    def _open(self, selector: Selector) -> None:
        if selector != self._selector or any(device.shared.worn for device in self._devices):
            self._selector, self._devices, self.renderer = self, [], None
            self._devices, self._selector = open_devices(selector), selector

    def denoised(self, state: State) -> NDArray[np.float32] | None:
        """Return the state's denoised pixels; None as long as that would exceed the fraction DENOISING of the time."""
        renderer, now = self.renderer, time.perf_counter()
        if renderer is None or now < self._denoise_from and not renderer.stop_reason:
            return None
        self._denoiser = self._denoiser or Denoiser()
        if self._guided is not renderer:
            self._guides, self._guided = render_guides(renderer.session), renderer
        layers = state.pixels, state.alpha, state.film.backdrop
        pixels, _ = denoised_layers(*layers, self._denoiser, self._guides)
        done = time.perf_counter()
        self._denoise_from = done + (done - now) / DENOISING
        return pixels

    def seen_at(self, x: float, y: float) -> Thing | None:
        """Return the first hit at a position (see `PickRequests`), at a pixel's center."""
        renderer = self.renderer
        if renderer is None:
            return None
        if self._hit_objects_of is not renderer:
            self._hit_objects = renderer.session.first_hits(renderer.scene, ["object"])["object"]
            self._hit_objects_of = renderer
        row, column = (min(max(int(at * size), 0), size - 1) for at, size in zip((y, x), self._hit_objects.shape))
        number, objects = int(self._hit_objects[row, column]), objects_of(renderer.given)
        return objects[number] if 0 <= number < len(objects) else None  # the ground is not one of them

    def abandon(self) -> None:
        """Make `states` end soon; thread-safe."""
        if (renderer := self.renderer) is not None:
            renderer.abandon()
