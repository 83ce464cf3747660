"""`clrt bake`: its files, report and display; Ctrl-C and errors leave nothing half-written."""

from __future__ import annotations

import json
import os
import pty
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from clrt.output.images import metadata_of, read_image

from .test_commands import clrt

SCENE = """
[environment]
color = [0.5, 0.6, 0.7]
[[mesh]]
name = "floor"
vertices = [[-1, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]]
faces = [[0, 1, 2], [0, 2, 3]]
uv = [[0, 0], [0, 1], [1, 1], [1, 0]]
[[sphere]]
center = [0, 0.5, 0]
radius = 0.5
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "room.toml").write_text(SCENE)
    return tmp_path


def test_it_writes_images_and_a_report(folder: Path) -> None:
    options = ("--size", "24x16", "--spp", "32", "--report", "floor.json")
    result = clrt("bake", "room.toml", "--mesh", "floor", "-o", "floor.exr", "-o", "floor.png", *options, cwd=folder)
    assert result.returncode == 0, result.stderr
    assert result.stdout.splitlines() == ["floor.exr", "floor.png", "floor.json"]
    report = json.loads((folder / "floor.json").read_text())
    pixels = read_image(folder / "floor.exr")
    assert pixels.shape == (16, 24, 3) and report["texels"] == 384 and report["spp"] == 32
    assert report["mean"] == pytest.approx(pixels.mean(), rel=1e-5)
    assert np.pi * 0.3 < pixels[..., 0].mean() < np.pi * 0.5
    assert metadata_of(folder / "floor.exr", "clrt:mesh") == "floor"
    last = [line for line in result.stderr.splitlines() if " %" in line][-1]
    assert last.startswith("100 %") and f"standard error {report['standard_error']:.3g}" in last


@pytest.mark.programs
def test_occlusion_in_a_png_is_linear(folder: Path) -> None:
    result = clrt(
        *("bake", "room.toml", "--mesh", "floor", "--what", "occlusion", "--size", "8", "--spp", "64"),
        *("--distance", "100", "-o", "ao.png", "--view", "raw", "-q"),
        cwd=folder,
    )
    assert (result.returncode, result.stderr) == (0, "")
    assert metadata_of(folder / "ao.png", "clrt:view") == "raw"


def test_progress_as_json(folder: Path) -> None:
    result = clrt(
        *("bake", "room.toml", "--mesh", "floor", "--size", "8", "--spp", "64", "-o", "a.exr", "--progress", "json"),
        cwd=folder,
    )
    lines = [json.loads(line) for line in result.stderr.splitlines()]
    states = [line for line in lines if "done" in line]
    assert [line["phase"] for line in lines if "done" not in line] == ["load", "build", "compile", "bake", "write"]
    assert [state["spp"] for state in states] == [16, 32, 64] and states[-1]["done"] == 1
    assert states[-1]["seconds_left"] == 0 and states[0]["standard_error"] > states[-1]["standard_error"] > 0


@pytest.mark.parametrize(
    "arguments, code, message",
    [
        (("--mesh", "flor", "-o", "a.exr"), 3, 'room has no mesh "flor"; it has "floor"'),
        (("--mesh", "floor", "-o", "a.bmp"), 6, "unknown image format .bmp"),
        (("--mesh", "floor", "-o", "room.toml"), 2, "room.toml: is both the scene and an image"),
        (("--mesh", "floor", "-o", "a.exr", "--size", "0"), 2, "is not a size"),
        (("--mesh", "floor", "-o", "a.exr", "--distance", "1"), 2, "distance limits occlusion"),
        (("--mesh", "floor", "-o", "a.exr", "--what", "oclusion"), 2, "occlusion"),
        (("-o", "a.exr"), 2, "--mesh"),
    ],
)
def test_mistakes_are_one_message(folder: Path, arguments: tuple[str, ...], code: int, message: str) -> None:
    before = sorted(folder.iterdir())
    result = clrt("bake", "room.toml", *arguments, cwd=folder)
    assert result.returncode == code and message in result.stderr and "Traceback" not in result.stderr
    assert sorted(folder.iterdir()) == before


@pytest.mark.processes
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_ends_it_in_one_line(folder: Path, number: signal.Signals) -> None:
    before = sorted(folder.iterdir())
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "clrt", "bake", "room.toml", "--mesh", "floor", "-o", "a.exr", "--spp", "1000000"],
        cwd=folder,
        text=True,
        stderr=subprocess.PIPE,
    )
    assert process.stderr is not None
    while " spp" not in process.stderr.readline():
        pass
    process.send_signal(number)
    _, messages = process.communicate(timeout=60)
    assert process.returncode == 130
    assert [line for line in messages.split("\n") if line and " spp" not in line] == ["interrupted"]
    assert sorted(folder.iterdir()) == before


@pytest.mark.processes
def test_the_bar_fits_its_terminal(folder: Path) -> None:
    controller, terminal = pty.openpty()
    command = (
        "bake",
        "room.toml",
        "--mesh",
        "floor",
        "-o",
        "a.exr",
        "--size",
        "32",
        "--spp",
        "64",
        "--progress",
        "bar",
    )
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "60"}
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "clrt", *command], cwd=folder, stdout=terminal, stderr=terminal, env=environment
    )
    os.close(terminal)
    shown = b""
    try:
        while piece := os.read(controller, 4096):
            shown += piece
    except OSError:  # the other end is closed
        pass
    os.close(controller)
    assert process.wait(60) == 0
    lines = [line.strip("\n") for line in shown.decode().replace("\r\n", "\r").split("\r")]
    assert max(map(len, lines)) <= 60
    final = [line.rstrip() for line in lines if line.startswith("100 %")]
    assert final and "64 spp" in final[0] and "standard error" in final[0] and "a.exr" in shown.decode()
