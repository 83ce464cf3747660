"""`clrt render` that is suspended and continued, and whose terminal disappears."""

from __future__ import annotations

import json
import os
import pty
import select
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from clrt.awake import LONGEST
from clrt.device.launches.hang_watchdog import VARIABLE
from clrt.output.images import read_image

from .test_checkpoints import SCENE, worker_of

pytestmark = pytest.mark.processes

RENDER = (sys.executable, "-P", "-m", "clrt", "render", "ball.toml", "-o", "a.exr")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "ball.toml").write_text(SCENE)
    return tmp_path


def rendering(folder: Path, *options: str, **more: object) -> subprocess.Popen[str]:
    """Start a render and return once it has begun."""
    process = subprocess.Popen(
        [*RENDER, *options, "--progress", "json"],
        cwd=folder,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        **more,
    )  # type: ignore[call-overload]
    assert process.stderr is not None
    while "spp" not in json.loads(process.stderr.readline()):
        pass
    return process  # type: ignore[no-any-return]


@pytest.mark.parametrize("who", ["guard", "worker", "both"])
def test_suspended_it_goes_on(folder: Path, who: str) -> None:
    """If one or both processes are suspended, the image is written and the suspended time does not count."""
    goal, pause, start = 2.0, 2.5, time.perf_counter()
    process = rendering(folder, "--time", str(goal), "--report", "r.json", env={**os.environ, VARIABLE: "1"})
    worker = worker_of(process)
    stopped = [pid for pid in (process.pid, worker) if who == "both" or (pid == worker) == (who == "worker")]
    for number in (signal.SIGSTOP, signal.SIGCONT):
        for pid in stopped:
            os.kill(pid, number)
        if number == signal.SIGSTOP:
            time.sleep(pause)
    _, messages = process.communicate(timeout=60)
    assert process.returncode == 0 and read_image(folder / "a.exr").shape == (64, 96, 3), messages
    report = json.loads((folder / "r.json").read_text())
    assert report["stop_reason"] == "time"
    if worker in stopped:
        assert time.perf_counter() - start >= goal + pause - LONGEST


AT_ONCE = """
import os, sys, time
from clrt.cli.guard import guarded
guarded(lambda: "")
try:
    os.kill(os.getppid(), int(sys.argv[1]))
    time.sleep(20)
except KeyboardInterrupt:
    sys.exit(130)
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_interrupted_before_anything_is_loaded(number: signal.Signals) -> None:
    """All signals act like Ctrl-C as soon as the guard handles them."""
    done = subprocess.run([sys.executable, "-c", AT_ONCE, str(int(number))], stderr=subprocess.PIPE, text=True)
    assert (done.returncode, done.stderr) == (130, "")


def test_nohup_is_heeded(folder: Path) -> None:
    """A render started with SIGHUP ignored keeps ignoring it."""
    process = rendering(folder, "--spp", "4096", preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
    process.send_signal(signal.SIGHUP)
    assert process.wait(60) == 0


@pytest.mark.parametrize("progress", ["bar", "plain", "json"])
def test_terminal_goes_away(folder: Path, progress: str) -> None:
    """The image so far is written, although nothing can be printed."""
    pid, terminal = pty.fork()
    if not pid:
        os.chdir(folder)
        os.execv(sys.executable, [*RENDER, "--time", "600", "--checkpoint", "a.ck", "--progress", progress])
    said = b""
    while b"spp" not in said:
        if select.select([terminal], [], [], 0.1)[0]:
            said += os.read(terminal, 1 << 16)
    os.close(terminal)
    status = None
    with suppress(ChildProcessError):
        status = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    assert status == 130 and read_image(folder / "a.exr").shape == (64, 96, 3) and (folder / "a.ck").is_file()
