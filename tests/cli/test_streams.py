"""If standard streams are closed or full, files are written nevertheless."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from clrt.output.images import read_image, write_image

from ..covering import others
from .test_commands import SCENE

RENDER = "render ball.toml -q -o a.png -o a.exr --report r.json"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "ball.toml").write_text(SCENE)
    return tmp_path


def shell(arguments: str, redirection: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run clrt with a redirection; in a pipe, pipefail preserves its exit code."""
    line = f"{sys.executable} -m clrt {arguments} {redirection}"
    return subprocess.run(["bash", "-o", "pipefail", "-c", line], cwd=folder, capture_output=True, text=True)


@pytest.mark.parametrize(
    ("redirection", "code", "told"),
    [
        ("> /dev/full", 6, "error: standard output cannot be written (No space left on device)"),
        ("| true", 0, ""),
        (">&-", 0, ""),
        ("2>&-", 0, ""),
        (">&- 2>&-", 0, ""),
    ],
)
def test_all_files_are_written(folder: Path, redirection: str, code: int, told: str) -> None:
    result = shell(RENDER, redirection, folder)
    assert result.returncode == code and result.stderr.startswith(told), result.stderr
    assert len(result.stderr.splitlines()) == bool(told)
    for name in ("a.png", "a.exr"):
        assert read_image(folder / name).shape == (16, 24, 3)
    assert (folder / "r.json").read_text().startswith("{")


def test_progress_into_a_closed_stream(folder: Path) -> None:
    for options in ("", "--progress bar", "--progress json -v"):
        assert shell(f"render ball.toml -o a.png {options}", "2>&-", folder).stdout == "a.png\n"


@pytest.mark.parametrize(
    "arguments",
    [
        "info ball.toml",
        "render ball.toml -q --print-kernel",
        "--help",
        *others("devices --json", "cache", "doctor", "compare a.exr a.exr"),
    ],
)
def test_results_that_cannot_be_printed(folder: Path, arguments: str) -> None:
    """If there is no space, one error line and exit code 6; if the reader has closed the pipe, no message."""
    if "a.exr" in arguments:
        shell(RENDER, "", folder)
    full = shell(arguments, "> /dev/full", folder)
    assert full.returncode == 6 and full.stderr.splitlines()[-1].startswith("error: standard output cannot be written")
    closed = shell(arguments, "| true", folder)
    assert closed.returncode == 0 and "rror" not in closed.stderr and "Traceback" not in full.stderr


@pytest.mark.parametrize(
    "arguments", ["devices", "info ball.toml", "doctor", "cache", "render ball.toml -q", "debug ball.toml --pixel 1,1"]
)
def test_no_file_can_be_written(folder: Path, arguments: str) -> None:
    """If no file can be written, commands work, or fail with one error: the loader's, or the lack of a driver."""
    (folder / "limited.sh").write_text(f"ulimit -f 0\nexec {sys.executable} -m clrt {arguments}\n")
    result = subprocess.run(["bash", "limited.sh"], cwd=folder, capture_output=True, text=True)
    assert result.returncode in {0, 4} and "Traceback" not in result.stderr
    assert result.returncode == 0 or result.stderr.count("error: ") == 1


def test_an_interrupt_before_it_has_begun(folder: Path) -> None:
    """The interrupt comes while modules are imported; one of them raises it here."""
    (folder / "click.py").write_text("raise KeyboardInterrupt")
    result = shell("cache", "", folder)
    assert (result.returncode, result.stdout, result.stderr) == (130, "", "")


@pytest.mark.programs
@pytest.mark.parametrize("change", ["# ü\n", *others("", "\r\n")])
def test_a_scene_from_standard_input(folder: Path, change: str) -> None:
    """Relative file names are resolved from the working folder."""
    write_image(folder / "map.png", np.full((2, 2, 3), 0.5, np.float32))
    text = SCENE.replace("[0.8, 0.1, 0.1]", '{image = "map.png"}') + change
    (folder / "painted.toml").write_text(text, encoding="utf-8", newline="")
    for arguments, given in (
        ("render painted.toml -q -o a.exr", ""),
        ("render - -q -o b.exr", "< painted.toml"),
        ("render - -q", "< painted.toml"),
        ("info -", "< painted.toml"),
        ("debug - --pixel 3,3", "< painted.toml"),
    ):
        result = shell(arguments, given, folder)
        assert result.returncode == 0, result.stderr
    assert np.array_equal(read_image(folder / "a.exr"), read_image(folder / "b.exr"))
    assert (folder / "scene.png").is_file()


def test_a_mistake_in_standard_input(folder: Path) -> None:
    (folder / "wrong.toml").write_text(SCENE.replace("[[sphere]]", "[[spheer]]"))
    result = shell("render -", "< wrong.toml", folder)
    assert result.returncode == 3 and '\nerror: -: key "spheer"' in result.stderr, result.stderr
