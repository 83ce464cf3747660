"""There is a display, which all other tests of the window need."""

from __future__ import annotations

import socket

import pytest


@pytest.mark.needs("Xvfb")
def test_a_display_answers(display: str) -> None:
    """X servers listen at a socket that has the number of their display in its name."""
    with socket.socket(socket.AF_UNIX) as client:
        client.connect(f"/tmp/.X11-unix/X{display[1:]}")
