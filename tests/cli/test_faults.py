"""`clrt render` with devices that are lost, hang or crash during the render: real drivers with faulty launches."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from clrt.device.launches.hang_watchdog import VARIABLE, patience
from clrt.errors import UsageError
from clrt.output.images import read_image

from ..c_library import compile_library
from .test_checkpoints import SCENE, arrays, worker_of

pytestmark = [pytest.mark.processes, pytest.mark.needs("gcc")]

FAULTY = Path(__file__).parents[1] / "device" / "faulty.c"
RENDER = ("render", "ball.toml", "--spp", "1024", "--checkpoint", "a.ck", "--checkpoint-every", "0", "-o", "a.exr")
ONE, TWO = ("--device", "0"), ("--device", "0", "--device", "0")


@pytest.fixture(scope="module")
def faulty(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compile faulty.c and return the library."""
    return compile_library(FAULTY, tmp_path_factory.mktemp("faulty") / "libfaulty.so", "-ldl")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the result of an undisturbed render on one device."""
    folder = tmp_path_factory.mktemp("whole")
    (folder / "ball.toml").write_text(SCENE)
    assert render(folder, *ONE).returncode == 0
    return folder


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "ball.toml").write_text(SCENE)
    return tmp_path


def render(folder: Path, *options: str, **more: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-P", "-m", "clrt", *RENDER, *options],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=60,
        env={**os.environ, **more},
    )


def fault(library: Path, kind: str, queue: int = 0, after: int = 6) -> dict[str, str]:
    return {
        "LD_PRELOAD": str(library),
        "FAULT": kind,
        "FAULT_QUEUE": str(queue),
        "FAULT_AFTER": str(after),
        "CLRT_HANG_SECONDS": "1",
    }


def assert_same(folder: Path, whole: Path) -> None:
    assert arrays(folder / "a.ck") == arrays(whole / "a.ck")
    assert read_image(folder / "a.exr").tobytes() == read_image(whole / "a.exr").tobytes()


@pytest.mark.parametrize("queue", [0, 1])
@pytest.mark.parametrize("kind", ["lost", "endless"])
def test_of_two_devices_one_ends_it_alone(folder: Path, whole: Path, faulty: Path, kind: str, queue: int) -> None:
    """The image equals that of a single device, and the exit code is that of success."""
    result = render(folder, *TWO, **fault(faulty, kind, queue))
    assert result.returncode == 0 and result.stderr.count("is excluded") == 1, result.stderr
    assert_same(folder, whole)


def test_of_two_devices_one_never_does_anything(folder: Path, whole: Path, faulty: Path) -> None:
    """Drivers may compile at the first launch, so its timeout is ten times as long, but finite."""
    result = render(folder, *TWO, **fault(faulty, "endless", 1, after=0) | {"CLRT_HANG_SECONDS": "0.3"})
    assert result.returncode == 0 and "has not finished a launch in 3 s" in result.stderr, result.stderr
    assert_same(folder, whole)


@pytest.mark.parametrize(
    ("kind", "words", "devices"),
    [
        ("lost", "the device failed", ONE),
        ("endless", "has not finished a launch in 1 s", ONE),
        ("hangs", "has not returned from a call in 1 s", ONE),
        ("hangs", "has not returned from a call in 1 s", TWO),
        ("crashes", "crashed (SIGABRT)", ONE),
    ],
)
def test_it_ends_in_a_message_and_goes_on(
    folder: Path, whole: Path, faulty: Path, kind: str, words: str, devices: tuple[str, ...]
) -> None:
    """If no device is left or a call does not return, the checkpoint stays valid and --resume finishes it."""
    result = render(folder, *devices, **fault(faulty, kind))
    assert result.returncode == 4 and words in result.stderr and "resume with --resume" in result.stderr, result.stderr
    assert "Traceback" not in result.stderr and result.stdout == ""
    again = render(folder, *devices, "--resume")
    assert again.returncode == 0, again.stderr
    assert_same(folder, whole)


def test_who_watches_is_killed_and_so_is_who_renders(folder: Path) -> None:
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "clrt", *RENDER, "--time", "600"],
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    child = worker_of(process)
    process.kill()
    process.wait()
    for _ in range(200):
        if not is_running(child):
            break
        time.sleep(0.02)
    assert not is_running(child)


def test_ended_from_outside(folder: Path) -> None:
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "clrt", *RENDER, "--time", "600"],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    os.kill(worker_of(process), signal.SIGKILL)
    _, messages = process.communicate(timeout=60)
    assert process.returncode == 128 + signal.SIGKILL and "SIGKILL" in messages and "Traceback" not in messages


def is_running(process: int) -> bool:
    status = Path(f"/proc/{process}/stat")
    return status.exists() and status.read_text().rpartition(")")[2].split()[0] != "Z"


@pytest.mark.parametrize("seconds", ["abc", "nan", "inf", "-1"])
def test_a_patience_that_is_none(seconds: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, seconds)
    with pytest.raises(UsageError, match=f"CLRT_HANG_SECONDS is '{seconds}'; it must be a number of seconds, or 0"):
        patience()
