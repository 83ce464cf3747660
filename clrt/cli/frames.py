"""`clrt render --frames`: the frames of an animation, as numbered files and videos."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import OutputError, UsageError
from .option_groups import flag
from .option_types import OneOf
from .outputs import Outputs

if TYPE_CHECKING:
    from ..rendering.compile.choices import Choices
    from ..scene.animation import Turns
    from ..scene.model import Scene

#: Fields of Outputs that do not affect an image's content.
FILES = {"inputs", "pictures", "report", "plot", "force", "header", "spool", "pipes", "_errors"}


class FrameNumbers(click.ParamType[str]):
    """Frames: all, or numbers and ranges such as 3,7,0-99:5. The value stays a string, which `_numbers` parses."""

    name = "FRAMES"

    def convert(self, value: Any, param: click.Parameter | None, context: click.Context | None) -> str:
        if value != "all" and not _numbers(str(value)):
            self.fail(
                f"{value!r} is not a list of frames; write all, or numbers and ranges such as 12, 0-47, 0-99:5 "
                "or 3,7,20-30",
                param,
                context,
            )
        return str(value)


@dataclass(frozen=True)
class FrameOptions:
    """Which frames are rendered; without `frames` and `turntable` it is a still image."""

    frames: str | None = flag(
        "--frames",
        type=FrameNumbers(),
        help="Frames of an animation, written to numbered files (name_####.png) or a video (.gif, .mp4, .webm): all, "
        "or numbers and ranges such as 12, 0-47, 0-99:5.",
    )
    turntable: int | None = flag(
        "--turntable",
        type=click.IntRange(min=1),
        metavar="N",
        help="Orbit once around a bare model, or the point that a scene's camera looks at, in N frames.",
    )
    turns: Turns | None = flag(
        "--turntable-turns",
        type=OneOf(("camera", "object")),
        help="camera: the turntable's camera moves past the lights (default); object: environment and lights stay with "
        "the camera.",
    )
    fps: float | None = flag(
        "--fps", type=click.FloatRange(min=0, min_open=True), help="Frames per second; default: the scene's."
    )

    @property
    def many(self) -> bool:
        """Whether the frames of an animation are rendered."""
        return bool(self.frames or self.turntable)


@dataclass
class FrameSequence:
    """Frames to render. outputs: with one file name pattern for all frames; videos: of these frames; chosen: frame
    numbers, None for all; resume: whether existing frames are skipped."""

    outputs: Outputs
    videos: tuple[Path, ...]
    chosen: list[int] | None
    resume: bool

    def scene(self, scene: Scene, size: tuple[int, int] | None, asked: FrameOptions) -> Scene:
        """Return the scene as in its first frame. Checks before rendering that frames exist and outputs are
        writable."""
        from ..output.atomic_files import check_unprotected
        from ..output.video import check_video
        from ..scene.animation import Animation
        from ..scene.camera_path import frames, turntable as turned

        if asked.turntable is not None:
            scene = turned(scene, asked.turntable, asked.fps or Animation.fps, asked.turns or "camera")
        elif asked.fps is not None and scene.animation is not None:
            scene = replace(scene, animation=replace(scene.animation, fps=asked.fps))
        self._moving, (_, first) = scene, next(frames(scene, self.chosen))
        assert scene.animation is not None
        self._numbers = range(scene.animation.frames) if self.chosen is None else self.chosen
        self._fps, self.remaining = scene.animation.fps, len(self._numbers)
        for video in self.videos:
            check_video(video, size or scene.render.size, self._fps)
            check_unprotected(video, self.outputs.force)
        self._of(0).check()
        for number in () if self.resume else self._numbers:  # finished frames, which are kept, may be read-only
            self._of(number).check_unprotected()
        return first

    def still(self, number: int) -> Scene:
        """Return the scene of a frame."""
        from ..scene.camera_path import frames

        return next(frames(self._moving, [number]))[1]

    def _of(self, number: int) -> Outputs:
        """Return the outputs of a frame."""
        asked = self.outputs
        return replace(
            asked,
            pictures=tuple(numbered(path, number) for path in asked.pictures),
            report=asked.report and numbered(asked.report, number),
            spool=asked.spool and numbered(asked.spool, number),
        )

    def check_apart(self, inputs: Iterable[Path]) -> None:
        """Apply `Outputs.check_apart` to every frame and video."""
        files = {os.path.realpath(path) for path in inputs}
        for number in self._numbers:
            self._of(number).check_apart(inputs)
        for video in self.videos:
            if os.path.realpath(video) in files:
                raise UsageError(
                    f"{video}: is both a file of the scene and a video, one of which would be lost; choose another file"
                )

    def left(self, scene: Scene, choices: Choices, goal: object) -> Iterator[tuple[Outputs, Scene]]:
        """Yield outputs and scene of each frame to render, with the settings of `scene`; `remaining` excludes those
        that were finished. Images contain a hash of all they depend on."""
        from ..output.atomic_files import make_folder
        from ..output.images import metadata_of
        from ..rendering.checkpoint.identity import facts_of
        from ..rendering.compile.visible_parts import same_world
        from ..scene.camera_path import frames

        asked = self.outputs
        shown = [(each.name, getattr(asked, each.name)) for each in fields(asked) if each.name not in FILES]
        if asked.spool:
            make_folder(asked.spool.parent)
        last, facts = None, dict[str, str]()
        for number, still in frames(self._moving, self.chosen):
            still = replace(still, render=scene.render)
            if last is None or not same_world(still, last):
                last, facts = still, {**facts_of(still, choices), "camera": ""}
            made_of = repr((sorted(facts.items()), still.camera, goal, shown, still.display))
            digest = hashlib.sha256(made_of.encode()).hexdigest()
            outputs = replace(self._of(number).of_scene(still), header={"frame": number, "frame_hash": digest})
            done = self.resume and all(
                metadata_of(path, "clrt:frame_hash") == digest for path in (*outputs.pictures, *outputs.raws)
            )
            if done and all(path.is_file() for path in (*outputs.beside, outputs.report) if path):
                self.remaining -= 1
            else:
                outputs.check_unprotected()
                yield outputs, still

    def join(self) -> None:
        """Write the videos, and remove frames that were only written for them."""
        from ..output.video import write_video

        pattern = next((path for path in self.outputs.pictures if path.suffix.lower() == ".png"), Path())
        for video in self.videos:
            try:
                write_video(video, [numbered(pattern, number) for number in self._numbers], self._fps)
            except OutputError as error:
                raise OutputError(f"{error}; its frames are in {pattern}: --resume encodes them") from error
            click.echo(str(video))
        if spool := self.outputs.spool:
            for number in self._numbers:
                numbered(spool, number).unlink(missing_ok=True)
            with suppress(OSError):  # it may contain other files
                spool.parent.rmdir()


def make_sequence(outputs: Outputs, frames: str | None, resume: bool, single: Mapping[str, object]) -> FrameSequence:
    """Return the sequence of the requested outputs, of which some may be videos; single: still-image options."""
    from ..output.video import is_video

    if outputs.pipes:
        raise UsageError(f"-o {outputs.pipes[0].path}: takes one image, not several frames; give a file name")
    for name, value in single.items():
        if value is not None:
            raise UsageError(f"--{name} is not supported for animations; leave it out")
    videos = tuple(path for path in outputs.pictures if is_video(path))
    pictures = tuple(path for path in outputs.pictures if not is_video(path))
    if videos and not any(path.suffix.lower() == ".png" for path in pictures):
        spool = videos[0].with_name(f"{videos[0].name}.frames") / "####.png"
        outputs, pictures = replace(outputs, spool=spool), (*pictures, spool)
    return FrameSequence(replace(outputs, pictures=pictures), videos, _numbers(frames or "all"), resume)


def _numbers(text: str) -> list[int] | None:
    """Parse frame numbers, ascending; None for all, and empty if the text names none."""
    if text == "all":
        return None
    numbers: set[int] = set()
    for part in text.split(","):
        match = re.fullmatch(r"(\d{1,7})(?:-(\d{1,7})(?::0*([1-9]\d{0,6}))?)?", part.strip())
        if not match:
            return []
        numbers |= {*range(int(match[1]), int(match[2] or match[1]) + 1, int(match[3] or 1))}
    return sorted(numbers)


def numbered(path: Path, number: int) -> Path:
    """Return a frame's file name: its number replaces the last ####, or is appended to the stem after _."""
    runs = list(re.finditer("#+", path.name))
    if not runs:
        return path.with_name(f"{path.stem}_{number:04}{path.suffix}")
    first, end = runs[-1].span()
    return path.with_name(f"{path.name[:first]}{number:0{end - first}}{path.name[end:]}")
