"""Options of `clrt render`, one table for each object that they become."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import click

from ..errors import UsageError
from ..rendering.checkpoint.policy import CheckpointPolicy
from .option_groups import flag
from .option_types import OneOf

FILE = click.Path(path_type=Path)


@dataclass(frozen=True)
class OutputOptions:
    """What is written, and how."""

    outputs: tuple[Path, ...] = flag(
        "-o",
        "--output",
        default=(),
        multiple=True,
        type=FILE,
        metavar="FILE",
        help="Image to write: .png, .jpg, .webp, .tif, .exr or .hdr; may be repeated. - is standard output as PNG, "
        "exr:- as OpenEXR. Default: <scene>.png in the current folder.",
    )
    aovs: tuple[str, ...] = flag(
        "--aov",
        default=(),
        multiple=True,
        metavar="NAME,...",
        help="AOVs to write: layers of an .exr, or files next to a .png. An unknown NAME lists them.",
    )
    denoise: bool = flag(
        "--denoise",
        default=False,
        is_flag=True,
        help="Denoise the image; the raw one is saved next to it as <stem>.raw<suffix>.",
    )
    reference: Path | None = flag(
        "--reference", type=FILE, metavar="FILE", help="Reference image to measure the error against."
    )
    report: Path | None = flag("--report", type=FILE, metavar="FILE.json", help="Write a report of the render.")
    plot: Path | None = flag("--plot", type=FILE, metavar="FILE.png", help="Plot error against time there.")
    view: str | None = flag(
        "--view",
        metavar="NAME",
        help="View transform of .png images: srgb, agx, pbr_neutral, reinhard, raw, aces, ocio:VIEW. Default: the "
        "scene's, which is pbr_neutral for a bare model.",
    )
    exposure: float = flag("--exposure", default=0.0, metavar="EV", help="Exposure of .png images, in stops.")
    force: bool = flag("--force", default=False, is_flag=True, help="Replace files that are read-only.")


@dataclass(frozen=True)
class StopOptions:
    """When the render stops: at the first condition that is met."""

    spp: int | None = flag("--spp", type=click.IntRange(min=1), help="Stop at this many samples per pixel.")
    seconds: float | None = flag("--time", type=float, metavar="SECONDS", help="Stop after this time.")
    error: float | None = flag("--error", type=float, help="Stop at this estimated error (root of relMSE).")
    error_percentile: float | None = flag(
        "--error-percentile",
        type=click.FloatRange(0, 100, min_open=True),
        metavar="PERCENT",
        help="Stop when this percentage of the tiles of 8x8 pixels has reached --error, not the whole image.",
    )

    def check(self) -> None:
        """Raise UsageError for conditions that cannot be met or contradict each other."""
        from ..rendering.stop_conditions import check_stops

        check_stops(self.spp, self.seconds, self.error)
        if self.error_percentile is not None and self.error is None:
            raise UsageError("--error-percentile is the part of the image that must reach --error; add --error")


@dataclass(frozen=True)
class SavingOptions:
    """When checkpoints are written, and whether the render resumes."""

    checkpoint: Path | None = flag(
        "--checkpoint",
        type=FILE,
        metavar="FILE",
        help="Save the state there regularly, so that --resume can continue; FILE~ is the previous one.",
    )
    checkpoint_every: float = flag(
        "--checkpoint-every",
        default=CheckpointPolicy.checkpoint_seconds,
        type=click.FloatRange(min=0),
        show_default=True,
        metavar="SECONDS",
        help="Time between checkpoints; longer if they would take more than 2 % of the time.",
    )
    preview_every: float | None = flag(
        "--preview-every",
        type=click.FloatRange(min=0, min_open=True),
        metavar="SECONDS",
        help="Write the image so far to its files this often, without AOVs and not denoised; less often if that took "
        "more than a tenth of the time.",
    )
    resume: bool = flag(
        "--resume", default=False, is_flag=True, help="Resume from --checkpoint; start afresh if it does not exist yet."
    )

    def advice(self) -> str:
        """Return how to continue from the checkpoint, if one exists, to be appended to a message."""
        kept = self.checkpoint is not None and self.checkpoint.exists()
        return f"; {self.checkpoint} holds the samples so far: resume with --resume" if kept else ""


@dataclass(frozen=True)
class DisplayOptions:
    """What is shown on the terminal."""

    progress_kind: str | None = flag(
        "--progress",
        type=OneOf(["bar", "plain", "json"]),
        help="Format of the progress display on standard error; default: bar on a terminal, else plain.",
    )
    print_kernel: bool = flag(
        "--print-kernel", default=False, is_flag=True, help="Print the kernel source that would run, and exit."
    )
    quiet: bool = flag("-q", "--quiet", default=False, is_flag=True, help="Show no progress and no warnings.")
