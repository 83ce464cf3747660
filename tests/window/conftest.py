"""A display without a screen, on which Mesa draws in software."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator

import pytest


@pytest.fixture(scope="session")
def display() -> Iterator[str]:
    """The name of a new one."""
    read, write = os.pipe()
    try:
        server = subprocess.Popen(["Xvfb", "-displayfd", str(write), "-screen", "0", "1280x800x24", "-nolisten", "tcp"],
                                  pass_fds=[write], stderr=subprocess.DEVNULL)
    except FileNotFoundError:
        pytest.fail("the window's tests open windows on Xvfb: install it (Debian's package xvfb)")
    os.close(write)
    with open(read) as number:
        yield f":{number.readline().strip()}"
    server.terminate()
    server.wait()


@pytest.fixture(autouse=True)
def window_environment(display: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Windows go there, whatever display there is."""
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.setenv("LIBGL_ALWAYS_SOFTWARE", "1")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
