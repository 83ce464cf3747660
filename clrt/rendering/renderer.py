"""Progressive rendering: passes over the whole picture until a stop condition is met, with noise and history."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..device.open import Selectors, name_of, open_devices
from ..awake import AwakeClock, watched_clock
from ..errors import DeviceError
from ..float_errors import with_default_errors
from ..scene.model import Camera, RenderSettings, Scene
from ..scene.validate import check_is_scene, validate
from ..threads import Event
from .accumulation import Accumulation
from .adaptive import most_planned
from .aovs import Aovs
from .camera import camera_file
from .checkpoint import check_of_none, open_checkpoints
from .choices import choices_on
from .compile import CompiledScene
from .compiler import Compiler
from .convergence import Convergence
from .crew import make_picture
from .film import Film
from .kept import Kept
from .on_device import SceneOnDevice
from .options import choices_of, settings_of
from .pace import Pace
from .picture_warnings import PictureWarnings
from .session import depth_of
from .state import State as State, check_reference
from .stops import Limits, check_stops, checked_percentile
from .turns import Turns


class Renderer:
    """A scene on a device, ready to render. Everything not given is taken from `scene.render`.

    device: see `clrt devices`, or one that is open; several render one picture together. size: (width, height);
    triangle, box, sphere: see `HitTests`; offset, builder, layout, tree, lanes, paths: see `choices.Choices`. spp: how
    many samples a pixel are planned: the sampler then makes neighbouring pixels' errors differ for that many, and later
    ones begin anew (kernels/sampler); `passes` ends there unless told otherwise. adaptive: whether tiles get samples by
    their error, from the pictures so far. on_phase hears "build" (packing, tree) and "compile" (program, upload) as
    they begin. checkpoint: a file that is kept up to date while rendering, about every `checkpoint_seconds` and at the
    end; resume: go on from it, with the `spp` planned then, unless there is none yet (docs/checkpoints.md).
    error_percentile: a wanted error is reached where so many per cent of the tiles of 8 x 8 pixels have it. before: one
    that is of no use any more; what it has on the devices is taken over as far as its scene is of the same objects,
    which must not have been changed in place. aovs: names of pictures made beside (docs/aovs.md). first_hits: whether
    its session will be asked for a denoiser's guides, or for what is seen first. Raises ClrtErrors of all kinds.
    """

    @with_default_errors
    def __init__(self, scene: Scene, *, device: Selectors = None, size: tuple[int, int] | None = None,
                 spp: int | None = None, max_depth: int | None = None, seed: int | None = None,
                 integrator: str | None = None, shadows: bool | None = None, sampler: str | None = None,
                 filter: str | None = None, adaptive: bool | None = None, back_face_culling: str | None = None,
                 clamp_direct: float | None = None, clamp_indirect: float | None = None, triangle: str = "watertight",
                 box: str = "robust", sphere: str = "robust", offset: str = "bound", builder: str | None = None,
                 layout: str | None = None, lanes: int | None = None, paths: str | None = None,
                 tree: bool | None = None, error_percentile: float | None = None,
                 on_phase: Callable[[str], None] = lambda phase: None, aovs: str | Iterable[str] = (),
                 checkpoint: str | Path | None = None, resume: bool = False, checkpoint_seconds: float = 30.0,
                 before: Renderer | None = None, first_hits: bool = False) -> None:
        check_is_scene(scene)
        check_stops(spp)
        options = dict(locals())
        self._percentile = checked_percentile(error_percentile)
        self.scene = replace(scene, render=settings_of(scene.render, options))
        self._aovs = Aovs(aovs, self.settings.integrator)
        self.choices = choices_of(options)
        self._open(device, lanes, on_phase, before)
        self._checkpoints, kept = open_checkpoints(checkpoint, resume, checkpoint_seconds, self.scene, self.choices,
                                                   self.name)
        on_phase("compile")
        self._planned_spp = kept.planned_spp if kept else most_planned(spp, self.settings.adaptive)
        self.session: Accumulation = self._make_picture(before.session.scenes if before else ())
        self._begin()
        self._interrupted, self._abandoned, self._turns = False, Event(), Turns()
        self._asked_for: Camera | None = None
        if kept:
            self._convergence.restore(kept)
            self.session.restore(kept.film, kept.work)
            self.seconds = kept.seconds
            self.state()

    def _open(self, device: Selectors, lanes: int | None, on_phase: Callable[[str], None],
              before: Renderer | None) -> None:
        """Opens the devices, and compiles the scene for them; without `lanes` with as many as suit each."""
        self.device, *_ = self.devices = open_devices(device)
        on_phase("build")
        self._compiler: Compiler = Compiler.after(before._compiler if before else None, self.devices)
        choices = [choices_on(each, self.choices, lanes) for each in self.devices]
        self._compiled = self._compiler.compile(self.scene, choices, ahead=len(choices) == 1)
        self.warnings = PictureWarnings(self.scene, self.compiled.features)

    def _make_picture(self, before: Sequence[SceneOnDevice] = ()) -> Accumulation:
        return make_picture(self.devices, self._compiled, self.settings.size, depth_of(self.settings),
                            self.settings.seed, self._planned_spp, before)

    @property
    def name(self) -> str:
        """Of all that render."""
        return name_of(self.devices)

    def _begin(self) -> None:
        """A picture without any samples."""
        self._convergence = Convergence(self._planned_spp, self._percentile)
        self._aovs.begin(self.session, self.scene)
        self.stop_reason: str | None = None
        self.seconds = 0.0

    @property
    def history(self) -> list[dict[str, Any]]:
        """See `Convergence`."""
        return self._convergence.history

    @property
    def compiled(self) -> CompiledScene:
        """The scene as it was compiled for the first device."""
        return self._compiled[0]

    @property
    def settings(self) -> RenderSettings:
        """The scene's settings with what was given."""
        return self.scene.render

    def look(self, camera: Camera) -> None:
        """Begins another picture: the scene as this camera sees it, to the last bit as a new renderer would draw it.

        Tree and buffers stay; so does the program, unless a lens or another projection comes in. SceneError where the
        camera is wrong, UsageError where a checkpoint is kept, which is of one picture.
        """
        check_of_none(self._checkpoints)
        validate(Scene(camera=camera, render=self.settings))
        with self._turns.one():
            self._asked_for = camera
            self._see()

    def _see(self) -> None:
        """Turns to the camera asked for; whoever is next does where that was interrupted."""
        if self._asked_for is not None:
            self._turn_to(self._asked_for)
            self._begin()
            self._asked_for = None

    def _turn_to(self, camera: Camera) -> None:
        files, file = self.session.compiled.chosen_files["CAMERA"], camera_file(camera, self.settings.integrator)
        self.scene = replace(self.scene, camera=camera)
        self._compiled = [each.seen_by(camera, file) for each in self._compiled]
        if files == [file]:
            self.session.look(camera)
        else:
            self.session = self._make_picture()

    def passes(self, *, spp: int | None = None, time: float | None = None, error: float | None = None,
               reference: NDArray[np.float32] | None = None) -> Iterator[State]:
        """Renders, yielding a State at powers of two of the samples, from time to time between them, and at the end.

        It ends at `spp` samples a pixel, after `time` seconds or at a noise of `error` (√relMSE), whatever comes
        first; without any at the renderer's `spp`, or the scene's. Call it again to go on, in another thread, too. Left
        early (`break`, Ctrl-C) it writes a checkpoint, or else is a launch ahead. reference: (height, width, 3).
        """
        check_reference(reference, self.session.size)
        try:
            with watched_clock(self.seconds) as watch:
                limits = Limits.of(self.settings, spp, time, error)
                yield from self._turns.of(self._passes(limits, reference, watch))
        except (GeneratorExit, KeyboardInterrupt):
            self._keep_unfinished()
            raise
        finally:
            if self._checkpoints is not None:
                self._checkpoints.wait()

    def _passes(self, limits: Limits, reference: NDArray[np.float32] | None, watch: AwakeClock) -> Iterator[State]:
        self._see()
        self.session.mend()
        if self._catch_up(limits):
            yield self.state(reference)
        pace, begun = Pace(), None
        while self.stop_reason is None:
            launches, begun = begun or self._next_pass(limits), None
            self._run_pass(launches, limits, watch)
            if self._abandoned.is_set():
                return
            done = self.session.samples_done
            self.stop_reason = self.stop_reason or limits.reached(done, self.seconds)
            self._heed_interrupt()
            looks = limits.looks(done)
            due = pace.due or done & (done - 1) == 0 or looks or limits.adapts(done)
            if self.stop_reason is None and not due:
                continue
            self.session.wait()
            self.seconds = watch.seconds
            film, tile_samples = self.session.film(), self.session.tile_samples
            if self.stop_reason is None and not (looks or self.settings.adaptive or self._checkpoints):
                begun = self.session.advance_ahead(limits.room)    # runs while the state is made
            state = None if self._in_haste else self._convergence.record_if_wanted(
                film, tile_samples, self.seconds, reference,
                lambda: self._abandoned.is_set() or self._interrupted and self.stop_reason is None)
            if self._abandoned.is_set():
                return
            self._heed_interrupt()
            if state is None:
                self._keep(film, last=True)
                state = self._convergence.record(film, tile_samples, self.seconds, reference, in_haste=begun is None)
            else:
                if self.stop_reason is None and looks and limits.low_enough(state.stops_by):
                    self.stop_reason = "error"
                self._keep(film, last=self.stop_reason is not None)
            pace.made()
            before = self.stop_reason, self.session.samples_done
            yield state
            if (self.stop_reason, self.session.samples_done) != before:    # another call went on meanwhile
                watch.set(self.seconds)
                begun = None
                if self._catch_up(limits):
                    yield self.state(reference)

    def interrupt(self) -> None:
        """Has `passes` end after the launches in flight, with a state and a checkpoint; for signal handlers, too."""
        self._interrupted = True

    def abandon(self) -> None:
        """Has `passes` end after the launch that is being made, with nothing: nobody wants the picture any more."""
        self._abandoned.set()

    def state(self, reference: NDArray[np.float32] | None = None) -> State:
        """The picture as it is now, also in the middle of a pass that was interrupted."""
        with self._turns.one():
            self._see()
            film, tile_samples = self.session.film(), self.session.tile_samples
            return self._convergence.state(film, tile_samples, self.seconds, reference, self._in_haste)

    def aovs(self, state: State) -> dict[str, NDArray[np.generic]]:
        """The pictures beside the state's, by the names and in the order that they were asked for."""
        return self._aovs.of(state.film)

    def _catch_up(self, limits: Limits) -> bool:
        """Whether an earlier call, or the render this goes on with, came so far already; records what is new of it."""
        self._convergence.catch_up(self.session, self.seconds)
        done = self.session.samples_done
        self.stop_reason = limits.reached(done, self.seconds)
        looks = self.stop_reason is None and done and limits.looks(done) and not self.session.work.parts
        if looks and limits.low_enough(self.state().stops_by):
            self.stop_reason = "error"
        return self.stop_reason is not None

    def _next_pass(self, limits: Limits) -> Iterator[None]:
        """Over the whole picture; or one that doubles the samples of those tiles where that takes most error away,
        which ends the render where none are left."""
        if not limits.adapts(self.session.samples_done):
            return self.session.advance(limits.room)
        if not len(tiles := self._convergence.tiles_to_double(self.session.tile_samples, limits.spp)):
            self.stop_reason = "spp"
        return self.session.double(tiles)

    def _run_pass(self, launches: Iterator[None], limits: Limits, watch: AwakeClock) -> None:
        """One pass; sets the stop reason where `time` is over or it is interrupted, maybe inside the pass."""
        for _ in launches:
            self.seconds = watch.seconds
            self._heed_interrupt()
            if self._abandoned.is_set() or self._in_haste:
                return
            if limits.time_over(self.session.samples_done, self.seconds):
                self.stop_reason = "time"
                return
            if self.session.work.parts:
                self._keep()

    def _heed_interrupt(self) -> None:
        if self.stop_reason is None and self._interrupted:
            self.stop_reason, self._interrupted = "interrupted", False

    @property
    def _in_haste(self) -> bool:
        """Whether it was interrupted: estimate and history have nothing of the last pass until it is gone on with."""
        return self.stop_reason == "interrupted"

    def _keep(self, film: Film | None = None, last: bool = False) -> None:
        """Writes a checkpoint where one is due, or begins to write the last one; film: as it is now, if it is known."""
        if self._checkpoints is not None and (last or self._checkpoints.due):
            write = self._checkpoints.begin if last else self._checkpoints.write
            write(Kept(self._planned_spp, self.seconds, self.history, film or self.session.film(),
                       self.session.work_left(), self._convergence.noise))

    def _keep_unfinished(self) -> None:
        """Writes a checkpoint where `passes` is left before its end, unless nobody wants it or the device fails now."""
        if self._checkpoints is None or self._abandoned.is_set() or sys.is_finalizing():    # threads have ended then
            return
        with self._turns.one(), suppress(DeviceError):
            self._keep(self.session.whole_film(), last=True)
