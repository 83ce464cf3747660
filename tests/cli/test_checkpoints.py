"""`clrt render --checkpoint` in real processes: killed, interrupted, and on a full disk."""

from __future__ import annotations

import json
import random
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from clrt.output.images import read_image
from clrt.rendering.checkpoint.checkpoint_file import older, read_checkpoint
from clrt.rendering.checkpoint.saved_state import KINDS

from ..covering import others
from .test_commands import RUNS, Run, clrt

#: A point light and a constant environment between two spheres.
SCENE = """
[camera]
position = [0, 1, 6]
[render]
size = [96, 64]
[environment]
color = [0.5, 0.6, 0.7]
[[sphere]]
radius = 1
[[sphere]]
center = [0, -101, 0]
radius = 100
[[light]]
type = "point"
position = [2, 3, 2]
intensity = [20, 20, 20]
"""
RENDER = (
    "render",
    "ball.toml",
    "--checkpoint",
    "a.ck",
    "--resume",
    "--checkpoint-every",
    "0",
    "--progress",
    "json",
    "-o",
    "a.exr",
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "ball.toml").write_text(SCENE)
    return tmp_path


@pytest.fixture(scope="module")
def content(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Return a checkpoint with one sample per pixel."""
    folder = tmp_path_factory.mktemp("begun")
    (folder / "ball.toml").write_text(SCENE)
    assert clrt("render", "ball.toml", "--spp", "1", "--checkpoint", "a.ck", cwd=folder).returncode == 0
    return (folder / "a.ck").read_bytes()


def started(*options: str, cwd: Path) -> subprocess.Popen[str]:
    """Start RENDER and return once it reports that it renders."""
    process = subprocess.Popen(
        [sys.executable, "-m", "clrt", *RENDER, *options],
        cwd=cwd,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    while (line := process.stderr.readline()) and '"render"' not in line:
        assert process.poll() is None
    return process


def worker_of(process: subprocess.Popen[bytes] | subprocess.Popen[str]) -> int:
    """Return the id of the child process that renders."""
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
    for _ in range(500):
        if found := children.read_text().split():
            return int(found[0])
        time.sleep(0.01)
    raise AssertionError("nobody renders")


def arrays(path: Path) -> dict[str, bytes]:
    """Return all arrays of a checkpoint except the history, which contains times."""
    return {name: array.tobytes() for name, array in read_checkpoint(path, KINDS)[1].items() if name != "history"}


@pytest.mark.processes
@pytest.mark.parametrize(
    "kills, options", [(3, ["--spp", "2000"]), (2, ["--spp", "600", "--adaptive"])], ids=["even", "adaptive"]
)
def test_killed_at_any_moment_it_ends_as_if_it_were_not(folder: Path, kills: int, options: list[str]) -> None:
    """After several kills and resumes, film, samples and estimate equal those of an undisturbed render, bit for bit."""
    left_alone = folder / "alone"
    left_alone.mkdir()
    (left_alone / "ball.toml").write_text(SCENE)
    assert clrt(*RENDER, *options, cwd=left_alone).returncode == 0
    moments = random.Random(6)
    for _ in range(kills):
        process = started(*options, cwd=folder)
        time.sleep(moments.uniform(0, 0.7))
        process.kill()
        process.communicate()
    assert clrt(*RENDER, *options, cwd=folder).returncode == 0
    assert arrays(folder / "a.ck") == arrays(left_alone / "a.ck")
    assert read_image(folder / "a.exr").tobytes() == read_image(left_alone / "a.exr").tobytes()


@pytest.mark.parametrize("number", [signal.SIGINT, *others(signal.SIGTERM, signal.SIGHUP)])
def test_the_first_signal_keeps_everything(folder: Path, number: signal.Signals) -> None:
    process = started("--time", "600", "--report", "r.json", cwd=folder)
    time.sleep(0.2)
    process.send_signal(number)
    output, messages = process.communicate(timeout=60)
    assert output.split() == ["a.exr", "r.json"] and process.returncode == 130
    assert "ball: interrupted; run it with --resume to continue from a.ck" in messages
    report = json.loads((folder / "r.json").read_text())
    assert report["stop_reason"] == "interrupted" and read_image(folder / "a.exr").shape == (64, 96, 3)
    film = read_checkpoint(folder / "a.ck", KINDS)[1]["film"]
    assert int(film["count"].sum()) == report["samples"]
    seconds = str(report["seconds"] + 0.3)
    assert clrt(*RENDER, "--time", seconds, "--report", "r.json", cwd=folder).returncode == 0
    after = json.loads((folder / "r.json").read_text())
    assert after["stop_reason"] == "time" and after["samples"] > report["samples"]
    assert after["seconds"] >= report["seconds"] + 0.3, "what was rendered before counts"


def test_the_second_signal_ends_it_now(folder: Path) -> None:
    process = started("--time", "600", cwd=folder)
    for number in (signal.SIGSTOP, signal.SIGINT, signal.SIGTERM, signal.SIGCONT):  # both are pending as it continues
        process.send_signal(number)
    output, messages = process.communicate(timeout=60)
    assert process.returncode == 130 and output == "" and "Traceback" not in messages
    assert not (folder / "a.exr").exists() and not (folder / "a.ck.new").exists()


@pytest.mark.processes
def test_a_full_disk_ends_no_render(folder: Path) -> None:
    """File sizes are limited during the render: there is one warning, the previous checkpoint stays intact, and images
    that do not fit do not prevent others from being written."""
    options, limit = ("--size", "512x384", "--spp", "40", "-o", "a.png", "--report", "r.json"), 1_000_000
    assert clrt(*RENDER, "--size", "512x384", "--spp", "1", cwd=folder).returncode == 0
    process = started(*options, cwd=folder)
    resource.prlimit(worker_of(process), resource.RLIMIT_FSIZE, (limit, limit))
    output, messages = process.communicate(timeout=60)
    assert messages.count("checkpoint cannot be written") == 1 and "Traceback" not in messages
    film = read_checkpoint(folder / "a.ck", KINDS)[1]["film"]
    assert film.nbytes > limit and 1 <= film["count"].mean() < 40
    assert json.loads((folder / "r.json").read_text())["spp"] == 40 and read_image(folder / "a.png").shape[0] == 384
    assert (process.returncode, output.split()) == (6, ["a.png", "r.json"]) and "a.exr" in messages
    assert not list(folder.glob("*.new")) and not list(folder.glob(".clrt*"))


@pytest.mark.parametrize("run", RUNS)
@pytest.mark.parametrize(
    ("options", "code", "words"),
    [
        (("--resume",), 2, ["--resume", "--checkpoint"]),
        (("--checkpoint", "no/a.ck"), 6, ["no/a.ck"]),
        (("--checkpoint", "a.png", "-o", "a.png"), 2, ["a.png", "--checkpoint"]),
        (("--checkpoint", "a.ck", "--checkpoint-every", "-1"), 2, ["--checkpoint-every"]),
        (("--checkpoint", "a.ck", "--resume", "--seed", "3"), 3, ["a.ck", "seed 0 instead of 3", "--resume"]),
        (("--checkpoint", "b.ck", "--resume"), 3, ["b.ck", "not a checkpoint", "remove it"]),
    ],
)
def test_mistakes_end_in_one_message(
    folder: Path, content: bytes, run: Run, options: tuple[Any, ...], code: int, words: list[str]
) -> None:
    (folder / "a.ck").write_bytes(content)
    (folder / "b.ck").write_text("something else")
    result = run("render", "ball.toml", "--spp", "1", *options, cwd=folder)
    assert result.returncode == code and result.stdout == "" and "Traceback" not in result.stderr
    assert all(word in result.stderr for word in words), result.stderr
    assert (folder / "a.ck").read_bytes() == content and not older(folder / "a.ck").exists()
