"""Outputs of `clrt render`: images, a report and a plot, checked before the render."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import OutputError, ReaderGoneError, UsageError
from . import STARTED
from .fallback import kept_elsewhere
from .pipes import STDOUT, Pipe

if TYPE_CHECKING:
    from ..farm.banded_picture import BandedPicture
    from ..output.image import Image
    from ..rendering.renderer import Renderer
    from ..scene.model import Scene


@dataclass
class Outputs:
    """Requested outputs. inputs: the scene, and the reference if any; pictures: files of the final image, with its
    AOVs; denoise: whether the raw images are stored as well; view, exposure: of .png images, view None for the
    scene's; force: whether read-only files are replaced; header: metadata in addition to the report; spool: one of
    `pictures` that is only needed for a video: it is not reported, and has no accompanying files; pipes: further
    destinations of the image, without accompanying files. If an output cannot be written, the others still are, and it
    is written to a fallback location if possible."""

    inputs: tuple[Path, ...]
    pictures: tuple[Path, ...]
    aovs: tuple[str, ...]
    denoise: bool
    view: str | None
    exposure: float
    report: Path | None
    plot: Path | None
    force: bool = False
    header: dict[str, Any] = field(default_factory=dict)
    spool: Path | None = None
    pipes: tuple[Pipe, ...] = ()
    _errors: list[OutputError] = field(default_factory=list)

    def of_scene(self, scene: Scene) -> Outputs:
        """Return the outputs with the layers that its light groups have as AOVs."""
        from ..aov_types import LIGHT_GROUPS, layer_names
        from ..scene.light_groups import light_groups

        if LIGHT_GROUPS not in self.aovs:
            return self
        return replace(self, aovs=tuple(layer_names(self.aovs, light_groups(scene))))

    @property
    def raws(self) -> tuple[Path, ...]:
        """Paths of the raw images, if any."""
        from ..output.denoise import raw_path

        return tuple(map(raw_path, self._kept)) if self.denoise else ()

    @property
    def _kept(self) -> tuple[Path, ...]:
        """Image files that are kept."""
        return tuple(path for path in self.pictures if path != self.spool)

    @property
    def beside(self) -> tuple[Path, ...]:
        """Paths of the AOVs that have files of their own."""
        from ..output.aov_files import files_beside

        return tuple(path for picture in self._kept for path in files_beside(picture, self.aovs).values())

    def check(self, checkpoint: Path | None = None) -> None:
        """Check before the render that the results can be written and do not replace any of its inputs."""
        from ..output.atomic_files import check_target
        from ..output.error_plots import check_plot
        from ..output.images import check_writable
        from ..output.view_transform import check_view

        check_view(self.view or "srgb", self.exposure)
        if self.aovs and (
            all(picture.suffix.lower() == ".hdr" for picture in self._kept)
            and all(pipe.suffix != ".exr" for pipe in self.pipes)
        ):
            raise UsageError(
                "an .hdr file, a video or a .png in a pipe cannot store AOVs; for --aov add an .exr or "
                ".png file with -o"
            )
        self.check_apart((), checkpoint)
        for pipe in self.pipes:
            pipe.check()
        for picture in [*self._kept, *self.raws, *self.beside]:
            check_writable(picture)
        for other in (self.report, checkpoint):
            if other is not None:
                check_target(other)
        if self.plot is not None:
            check_plot(self.plot)

    def check_unprotected(self, checkpoint: Path | None = None) -> None:
        """Check whether results would replace read-only files."""
        from ..output.atomic_files import check_unprotected

        older = checkpoint and Path(f"{checkpoint}~")
        for path in (*self._kept, *self.raws, *self.beside, self.report, self.plot, checkpoint, older):
            if path is not None:
                check_unprotected(path, self.force)

    def check_apart(self, inputs: Iterable[Path], checkpoint: Path | None = None) -> None:
        """Check that results do not overwrite files of the scene, or each other."""
        named = {
            "an image (-o)": self.pictures,
            "the raw image (--denoise)": self.raws,
            "an AOV (--aov)": self.beside,
            "the --report": (self.report,),
            "the --plot": (self.plot,),
            "the --checkpoint": (checkpoint,),
            "the previous checkpoint": (checkpoint and Path(f"{checkpoint}~"),),
        }
        taken = {os.path.realpath(path): "a file of the scene" for path in inputs}
        taken |= {os.path.realpath(path): what for path, what in zip(self.inputs, ("the scene", "the reference"))}
        for what, paths in named.items():
            for path in filter(None, paths):
                if before := taken.get(real := os.path.realpath(path)):
                    raise UsageError(
                        f"{path}: is both {before} and {what}, one of which would be lost; choose another file"
                    )
                taken[real] = what

    def save(self, image: Image, raw: bool = False) -> None:
        """Write the images, or the raw ones."""
        from ..output.aov_files import files_beside

        def save(path: Path, image: Image = image) -> None:
            image.save(path, view=self.view, exposure=self.exposure)

        alone = replace(image, aovs={})
        if self.spool is not None and not raw:
            self._write(self.spool, lambda path: save(path, alone), tell=False)
        for path in self.raws if raw else self._kept:
            if self._write(path, save):
                for other in files_beside(path, image.aovs).values():
                    self._tell(other)
        for pipe in () if raw else self.pipes:
            self._write_pipe(pipe, lambda path: save(path, alone if path.suffix == ".png" else image))

    def save_rows(self, banded: BandedPicture) -> None:
        """Write image files and report of an image that is stored in bands; raises OutputError at the end."""
        from ..output.report import header_of, write_report

        told = {**banded.summary(), "total_seconds": time.perf_counter() - STARTED}

        def save(path: Path) -> None:
            banded.save(path, self.view or told["view"], self.exposure, header_of(told))

        for path in self.pictures:
            self._write(path, save)
        for pipe in self.pipes:
            self._write_pipe(pipe, save)
        if self.report is not None:
            self._write(self.report, lambda path: write_report(path, told))
        self._raise_errors()

    def save_frame(self, image: Image) -> None:
        """Write the image files of a frame, including raw ones, and its report; raises OutputError at the end."""
        from ..output.report import write_report

        if image.raw is not None:
            pixels, alpha = image.raw[..., :3], image.raw[..., 3] if image.raw.shape[2] == 4 else None
            self.save(replace(image, pixels=pixels, alpha=alpha, raw=None, aovs={}), raw=True)
        self.save(image)
        if self.report is not None:
            self._write(self.report, lambda path: write_report(path, image.report))
        self._raise_errors()

    def save_measures(self, renderer: Renderer, image: Image) -> None:
        """Write report and plot, and then raise OutputError if anything could not be written."""
        from ..output.error_plots import plot_history
        from ..output.report import write_report

        if self.report is not None:
            total = {**image.report, "total_seconds": time.perf_counter() - STARTED}
            self._write(self.report, lambda path: write_report(path, total))
        if self.plot is not None:
            self._write(self.plot, lambda path: plot_history(path, renderer.scene.name, renderer.history))
        self._raise_errors()

    def _write(self, path: Path, write: Callable[[Path], object], tell: bool = True) -> bool:
        """Return whether the file was written; prints its path."""
        try:
            write(path)
        except OutputError as error:
            self._errors.append(kept_elsewhere(error, path, write))
            return False
        if tell:
            self._tell(path)
        return True

    def _write_pipe(self, pipe: Pipe, write: Callable[[Path], object]) -> None:
        try:
            pipe.write(write)
        except OutputError as error:
            self._errors.append(kept_elsewhere(error, Path(f"image{pipe.suffix}"), write))

    def _tell(self, path: Path) -> None:
        """Print the path of a result, unless standard output receives the image."""
        if all(pipe.path != STDOUT for pipe in self.pipes):
            click.echo(str(path))

    def _raise_errors(self) -> None:
        if self._errors:
            gone = all(isinstance(error, ReaderGoneError) for error in self._errors)
            raise (ReaderGoneError if gone else OutputError)("; ".join(map(str, self._errors)))
