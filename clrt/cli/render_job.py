"""The steps of `clrt render`, from checking the options to writing the images."""

from __future__ import annotations

import atexit
import gc
import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import DeviceError, OutputError, ReaderGoneError, UsageError
from ..threads import beside
from .farm import is_huge, make_renderer, render_frames, render_huge
from .frames import FrameOptions, FrameSequence, make_sequence
from .goal import Goal
from .interrupt import Interruptible
from .load_options import LoadOptions
from .outputs import Outputs
from .pipes import split_pipes
from .previews import Previews
from .progress_reporter import Progress
from .render_options import OutputOptions, SavingOptions, StopOptions

if TYPE_CHECKING:
    from ..device.open import Device
    from ..farm.cluster import Cluster
    from ..output.denoise import Denoiser
    from ..rendering.renderer import Renderer, State
    from ..rendering.renderer_options import RendererOptions
    from ..scene.model import Scene

#: The exit code after Ctrl-C.
INTERRUPTED = 130
#: With a reference, a warning is logged if the estimated error is off by more than this factor.
RIGHT = 1.2


@dataclass
class RenderJob:
    """A render as requested. options: the keywords of the renderer that the command line has by the same names."""

    scene: Path
    loading: LoadOptions
    asked: OutputOptions
    stop: StopOptions
    saving: SavingOptions
    frames: FrameOptions
    options: RendererOptions
    print_kernel: bool = False

    def check(self) -> None:
        """Check all that can be checked before the scene is loaded, and complete the options."""
        from ..formats.load_scene import check_scene

        check_scene(self.scene)
        layers = _chosen_aovs(self.asked.aovs) if self.asked.aovs else ()
        self.results = self._outputs(layers)
        self.sequence = self._sequence()
        if self.sequence is None:
            self._check_still()
        self.stop.check()
        self._denoiser = _denoiser() if self.asked.denoise else None
        self.options["aovs"], self.options["first_hits"] = layers, self.asked.denoise
        self.options["error_percentile"] = self.stop.error_percentile
        self.options["checkpoint"] = None if self.print_kernel else self.saving.checkpoint
        self.options["checkpoint_seconds"] = self.saving.checkpoint_every
        self.options["resume"] = self.saving.resume and not (self.print_kernel or self.sequence)

    def _outputs(self, layers: tuple[str, ...]) -> Outputs:
        from ..formats.load_scene import STDIN

        asked = self.asked
        named = (self.scene,) if asked.reference is None else (self.scene, asked.reference)
        usual = Path("scene.png" if self.scene == STDIN else f"{self.scene.stem}.png")
        files, pipes = split_pipes(asked.outputs or (usual,))
        return Outputs(
            named,
            files,
            layers,
            asked.denoise,
            asked.view,
            asked.exposure,
            asked.report,
            asked.plot,
            asked.force,
            pipes=pipes,
        )

    def _sequence(self) -> FrameSequence | None:
        """Return the frames to render; None for a still image."""
        if self.frames.turns is not None and self.frames.turntable is None:
            raise UsageError("--turntable-turns is what a turntable turns; add --turntable N")
        if not self.frames.many:
            return None
        if self.frames.frames is not None and self.loading.animation_time is not None:
            raise UsageError("--animation-time is the time of a still; leave it out, or leave out --frames")
        still_only = {
            "checkpoint": self.saving.checkpoint,
            "preview-every": self.saving.preview_every,
            "reference": self.asked.reference,
            "plot": self.asked.plot,
        }
        return make_sequence(self.results, self.frames.frames, self.saving.resume, still_only)

    def _check_still(self) -> None:
        """Check the options of a still image, and that its files can be written."""
        if self.frames.fps is not None:
            raise UsageError("--fps is the frame rate of an animation; add --frames or --turntable")
        if self.saving.resume and self.saving.checkpoint is None:
            raise UsageError("--resume needs a checkpoint; give its file with --checkpoint")
        self.results.check(self.saving.checkpoint)
        self.results.check_unprotected(self.saving.checkpoint)

    def run(self, cluster: Cluster | None, progress: Progress) -> bool:
        """Load the scene, render it and write the results; return False if interrupted."""
        opening = None if cluster else beside(lambda: _open(self.options))
        content = self._load(progress)
        expected, goal = self._reference(content), self._goal(content)
        if cluster and self.sequence:
            return render_frames(cluster, content, self.options, goal, self.sequence, progress)
        if cluster and is_huge(self.options["size"] or content.render.size):
            return render_huge(cluster, content, self.options, goal, self.results, progress)
        if opening is not None:
            self.options["device"] = opening()
        self.options["spp"], self.options["on_phase"] = goal.spp, progress.phase
        renderer = make_renderer(cluster, content, self.options)
        if self.print_kernel:
            click.echo(renderer.compiled.source)
            return True
        return self._render(renderer, goal, expected, progress)

    def _load(self, progress: Progress) -> Scene:
        """Return the scene, or that of the first frame, once no output would replace one of its files."""
        from ..formats.referenced_files import files_read

        progress.phase("load")
        with files_read() as inputs:
            content = self.loading.load(self.scene, moving=self.frames.frames is not None, size=self.options["size"])
        if self.sequence is None:
            self.results = self.results.of_scene(content)
            self.results.check_apart(inputs, self.saving.checkpoint)
            self.results.check_unprotected(self.saving.checkpoint)
        else:
            content = self.sequence.scene(content, self.options["size"], self.frames)
            self.sequence.check_apart(inputs)
        return content

    def _reference(self, content: Scene) -> Any:
        """Return the reference image, if any."""
        size = self.options["size"] or content.render.size
        return None if self.asked.reference is None else read_reference(self.asked.reference, size)

    def _goal(self, content: Scene) -> Goal:
        """Return when the render of this scene stops."""
        from ..output.data_images import check_denoisable
        from ..rendering.stop_conditions import planned_error, planned_spp

        stop = self.stop
        planned = planned_spp(content.render, stop.spp, stop.seconds, stop.error)
        if self._denoiser is not None:
            check_denoisable(self.options["integrator"] or content.render.integrator)
        target = planned_error(content.render, stop.spp, stop.seconds, stop.error)
        return Goal(planned, stop.seconds, target, stop.error_percentile)

    def _render(self, renderer: Renderer, goal: Goal, expected: Any, progress: Progress) -> bool:
        """Render the image, or all frames; return False if interrupted."""
        # Otherwise Python searches all modules' objects for garbage at exit, which takes 0.05 s. Not if it exits before
        # the render: OpenImageIO then reports its remaining objects.
        atexit.register(gc.freeze)
        with Interruptible(renderer.interrupt) as interruptible:
            try:
                if self.sequence is None:
                    previews = Previews(self.results, self.saving.preview_every)
                    render_image(renderer, self.results, goal, expected, self._denoiser, progress, previews)
                else:
                    _render_frames(renderer, self.sequence, goal, self._denoiser, progress)
            except (DeviceError, OutputError) as failure:
                advised = type(failure)(f"{failure}{self.saving.advice()}")
                if interruptible.asked and isinstance(failure, ReaderGoneError):
                    advised.exit_code = INTERRUPTED  # Ctrl-C ends all programs of a pipeline
                raise advised from failure
        if renderer.stop_reason == "interrupted":
            self._advise(renderer.scene.name)
        return not interruptible.asked

    def _advise(self, name: str) -> None:
        """Log how to resume an interrupted render."""
        logging.getLogger(__name__).warning(
            "%s: interrupted; %s",
            name,
            (
                "run the same command with --resume to render the missing frames"
                if self.sequence
                else f"run it with --resume to continue from {self.saving.checkpoint}"
                if self.saving.checkpoint
                else "to be able to resume a render, start it with --checkpoint"
            ),
        )


def _chosen_aovs(names: tuple[str, ...]) -> tuple[str, ...]:
    from ..rendering.aovs import chosen_aovs

    return chosen_aovs(",".join(names))


def _open(options: RendererOptions) -> list[Device]:
    """Open the devices and import what renders: half of this is file access, and it needs no scene."""
    from ..device.open import open_devices
    from .first_use import tuned

    devices = open_devices(options["device"])
    if options.get("paths") is None and options.get("layout") is None:
        devices = tuned(devices)
    from ..rendering import renderer  # noqa: F401

    return devices


def _denoiser() -> Denoiser:
    from ..output.denoise import Denoiser

    return Denoiser()


def _render_frames(
    renderer: Renderer, sequence: FrameSequence, goal: Goal, denoiser: Denoiser | None, progress: Progress
) -> None:
    """Render the remaining frames, each to the goal, and encode the videos."""
    for done, (results, still) in enumerate(sequence.left(renderer.scene, renderer.choices, goal)):
        progress.frame(results.header["frame"], done, sequence.remaining)
        renderer.show(still)
        render_image(renderer, results, goal, None, denoiser, progress)
        if renderer.stop_reason == "interrupted":
            return
    sequence.join()


def render_image(
    renderer: Renderer,
    results: Outputs,
    goal: Goal,
    expected: Any,
    denoiser: Denoiser | None,
    progress: Progress,
    previews: Previews | None = None,
) -> None:
    """Render to the goal, or until interrupted, and write the results; an interrupted frame is not written."""
    guides = renderer.session.guides() if denoiser else {}
    progress.phase("render", device=renderer.name, device_bytes=renderer.session.device_bytes)
    for state in renderer.passes(spp=goal.spp, time=goal.seconds, error=goal.error, reference=expected):
        progress.workers(renderer.session.shares())
        progress.state(state, goal)
        unfinished = results.header and renderer.stop_reason == "interrupted"
        if renderer.stop_reason is not None and not unfinished:  # its last checkpoint is written at the same time
            _write(renderer, state, results, denoiser, guides, expected, progress)
        elif previews is not None and renderer.stop_reason is None:
            previews.show(renderer, state)


def _write(
    renderer: Renderer,
    state: State,
    results: Outputs,
    denoiser: Denoiser | None,
    guides: Mapping[str, Any],
    expected: Any,
    progress: Progress,
) -> None:
    from ..api import image_of
    from ..output.denoise import denoised

    progress.phase("write")
    image = image_of(renderer, state)
    image = replace(image, report=image.report | results.header)
    renderer.warnings.log(state.film)
    ratio = state.noise_ratio
    if ratio is not None and not 1 / RIGHT <= ratio <= RIGHT:
        logging.getLogger(__name__).warning(
            "the estimated error is %.2f times the error against the reference, which may be noisy itself", ratio
        )
    if denoiser is None:
        results.save(image)
    else:
        results.save(replace(image, aovs={}), raw=True)
        progress.phase("denoise")
        image = denoised(image, denoiser, guides, expected)
        results.save(image)
    results.save_measures(renderer, image)


def read_reference(path: Path, size: tuple[int, int]) -> Any:
    """Return the reference in an image file, (height, width, 3). Raises UsageError if it cannot be compared with an
    image of `size` (width, height)."""
    from ..output.images import read_image
    from ..rendering.film.state import check_reference

    pixels = read_image(path)
    height, width = pixels.shape[:2]
    if (width, height) != size:
        raise UsageError(
            f"{path}: the reference is {width}x{height}, the image {size[0]}x{size[1]}; use --size {width}x{height}"
        )
    try:
        check_reference(pixels, size)
    except UsageError as error:
        raise UsageError(f"{path}: the {error}") from error
    return pixels
