"""Progressive rendering: passes over the whole picture until a stop condition is met, with noise and history."""

from __future__ import annotations

import sys
import time as clock
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..device.open import Device, name_of, open_devices
from ..awake import AwakeClock, watched_clock
from ..errors import DeviceError
from ..float_errors import with_default_errors
from ..scene.model import Camera, RenderSettings, Scene
from ..scene.validate import check_is_scene, validate
from ..threads import Event
from .accumulation import Accumulation
from .adaptive import FLOOR_SPP, MOST_TIMES_PLANNED
from .aovs import check_light, chosen_aovs, film_aovs, seen_first
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
from .picture_warnings import PictureWarnings
from .session import depth_of
from .state import State as State, check_reference
from .stops import check_stops, checked_percentile, count_or_time, is_check, low_enough, pass_room, planned_spp
from .turns import Turns

#: Between two states at least this long passes, and this many times what making a state costs.
STATE_SECONDS, STATE_COST = 0.5, 20


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
    def __init__(self, scene: Scene, *, device: str | int | Device | Sequence[str | int | Device] | None = None,
                 size: tuple[int, int] | None = None, spp: int | None = None, max_depth: int | None = None,
                 seed: int | None = None, integrator: str | None = None, shadows: bool | None = None,
                 sampler: str | None = None, filter: str | None = None, adaptive: bool | None = None,
                 back_face_culling: str | None = None, clamp_direct: float | None = None,
                 clamp_indirect: float | None = None, triangle: str = "watertight", box: str = "robust",
                 sphere: str = "robust", offset: str = "bound", builder: str | None = None, layout: str | None = None,
                 lanes: int | None = None, paths: str | None = None, tree: bool | None = None,
                 error_percentile: float | None = None, on_phase: Callable[[str], None] = lambda phase: None,
                 aovs: str | Iterable[str] = (), checkpoint: str | Path | None = None, resume: bool = False,
                 checkpoint_seconds: float = 30.0, before: Renderer | None = None, first_hits: bool = False) -> None:
        check_is_scene(scene)
        check_stops(spp)
        options = dict(locals())
        self._aovs, self._percentile = chosen_aovs(aovs), checked_percentile(error_percentile)
        settings = settings_of(scene.render, options)
        self.scene = replace(scene, render=settings)
        check_light(self._aovs, settings.integrator)
        self.choices = choices_of(options)
        self._open(device, lanes, on_phase, before)
        self._checkpoints, kept = open_checkpoints(checkpoint, resume, checkpoint_seconds, self.scene, self.choices,
                                                   self.name)
        on_phase("compile")
        planned = None if spp is None else int(spp) * (MOST_TIMES_PLANNED if settings.adaptive else 1)
        self._planned_spp = kept.planned_spp if kept else planned
        self.session: Accumulation = self._make_picture(before.session.scenes if before else ())
        self._begin()
        self._interrupted, self._abandoned, self._turns = False, Event(), Turns()
        self._asked_for: Camera | None = None
        if kept:
            self._convergence.restore(kept)
            self.session.restore(kept.film, kept.work)
            self.seconds = kept.seconds
            self.state()

    def _open(self, device: str | int | Device | Sequence[str | int | Device] | None, lanes: int | None,
              on_phase: Callable[[str], None], before: Renderer | None) -> None:
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
        seen = seen_first(self._aovs)   # now, so that an interrupted picture has them, too
        self._first_hits = self.session.first_hits(self.scene, seen) if seen else {}
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
        if (camera := self._asked_for) is None:
            return
        files, file = self.session.compiled.chosen_files["CAMERA"], camera_file(camera, self.settings.integrator)
        self.scene = replace(self.scene, camera=camera)
        self._compiled = [each.seen_by(camera, file) for each in self._compiled]
        if files == [file]:
            self.session.look(camera)
        else:
            self.session = self._make_picture()
        self._begin()
        self._asked_for = None

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
                planned = planned_spp(self.settings, spp, time, error)
                yield from self._turns.of(self._passes(planned, time, error, reference, watch))
        except (GeneratorExit, KeyboardInterrupt):
            self._keep_unfinished()
            raise
        finally:
            if self._checkpoints is not None:
                self._checkpoints.wait()

    def _passes(self, spp: int | None, time: float | None, error: float | None,
                reference: NDArray[np.float32] | None, watch: AwakeClock) -> Iterator[State]:
        self._see()
        self.session.mend()
        self._convergence.catch_up(self.session, self.seconds)
        self.stop_reason = self._reached(spp, time, error)
        if self.stop_reason is not None:
            yield self.state(reference)
        room = partial(pass_room, spp=spp, error=error, even_to=FLOOR_SPP if self.settings.adaptive else None)
        next_state, begun = 0.0, None
        while self.stop_reason is None:
            launches, begun = self._adaptive_pass(spp) if self._adapts else begun or self.session.advance(room), None
            self._run_pass(launches, time, watch)
            if self._abandoned.is_set():
                return
            now, done = clock.perf_counter(), self.session.samples_done
            self.stop_reason = self.stop_reason or count_or_time(done, self.seconds, spp, None)
            self._heed_interrupt()
            looks = error is not None and is_check(done, self._adapts)
            due = now >= next_state or done & (done - 1) == 0 or looks or self._adapts
            if self.stop_reason is None and not due:
                continue
            self.session.wait()
            self.seconds = watch.seconds
            film, tile_samples = self.session.film(), self.session.tile_samples
            if self.stop_reason is None and not (looks or self.settings.adaptive or self._checkpoints):
                begun = self.session.advance_ahead(room)    # runs while the state is made
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
                if self.stop_reason is None and looks and low_enough(state.stops_by, error):
                    self.stop_reason = "error"
                self._keep(film, last=self.stop_reason is not None)
            next_state = now + max(STATE_SECONDS, STATE_COST * (clock.perf_counter() - now))
            before = self.stop_reason, self.session.samples_done
            yield state
            if (self.stop_reason, self.session.samples_done) != before:    # another call went on meanwhile
                watch.set(self.seconds)
                self._convergence.catch_up(self.session, self.seconds)
                self.stop_reason, begun = self._reached(spp, time, error), None
                if self.stop_reason is not None:
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
        made = self._first_hits | film_aovs(state.film, self._aovs)
        return {name: made[name] for name in self._aovs}

    def _reached(self, spp: int | None, time: float | None, error: float | None) -> str | None:
        """The stop reason where an earlier call, or the render it goes on with, came so far already."""
        done = self.session.samples_done
        if reason := count_or_time(done, self.seconds, spp, time):
            return reason
        looks = done and error is not None and is_check(done, self._adapts) and not self.session.work.parts
        return "error" if looks and low_enough(self.state().stops_by, error) else None

    def _run_pass(self, launches: Iterator[None], time: float | None, watch: AwakeClock) -> None:
        """One pass; sets the stop reason where `time` is over or it is interrupted, maybe inside the pass."""
        for _ in launches:
            self.seconds = watch.seconds
            self._heed_interrupt()
            if self._abandoned.is_set() or self._in_haste:
                return
            if time is not None and self.seconds >= time and self.session.samples_done:
                self.stop_reason = "time"
                return
            if self.session.work.parts:
                self._keep()

    @property
    def _adapts(self) -> bool:
        """Whether the next pass goes by the error of the tiles; the picture so far is the newest state then."""
        return self.settings.adaptive and self.session.samples_done >= FLOOR_SPP

    def _adaptive_pass(self, spp: int | None) -> Iterator[None]:
        """Doubles the samples of those tiles where that takes most error away; ends the render at `spp`."""
        if not len(tiles := self._convergence.tiles_to_double(self.session.tile_samples, spp)):
            self.stop_reason = "spp"
        yield from self.session.double(tiles)

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
