"""Previews: image files appear while the image renders, whole at any moment, and end as they would without."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from clrt.output.images import read_image

SCENE = Path(__file__).parents[2] / "scenes" / "cornell.toml"
RENDER = [sys.executable, "-P", "-m", "clrt", "render", str(SCENE), "--size", "64x64", "--progress", "plain"]


def run(folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([*RENDER, *options], cwd=folder, capture_output=True, text=True)


@pytest.mark.processes
def test_a_file_is_whole_at_any_moment(tmp_path: Path) -> None:
    """Reads the file as often as possible: every image is finite, of the whole size, and they converge."""
    name = tmp_path / "a.exr"
    reference = run(tmp_path, "--spp", "1024", "-o", "reference.exr")
    assert reference.returncode == 0, reference.stderr
    job = subprocess.Popen([*RENDER, "--time", "2", "--preview-every", ".02", "-o", str(name), "--seed", "5"])
    seen: dict[tuple[int, int], np.ndarray] = {}
    while job.poll() is None:
        if name.exists():
            written = name.stat()  # the number of a file that was replaced is used again
            seen[written.st_ino, written.st_mtime_ns] = read_image(name)
        time.sleep(0.01)
    assert job.returncode == 0 and len(seen) >= 3
    wanted = read_image(tmp_path / "reference.exr")
    errors = [float(np.mean((image - wanted) ** 2)) for image in seen.values()]
    assert all(np.isfinite(image).all() and image.shape == wanted.shape for image in seen.values())
    assert errors[-1] < 0.7 * errors[0]
    assert not [path for path in tmp_path.iterdir() if path.name not in ("a.exr", "reference.exr")]


def test_the_final_image_is_the_same(tmp_path: Path) -> None:
    for name, options in (("with.exr", ["--preview-every", ".01"]), ("without.exr", [])):
        done = run(tmp_path, "--spp", "200", "-o", name, *options)
        assert done.returncode == 0 and done.stdout.split() == [name], done.stderr
    np.testing.assert_array_equal(read_image(tmp_path / "with.exr"), read_image(tmp_path / "without.exr"))


@pytest.mark.processes
def test_a_file_that_cannot_be_written(tmp_path: Path) -> None:
    """The folder is gone during the render: one warning, and the final image is kept elsewhere."""
    folder = tmp_path / "gone"
    folder.mkdir()
    job = subprocess.Popen(
        [*RENDER, "--time", "2", "--preview-every", ".1", "-o", str(folder / "a.png")],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        text=True,
    )
    while not (folder / "a.png").exists() and job.poll() is None:
        time.sleep(0.01)
    (folder / "a.png").unlink()
    folder.rmdir()
    told = job.communicate()[1]
    assert told.count("continues without previews") == 1 and "Traceback" not in told, told
    assert job.returncode == 6 and "written to" in told, told


@pytest.mark.parametrize("wrong", ["0", "-1", "x"])
def test_wrong_intervals(tmp_path: Path, wrong: str) -> None:
    done = run(tmp_path, "--preview-every", wrong)
    assert done.returncode == 2 and "--preview-every" in done.stderr


def test_frames_have_no_previews(tmp_path: Path) -> None:
    done = run(tmp_path, "--turntable", "3", "--preview-every", "1", "-o", "f_####.png")
    assert done.returncode == 2 and "preview-every" in done.stderr and not list(tmp_path.iterdir())
