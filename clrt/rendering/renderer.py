"""Progressive renderer: passes over the whole image until a stop condition is met, with error estimate and history."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..awake import AwakeClock, watched_clock
from ..device.open import Selectors, name_of, open_devices
from ..errors import DeviceError
from ..file_names import StrPath
from ..float_errors import with_default_errors
from ..scene.model import Camera, RenderSettings, Scene
from ..scene.validation.validate import check_is_scene, validate
from ..threads import Event
from .accumulation.accumulation import Accumulation
from .accumulation.launch_plan import depth_of
from .accumulation.multi_device import make_picture
from .accumulation.scene_on_device import SceneOnDevice
from .aovs import Aovs
from .checkpoint.checkpoints import check_of_none, open_checkpoints
from .checkpoint.saved_state import SavedState
from .compile.camera_kernel import camera_file
from .compile.choices import choices_on
from .compile.compile_scene import CompiledScene
from .compile.scene_compiler import SceneCompiler
from .error_estimate.adaptive_sampling import most_planned
from .error_estimate.convergence import Convergence
from .film.film import Film
from .film.state import State as State, check_reference
from .render_warnings import PictureWarnings
from .renderer_options import choices_of, settings_of
from .state_interval import StateInterval
from .stop_conditions import StopConditions, check_stops, checked_percentile
from .thread_turns import ThreadTurns


class Renderer:
    """Progressive renderer of a scene on one or more devices. Options that are not given are taken from `scene.render`.

    - device: see `clrt devices`, or an open device; several render one image together. size: (width, height).
    - spp: planned samples per pixel, where `passes` stops. adaptive: more samples for tiles of larger error.
    - error_percentile: a target error counts as reached once this percentage of the 8 x 8 pixel tiles has reached it.
    - triangle, box, sphere, offset, builder, layout, tree, lanes, paths: as in `clrt render --help`.
    - aovs: names of AOVs, see docs/aovs.md; first_hits: whether guides or first-hit AOVs will be requested later.
    - checkpoint: a file updated about every `checkpoint_seconds` and at the end; resume: continue from it if it exists,
      with the `spp` planned then (docs/checkpoints.md).
    - on_phase: called with "build" (packing, BVH build) and "compile" (program build, upload) as each begins.
    - before: a renderer no longer needed, whose device resources are reused as far as its scene consists of the same
      objects, unmodified. Raises subclasses of ClrtError.
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
                 checkpoint: StrPath | None = None, resume: bool = False, checkpoint_seconds: float = 30.0,
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
        self._interrupted, self._abandoned, self._turns = False, Event(), ThreadTurns()
        self._asked_for: Camera | None = None
        if kept:
            self._convergence.restore(kept)
            self.session.restore(kept.film, kept.work)
            self.seconds = kept.seconds
            self.state()

    def _open(self, device: Selectors, lanes: int | None, on_phase: Callable[[str], None],
              before: Renderer | None) -> None:
        """Open the devices and compile the scene for them; without `lanes` each uses its preferred SIMD width."""
        self.device, *_ = self.devices = open_devices(device)
        on_phase("build")
        self._compiler: SceneCompiler = SceneCompiler.after(before._compiler if before else None, self.devices)
        choices = [choices_on(each, self.choices, lanes) for each in self.devices]
        self._compiled = self._compiler.compile(self.scene, choices, ahead=len(choices) == 1)
        self.warnings = PictureWarnings(self.scene, self.compiled.features)

    def _make_picture(self, before: Sequence[SceneOnDevice] = ()) -> Accumulation:
        return make_picture(self.devices, self._compiled, self.settings.size, depth_of(self.settings),
                            self.settings.seed, self._planned_spp, before)

    @property
    def name(self) -> str:
        """Names of all devices that render."""
        return name_of(self.devices)

    def _begin(self) -> None:
        """Reset to an image without samples."""
        self._convergence = Convergence(self._planned_spp, self._percentile)
        self._aovs.begin(self.session, self.scene)
        self.stop_reason: str | None = None
        self.seconds = 0.0

    @property
    def history(self) -> list[dict[str, Any]]:
        """History of the convergence, see `Convergence`."""
        return self._convergence.history

    @property
    def compiled(self) -> CompiledScene:
        """The scene as compiled for the first device."""
        return self._compiled[0]

    @property
    def settings(self) -> RenderSettings:
        """The scene's render settings, overridden by the options given."""
        return self.scene.render

    def look(self, camera: Camera) -> None:
        """Start a new image from this camera, bit-identical to the one that a new renderer would produce.

        BVH and buffers are reused; so is the program, unless the camera model changes (projection, thin lens). Raises
        SceneError if the camera is invalid, and UsageError if a checkpoint is written, as it belongs to one image.
        """
        check_of_none(self._checkpoints)
        validate(Scene(camera=camera, render=self.settings))
        with self._turns.one():
            self._asked_for = camera
            self._see()

    def _see(self) -> None:
        """Switch to the requested camera; if that is interrupted, the next turn does it."""
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
        """Render, yielding a State at powers of two of the sample count, at intervals between them, and at the end.

        Stops at `spp` samples per pixel, after `time` seconds or at an estimated error of `error` (√relMSE), whichever
        is first; without any, at the renderer's `spp` or the scene's. Call it again to continue, also in another
        thread. Left early (`break`, Ctrl-C) it writes a checkpoint or is a launch ahead. reference: (height, width, 3).
        """
        check_reference(reference, self.session.size)
        try:
            with watched_clock(self.seconds) as watch:
                limits = StopConditions.of(self.settings, spp, time, error)
                yield from self._turns.of(self._passes(limits, reference, watch))
        except (GeneratorExit, KeyboardInterrupt):
            self._keep_unfinished()
            raise
        finally:
            if self._checkpoints is not None:
                self._checkpoints.wait()

    def _passes(self, limits: StopConditions, reference: NDArray[np.float32] | None,
                watch: AwakeClock) -> Iterator[State]:
        self._see()
        self.session.mend()
        if self._catch_up(limits):
            yield self.state(reference)
        pace, begun = StateInterval(), None
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
                begun = self.session.advance_ahead(limits.room)    # runs while the state is computed
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
            if (self.stop_reason, self.session.samples_done) != before:    # another call rendered meanwhile
                watch.set(self.seconds)
                begun = None
                if self._catch_up(limits):
                    yield self.state(reference)

    def interrupt(self) -> None:
        """Make `passes` stop after the launches in flight, with a state and a checkpoint; safe in signal handlers."""
        self._interrupted = True

    def abandon(self) -> None:
        """Make `passes` stop after the current launch without a state or checkpoint, because the image is discarded."""
        self._abandoned.set()

    def state(self, reference: NDArray[np.float32] | None = None) -> State:
        """Return the current state of the image, also in the middle of an interrupted pass."""
        with self._turns.one():
            self._see()
            film, tile_samples = self.session.film(), self.session.tile_samples
            return self._convergence.state(film, tile_samples, self.seconds, reference, self._in_haste)

    def aovs(self, state: State) -> dict[str, NDArray[np.generic]]:
        """Return the AOVs of a state by name, in the order in which they were requested."""
        return self._aovs.of(state.film)

    def _catch_up(self, limits: StopConditions) -> bool:
        """Record what history lacks; return whether an earlier call or the resumed checkpoint met a stop condition."""
        self._convergence.catch_up(self.session, self.seconds)
        done = self.session.samples_done
        self.stop_reason = limits.reached(done, self.seconds)
        looks = self.stop_reason is None and done and limits.looks(done) and not self.session.work.parts
        if looks and limits.low_enough(self.state().stops_by):
            self.stop_reason = "error"
        return self.stop_reason is not None

    def _next_pass(self, limits: StopConditions) -> Iterator[None]:
        """Return a pass over the whole image, or an adaptive one that doubles the samples of the tiles where that
        reduces the error most. Stop the render if no tile is left."""
        if not limits.adapts(self.session.samples_done):
            return self.session.advance(limits.room)
        if not len(tiles := self._convergence.tiles_to_double(self.session.tile_samples, limits.spp)):
            self.stop_reason = "spp"
        return self.session.double(tiles)

    def _run_pass(self, launches: Iterator[None], limits: StopConditions, watch: AwakeClock) -> None:
        """Run one pass; set the stop reason if `time` is over or the render is interrupted, even inside the pass."""
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
        """Whether the render was interrupted: estimate and history exclude the last pass until it is resumed."""
        return self.stop_reason == "interrupted"

    def _keep(self, film: Film | None = None, last: bool = False) -> None:
        """Write a checkpoint if one is due, or start writing the last one; film: the current film, if known."""
        if self._checkpoints is not None and (last or self._checkpoints.due):
            write = self._checkpoints.begin if last else self._checkpoints.write
            write(SavedState(self._planned_spp, self.seconds, self.history, film or self.session.film(),
                             self.session.work_left(), self._convergence.noise))

    def _keep_unfinished(self) -> None:
        """Write a checkpoint if `passes` is left before its end, unless the render is abandoned or the device fails."""
        if self._checkpoints is None or self._abandoned.is_set() or sys.is_finalizing():    # threads have ended by then
            return
        with self._turns.one(), suppress(DeviceError):
            self._keep(self.session.whole_film(), last=True)
