"""Headless display with software rendering by Mesa. If Xvfb is missing, no window test runs, and test_display.py
reports it."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from shutil import which

import pytest

collect_ignore_glob = [] if which("Xvfb") else ["test_[!d]*.py"]


@pytest.fixture(scope="session")
def display() -> Iterator[str]:
    """Start a display and yield its name."""
    read, write = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", "1280x800x24", "-nolisten", "tcp"],
        pass_fds=[write],
        stderr=subprocess.DEVNULL,
    )
    os.close(write)
    with open(read) as number:
        yield f":{number.readline().strip()}"
    server.terminate()
    server.wait()


@pytest.fixture(autouse=True)
def window_environment(display: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Open windows on that display instead of the one in the environment."""
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.setenv("LIBGL_ALWAYS_SOFTWARE", "1")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
