"""Videos of pictures that are files already: .gif by pillow, .mp4 and .webm by ffmpeg, which is an extra."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import OutputError, UsageError
from .files import check_target, replacing

#: What ffmpeg is told: pictures near the eye's limit, and that colours are sRGB's, by the matrix of Rec. 709.
CODECS: dict[str, tuple[str, list[str]]] = {
    ".mp4": ("libx264", ["-crf", "17", "-movflags", "+faststart"]),
    ".webm": ("libvpx-vp9", ["-crf", "24", "-b:v", "0", "-row-mt", "1"])}
COLORS = ["-vf", "scale=out_color_matrix=bt709:out_range=tv,"
          "setparams=colorspace=bt709:color_primaries=bt709:color_trc=iec61966-2-1:range=tv"]
VIDEOS = (".gif", *CODECS)
#: Frames a second: browsers show faster ones at 10.
FASTEST_GIF = 50.0
#: Seconds that a frame lasts: 16 bits, in hundredths.
LONGEST_GIF = 655.35


def is_video(path: Path) -> bool:
    """Whether its name is a video's."""
    return path.suffix.lower() in VIDEOS


def check_video(path: Path, size: tuple[int, int], fps: float) -> None:
    """Raise OutputError or UsageError unless a video of this size, (width, height), can be written at `path`."""
    check_target(path)
    width, height = size
    if path.suffix.lower() == ".gif":
        if fps > FASTEST_GIF:
            raise UsageError(f"{path}: {fps:g} frames a second are more than the {FASTEST_GIF:g} that a .gif is shown "
                             "with; write an .mp4, or lower --fps")
        if 1 / fps > LONGEST_GIF:
            raise UsageError(f"{path}: {1 / fps:g} s are more than the {LONGEST_GIF:g} that a frame of a .gif can "
                             "last; write an .mp4, or raise --fps")
        return
    if find_spec("imageio_ffmpeg") is None:
        raise UsageError(f"{path}: {path.suffix} videos need ffmpeg: install it with `pip install 'clrt[video]'`, or "
                         "write a .gif")
    if width % 2 or height % 2:
        raise UsageError(f"{path}: {path.suffix} videos have an even width and height; use --size "
                         f"{width + width % 2}x{height + height % 2}")


def write_video(path: Path, pictures: Sequence[Path], fps: float) -> Path:
    """Joins .png files of one size to a video, in one step (see `replacing`). Returns `path`; raises OutputError."""
    with replacing(path) as temporary:
        try:
            (_write_gif if path.suffix.lower() == ".gif" else _write_by_ffmpeg)(temporary, pictures, fps)
        except (RuntimeError, ValueError, SyntaxError) as error:   # what imageio, ffmpeg and pillow raise
            raise OutputError(f"{path}: the video could not be made: {error}") from error
    return path


def _frames(pictures: Sequence[Path]) -> Iterator[NDArray[np.uint8]]:
    from imageio.v3 import imread

    for picture in pictures:
        yield imread(picture)[..., :3]


def _write_gif(path: Path, pictures: Sequence[Path], fps: float) -> None:
    """Frames last whole hundredths of a second, such that none begins more than half of one late or early."""
    from imageio.v3 import imopen

    starts = np.round(np.arange(len(pictures) + 1) * (100 / fps)).astype(int)
    options: dict[str, Any] = {"duration": (10 * np.diff(starts)).tolist(), "loop": 0}
    with imopen(path, "w", plugin="pillow") as file:
        for frame in _frames(pictures):
            file.write(frame, **options)


def _write_by_ffmpeg(path: Path, pictures: Sequence[Path], fps: float) -> None:
    from imageio.v2 import get_writer

    codec, options = CODECS[path.suffix.lower()]
    settings: dict[str, Any] = {"fps": fps, "codec": codec, "quality": None, "macro_block_size": 2,
                                "ffmpeg_log_level": "error", "output_params": [*options, *COLORS]}
    writer: Any = get_writer(path, format="FFMPEG", **settings)
    with writer:
        for frame in _frames(pictures):
            writer.append_data(frame)
