"""Renders what is asked for, one after another: what belongs to the thread that works."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..device.heap import give_back
from ..device.open import Device, open_devices
from ..output.denoise import Denoiser
from ..rendering.guides import render_guides
from ..rendering.renderer import Renderer, State
from ..scene.model import Scene
from .pace import Pace
from .picks import Thing
from .settings import Selector, Settings


#: The part of the time that denoising may take before all samples are there.
DENOISING = 0.25


class Asked(NamedTuple):
    """What is to be seen. number: of the edit or choice; moving: more like it will follow at once."""

    number: int
    scene: Scene
    settings: Settings
    moving: bool

    @property
    def size(self) -> tuple[int, int]:
        """Of the whole picture, (width, height)."""
        return self.settings.size_of(self.scene.render.size)


class Superseded(Exception):
    """Something else was asked for meanwhile."""


class LiveRenderer:
    """Keeps what the next picture can use of the last one.

    on_phase: hears what begins, and raises Superseded where that has become useless.
    """

    def __init__(self, on_phase: Callable[[str], None]) -> None:
        self._on_phase = on_phase
        self._devices: list[Device] = []
        self._selector: object = self     # nobody's
        self._pace = Pace()
        self.renderer: Renderer | None = None
        #: How often another one was needed than before.
        self.programs = 0
        self._denoiser: Denoiser | None = None
        self._guides: dict[str, NDArray[np.float32]] = {}
        self._guided: Renderer | None = None    # whose guides these are
        self._denoise_from = 0.0
        self._met: NDArray[np.generic] = np.zeros((0, 0), np.int32)    # objects' numbers, pixel by pixel
        self._met_by: Renderer | None = None    # where these are seen

    def quick_size(self, asked: Asked) -> tuple[int, int]:
        """Of a picture that comes in time while things move; the whole one's where that does."""
        rate = asked.settings.frame_rate
        return self._pace.size(asked.size, asked.settings.samples, 1 / rate) if rate else asked.size

    def states(self, asked: Asked, size: tuple[int, int], spp: int) -> Iterator[State]:
        """The picture at more and more samples, up to `spp`."""
        start = time.perf_counter()
        self._guided = self._met_by = None
        self._open(asked.settings.device)
        last = self.renderer
        self.renderer = renderer = Renderer(asked.scene, device=self._devices, size=size, spp=spp,
                                            on_phase=self._on_phase, before=last, first_hits=True,
                                            **asked.settings.tracing)
        changed = not (last and last.session.scene.program is renderer.session.scene.program)
        self.programs += changed
        begun = time.perf_counter()
        self._on_phase("render")
        for first, state in enumerate(renderer.passes(spp=spp)):
            if first == 0:
                preparation = begun - start - renderer.session.build_seconds
                self._pace.note(size, state.spp, preparation, time.perf_counter() - begun)
                if changed:     # drivers compile at the first launch, some of them
                    give_back()
            yield state

    def _open(self, selector: Selector) -> None:
        if selector != self._selector or any(device.shared.worn for device in self._devices):
            self._selector, self._devices, self.renderer = self, [], None
            self._devices, self._selector = open_devices(selector), selector

    def denoised(self, state: State) -> NDArray[np.float32] | None:
        """The state's pixels denoised; None while that would take more of the time than DENOISING."""
        renderer, now = self.renderer, time.perf_counter()
        if renderer is None or now < self._denoise_from and not renderer.stop_reason:
            return None
        self._denoiser = self._denoiser or Denoiser()
        if self._guided is not renderer:
            self._guides, self._guided = render_guides(renderer.session), renderer
        pixels = self._denoiser(state.pixels, self._guides["albedo"], self._guides["normal"])
        done = time.perf_counter()
        self._denoise_from = done + (done - now) / DENOISING
        return pixels

    def seen_at(self, x: float, y: float) -> Thing | None:
        """What is seen first there (see `Picks`), in the middle of a pixel."""
        renderer = self.renderer
        if renderer is None:
            return None
        if self._met_by is not renderer:
            self._met = renderer.session.first_hits(renderer.scene, ["object"])["object"]
            self._met_by = renderer
        row, column = (min(max(int(at * size), 0), size - 1) for at, size in zip((y, x), self._met.shape))
        number, scene = int(self._met[row, column]), renderer.scene
        things: list[Thing] = [*scene.meshes, *scene.instances, *scene.spheres]
        return None if number < 0 else things[number]

    def abandon(self) -> None:
        """Has `states` end soon; for any thread."""
        if (renderer := self.renderer) is not None:
            renderer.abandon()
