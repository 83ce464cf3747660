"""Images whose writing fails at any part, as on a full disk, are reported and do not replace the old file."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.errors import OutputError
from clrt.output.images import EXTENSIONS, read_image, write_image
from clrt.output.row_writer import BLOCK_ROWS, write_rows
from clrt.output.truncation import check_whole
from clrt.output.video import VIDEOS, write_video

if sys.platform == "win32":
    pytest.skip("there are no limits of a file's size", allow_module_level=True)

import resource  # noqa: E402


@contextmanager
def at_most(size: int) -> Iterator[None]:
    """Limit the size of files written by this process and its children."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def noise(height: int, width: int) -> NDArray[np.float32]:
    """Return pixels that hardly compress."""
    return np.random.default_rng(height).random((height, width, 3)).astype(np.float32)


@pytest.mark.parametrize("by_rows", [False, True], ids=["whole", "rows"])
@pytest.mark.parametrize("size", [(1, 1), (16, 24), (64, 80)], ids=str)
@pytest.mark.parametrize("suffix", EXTENSIONS)
def test_any_part_may_be_missing(tmp_path: Path, suffix: str, size: tuple[int, int], by_rows: bool) -> None:
    """The missing part ranges from one byte, in the C library's buffer, to the whole file; the old file stays."""
    path, pixels = tmp_path / f"a{suffix}", noise(*size)

    def write(values: NDArray[np.float32]) -> None:
        if by_rows:
            write_rows(path, size[::-1], (values[i : i + BLOCK_ROWS] for i in range(0, len(values), BLOCK_ROWS)))
        else:
            write_image(path, values)

    write(pixels)
    full, before = path.stat().st_size, read_image(path)
    for length in {0, 1, full // 2, full - 4097, full - 100, full - 13, full - 12, full - 1} - {-1}:
        if 0 <= length < full:
            with at_most(length), pytest.raises(OutputError, match=f"a{suffix}: cannot be written"):
                write(pixels)
            assert np.array_equal(read_image(path), before) and [*tmp_path.iterdir()] == [path]
    with at_most(full):
        write(pixels)


@pytest.mark.parametrize("suffix", EXTENSIONS)
def test_files_that_are_cut(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    write_image(path, noise(20, 30))
    check_whole(path)
    content = path.read_bytes()
    last = [] if suffix.startswith(".tif") else [len(content) - 1]  # a .tif ends with its tags, not with the image
    for length in (0, 5, len(content) // 2, *last):
        path.write_bytes(content[:length])
        with pytest.raises(OSError, match="its end is missing"):
            check_whole(path)


@pytest.mark.needs("imageio_ffmpeg")
@pytest.mark.parametrize("suffix", VIDEOS)
def test_videos(tmp_path: Path, suffix: str, capfd: pytest.CaptureFixture[str]) -> None:
    """There is one error, and nothing else is printed."""
    frames = [tmp_path / f"{number}.png" for number in range(3)]
    for number, frame in enumerate(frames):
        write_image(frame, noise(32 + number, 48)[:32])
    path = write_video(tmp_path / f"a{suffix}", frames, 10)
    full = path.stat().st_size
    for length in (0, 50, full // 2, full - 1):
        with at_most(length), pytest.raises(OutputError, match=f"a{suffix}: "):
            write_video(path, frames, 10)
        assert path.stat().st_size == full
    assert capfd.readouterr() == ("", "")
