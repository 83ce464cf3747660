"""Videos from image files: .gif by pillow, .mp4 and .webm by ffmpeg, an optional dependency.

Frames may have unassociated alpha: a .webm stores it, a .gif whether it is at least ½, an .mp4 shows them over black.
"""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import suppress
from fractions import Fraction
from importlib.util import find_spec
from io import BytesIO
from itertools import chain
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import OutputError, UsageError
from .atomic_files import check_target, replacing

#: ffmpeg's options: nearly lossless quality, and sRGB colors with the matrix of Rec. 709.
CODECS: dict[str, tuple[str, list[str]]] = {
    ".mp4": ("libx264", ["-crf", "17", "-movflags", "+faststart"]),
    ".webm": ("libvpx-vp9", ["-crf", "24", "-b:v", "0", "-row-mt", "1"]),
}
COLORS = [
    "-vf",
    "scale=out_color_matrix=bt709:out_range=tv,"
    "setparams=colorspace=bt709:color_primaries=bt709:color_trc=iec61966-2-1:range=tv",
]
VIDEOS = (".gif", *CODECS)
#: Formats of pixels by channels, as they are read and stored; and options for alpha, which VP9 codes as a second video.
PIXELS = {3: ("rgb24", "yuv420p"), 4: ("rgba", "yuva420p")}
WITH_ALPHA = ["-auto-alt-ref", "0"]
#: Maximum frames per second; browsers show faster ones at 10.
FASTEST_GIF = 50.0
#: Maximum duration of a frame in seconds: 16 bits, in hundredths.
LONGEST_GIF = 655.35


def is_video(path: Path) -> bool:
    """Return whether the path has the suffix of a video."""
    return path.suffix.lower() in VIDEOS


def check_video(path: Path, size: tuple[int, int], fps: float) -> None:
    """Raise OutputError or UsageError unless a video of this size, (width, height), can be written at `path`."""
    check_target(path)
    width, height = size
    if path.suffix.lower() == ".gif":
        if fps > FASTEST_GIF:
            raise UsageError(
                f"{path}: {fps:g} frames per second are more than the {FASTEST_GIF:g} that a .gif "
                "supports; write an .mp4, or lower --fps"
            )
        if 1 / fps > LONGEST_GIF:
            raise UsageError(
                f"{path}: {1 / fps:g} s are more than the {LONGEST_GIF:g} s that a frame of a .gif can "
                "last; write an .mp4, or raise --fps"
            )
        return
    if find_spec("imageio_ffmpeg") is None:
        raise UsageError(
            f"{path}: {path.suffix} videos need ffmpeg: run `pip install 'imageio[ffmpeg]'`, or write a .gif"
        )
    if width % 2 or height % 2:
        raise UsageError(
            f"{path}: {path.suffix} videos need an even width and height; use --size "
            f"{width + width % 2}x{height + height % 2}"
        )


def write_video(path: Path, pictures: Sequence[Path], fps: float) -> Path:
    """Join .png files of one size to a video, atomically (see `replacing`). Returns `path`; raises OutputError."""
    with replacing(path) as temporary:
        try:
            (_write_gif if path.suffix.lower() == ".gif" else _write_by_ffmpeg)(temporary, pictures, fps)
        except (RuntimeError, ValueError, SyntaxError) as error:  # raised by imageio, ffmpeg and pillow
            raise OutputError(f"{path}: the video cannot be written: {error}") from error
    return path


def _frames(pictures: Sequence[Path]) -> Iterator[NDArray[np.uint8]]:
    """Yield the frames, (height, width, 3), or 4 with alpha."""
    from imageio.v3 import imread

    for picture in pictures:
        yield imread(picture)


def _over_black(frame: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a frame without alpha, as viewers show it on black."""
    if frame.shape[2] == 3:
        return frame
    return np.round(frame[..., :3] * (frame[..., 3:] / np.float32(255))).astype(np.uint8)


def _cut_out(frame: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a frame with alpha rounded to 0 or 255, if it has any."""
    levels = frame.copy()
    levels[..., 3:] = np.where(frame[..., 3:] < 128, 0, 255)
    return levels


def _write_gif(path: Path, pictures: Sequence[Path], fps: float) -> None:
    """Write a .gif. Frame durations are whole hundredths of a second, with each start rounded to the nearest one.

    It is encoded in memory, since imageio retries if a file cannot be written, and prints the error.
    """
    from imageio.v3 import imopen

    starts = np.round(np.arange(len(pictures) + 1) * (100 / fps)).astype(int)
    options: dict[str, Any] = {"duration": (10 * np.diff(starts)).tolist(), "loop": 0}
    encoded = BytesIO()
    with imopen(encoded, "w", plugin="pillow", extension=".gif") as file:
        for frame in _frames(pictures):
            if frame.shape[2] == 4:
                options["disposal"] = 2  # else frames would show through the next one
            file.write(_cut_out(frame), **options)
    path.write_bytes(encoded.getvalue())


def _write_by_ffmpeg(path: Path, pictures: Sequence[Path], fps: float) -> None:
    """Write a video by ffmpeg. Raises OSError with ffmpeg's error message, which imageio's writer does not report."""
    from imageio_ffmpeg import get_ffmpeg_exe

    codec, options = CODECS[path.suffix.lower()]
    keeps_alpha = path.suffix.lower() == ".webm"
    frames = (frame if keeps_alpha else _over_black(frame) for frame in _frames(pictures))
    first = next(frames)
    height, width, channels = first.shape
    given, stored = PIXELS[channels]
    command = [
        get_ffmpeg_exe(),
        "-y",
        "-v",
        "error",
        "-f",
        "rawvideo",
        "-pix_fmt",
        given,
        "-s",
        f"{width}x{height}",
        "-r",
        str(Fraction(fps).limit_denominator()),
        "-i",
        "-",
        "-vcodec",
        codec,
        "-pix_fmt",
        stored,
        *options,
        *(WITH_ALPHA if channels == 4 else []),
        *COLORS,
        str(path),
    ]
    with TemporaryFile() as errors:
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=errors) as ffmpeg:
            assert ffmpeg.stdin is not None
            with suppress(BrokenPipeError):  # ffmpeg has exited
                for frame in chain([first], frames):
                    ffmpeg.stdin.write(frame.tobytes())
        if ffmpeg.returncode:
            errors.seek(0)
            lines = errors.read().decode(errors="replace").splitlines()
            code = f"ffmpeg exited with code {ffmpeg.returncode}"
            raise OSError(re.sub(r"^\[.*?\] ", "", lines[0]) if lines else code)
