"""Progressive renderer: passes over the whole image until a stop condition is met, with error estimate and history."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from time import perf_counter, process_time
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from ..awake import AwakeClock, watched_clock
from ..device.open import Selectors, name_of, open_devices
from ..errors import DeviceError
from ..float_errors import with_default_errors
from ..scene.exposure import motion_features
from ..scene.fields.keywords import with_known_keywords
from ..scene.model import Camera, RenderSettings, Scene
from ..scene.on_ground import is_below, on_ground
from ..scene.validation.validate import validate
from .accumulation.accumulation import Accumulation
from .accumulation.launch_plan import LaunchPlan
from .accumulation.multi_device import make_picture
from .accumulation.scene_on_device import SceneOnDevice
from .aovs import Aovs
from .checkpoint.checkpoints import check_of_none, open_checkpoints
from .compile.camera_kernel import camera_file
from .compile.compile_scene import CompiledScene
from .compile.scene_compiler import SceneCompiler
from .compile.visible_parts import same_world
from .error_estimate.adaptive_sampling import most_planned
from .film.backdrop import backdrop_of
from .film.state import State as State, check_reference
from .film.tiles import TILE, tiles_of
from .guiding.training import guided
from .listed_keywords import listed
from .passes import PassLoop
from .progress import Progress
from .render_warnings import PictureWarnings
from .renderer_options import SETTINGS, RendererOptions, checkpoints_of, choices_of, settings_of
from .stop_conditions import StopConditions, check_stops, checked_percentile
from .thread_turns import ThreadTurns


@listed(RendererOptions, SETTINGS)
class Renderer:
    """Progressive renderer of a scene on one or more devices. Raises subclasses of ClrtError.

    Options that are not given are taken from `scene.render`, or suit the device. given: the scene as it was given, with
    these options; scene: the same on its ground, as it is rendered.
    """

    #: Seconds, and those of all cores, that the guiding field was trained for; they are not part of `seconds`.
    training_seconds = training_cpu_seconds = 0.0

    @with_default_errors
    def __init__(self, scene: Scene, **options: Unpack[RendererOptions]) -> None:
        check_stops(options.get("spp"))
        percentile = checked_percentile(options.get("error_percentile"))
        self.given: Scene = replace(scene, render=settings_of(scene.render, options))
        self.scene: Scene = on_ground(self.given)
        self._aovs = Aovs(options.get("aovs"), self.settings.integrator)
        self.choices = choices_of(options)
        on_phase, before = options.get("on_phase"), options.get("before")
        on_phase = on_phase if on_phase is not None else lambda phase: None
        self._open(options.get("device"), on_phase, before)
        self._checkpoints, kept = open_checkpoints(checkpoints_of(options), self.scene, self.choices, self.name)
        on_phase("train" if self.choices.guiding == "on" else "compile")
        self._planned_spp = kept.planned_spp if kept else most_planned(options.get("spp"), self.settings.adaptive)
        self._progress = Progress(
            self._new_picture(before.session.scenes if before else ()),
            self._planned_spp,
            percentile,
            self._checkpoints,
        )
        self._aovs.begin(self.session, self.scene)
        self._turns = ThreadTurns()
        self._asked_for: Camera | None = None
        if kept:
            self._progress.restore(kept)

    def _open(self, device: Selectors, on_phase: Callable[[str], None], before: Renderer | None) -> None:
        """Open the devices and compile the scene for them."""
        self.device, *_ = self.devices = open_devices(device)
        on_phase("build")
        self._compiler: SceneCompiler = SceneCompiler.after(before._compiler if before else None, self.devices)
        self._compiled = self._compiler.compile(self.scene, self.choices, ahead=len(self.devices) == 1)
        self.warnings: PictureWarnings = PictureWarnings(
            self.scene, self.compiled.features, before.warnings if before else None
        )

    def _new_picture(self, before: Sequence[SceneOnDevice] = ()) -> Accumulation:
        """Return an image without samples, or a band of it, over its backdrop."""
        picture, backdrop = self._make_picture(before), backdrop_of(self.scene)
        first = picture.first_tile // tiles_of(self.settings.size)[1] * TILE
        picture.backdrop = (
            backdrop if backdrop is None or len(backdrop) == 1 else backdrop[first : first + picture.size[1]]
        )
        return picture

    def _make_picture(self, before: Sequence[SceneOnDevice] = ()) -> Accumulation:
        plan = LaunchPlan.of(self.settings, self._planned_spp)
        if self.choices.guiding == "on":
            self._train(plan)
        return make_picture(self.devices, self._compiled, plan, before)

    def _train(self, plan: LaunchPlan) -> None:
        start, cpu = perf_counter(), process_time()
        self._compiled = guided(self.devices, self._compiled, plan)
        self.training_seconds, self.training_cpu_seconds = perf_counter() - start, process_time() - cpu

    @property
    def name(self) -> str:
        """Names of all devices that render."""
        return name_of(self.devices)

    @property
    def session(self) -> Accumulation:
        """The samples of the image."""
        return self._progress.session

    @property
    def seconds(self) -> float:
        """Seconds that the image has been rendered for."""
        return self._progress.seconds

    @property
    def stop_reason(self) -> str | None:
        """Why `passes` stopped: "spp", "time", "error" or "interrupted"; None before."""
        return self._progress.stop_reason

    @property
    def history(self) -> list[dict[str, Any]]:
        """History of the convergence, see `Convergence`."""
        return self._progress.convergence.history

    @property
    def compiled(self) -> CompiledScene:
        """The scene as compiled for the first device."""
        return self._compiled[0]

    @property
    def settings(self) -> RenderSettings:
        """The scene's render settings, overridden by the options given."""
        return self.scene.render

    @with_known_keywords
    def look(self, camera: Camera) -> None:
        """Start a new image from this camera, bit-identical to the one that a new renderer would produce.

        BVH and buffers are reused; so is the program, unless the camera model changes (projection, lens, motion).
        Raises SceneError if the camera is invalid, and UsageError if a checkpoint is written, as it belongs to one
        image.
        """
        check_of_none(self._checkpoints)
        validate(Scene(camera=camera, render=self.settings))
        seen = replace(self.given, camera=camera)
        if not self._stays(seen):
            self.show(seen)
            return
        with self._turns.one():
            self._asked_for = camera
            self._see()

    @with_known_keywords
    def show(self, scene: Scene) -> None:
        """Start a new image of another scene with the same settings, like `look` if only the camera differs.

        BVHs, buffers and the program are reused as far as they are the same. If only vertices moved, the BVH is
        refitted where its layout allows it, unless they moved far apart. Raises SceneError if the scene is invalid, and
        UsageError as `look` does.
        """
        check_of_none(self._checkpoints)
        if same_world(scene, self.given) and self._stays(scene):
            self.look(scene.camera)
            return
        self.given = replace(scene, render=self.settings)
        with self._turns.one():
            self._show(on_ground(self.given))
            self._asked_for = None
            self._begin()

    def _stays(self, scene: Scene) -> bool:
        """Return whether the ground and what moves are those of the scene shown, for a scene with another camera."""
        return is_below(scene) == is_below(self.given) and motion_features(scene) == motion_features(self.given)

    def _show(self, scene: Scene) -> None:
        self._compiled, self.scene = self._compiler.compile(scene, self.choices), scene
        self._progress.session = self._new_picture(self.session.scenes)
        self.warnings = PictureWarnings(scene, self.compiled.features)

    def _see(self) -> None:
        """Switch to the requested camera; if that is interrupted, the next turn does it."""
        if self._asked_for is not None:
            self._turn_to(self._asked_for)
            self._begin()
            self._asked_for = None

    def _begin(self) -> None:
        """Reset to an image without samples."""
        self._progress.begin()
        self._aovs.begin(self.session, self.scene)

    def _turn_to(self, camera: Camera) -> None:
        current, file = self.session.compiled, camera_file(camera, self.settings.integrator)
        self.scene = replace(self.scene, camera=camera)
        self._compiled = [each.seen_by(camera, file) for each in self._compiled]
        if current.seen_by(camera, file).has_text_of(current) and self.choices.guiding == "off":
            self.session.look(camera)
        else:
            self._progress.session = self._new_picture()

    @with_known_keywords
    def passes(
        self,
        *,
        spp: int | None = None,
        time: float | None = None,
        error: float | None = None,
        reference: NDArray[np.float32] | None = None,
    ) -> Iterator[State]:
        """Render, yielding a State at powers of two of the sample count, at intervals between them, and at the end.

        Stops at `spp` samples per pixel, after `time` seconds or at an estimated error of `error` (√relMSE), whichever
        is first; without any, at the renderer's `spp` or the scene's. Call it again to continue, also in another
        thread. Left early (`break`, Ctrl-C) it writes a checkpoint or is a launch ahead. reference: (height, width, 3).
        """
        check_reference(reference, self.session.size)
        try:
            with watched_clock(self.seconds) as watch:
                limits = StopConditions.of(self.settings, spp, time, error)
                yield from self._turns.of(self._states(limits, reference, watch))
        except (GeneratorExit, KeyboardInterrupt):
            self._save_unfinished()
            raise
        finally:
            if self._checkpoints is not None:
                self._checkpoints.wait()

    def _states(
        self, limits: StopConditions, reference: NDArray[np.float32] | None, watch: AwakeClock
    ) -> Iterator[State]:
        self._see()
        yield from PassLoop(self._progress, limits, reference, watch).states()

    def interrupt(self) -> None:
        """Make `passes` stop after the launches in flight, with a state and a checkpoint; safe in signal handlers."""
        self._progress.requests.interrupt()

    def abandon(self) -> None:
        """Make `passes` stop after the current launch without a state or checkpoint, because the image is discarded."""
        self._progress.requests.abandon()

    def state(self, reference: NDArray[np.float32] | None = None) -> State:
        """Return the current state of the image, also in the middle of an interrupted pass."""
        with self._turns.one():
            self._see()
            return self._progress.state(reference)

    def aovs(self, state: State) -> dict[str, NDArray[np.generic]]:
        """Return the AOVs of a state by name, in the order in which they were requested."""
        return self._aovs.of(state.film)

    @property
    def first_hits(self) -> dict[str, NDArray[np.generic]]:
        """The requested AOVs of first hits, which are known before `passes`."""
        return self._aovs.first_hits

    def _save_unfinished(self) -> None:
        """Write a checkpoint if `passes` is left before its end, unless the render is abandoned or the device fails."""
        if self._progress.saves_unfinished:
            with self._turns.one(), suppress(DeviceError):
                self._progress.save(self.session.whole_film(), last=True)
