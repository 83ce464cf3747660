"""A display is available, which all other window tests need."""

from __future__ import annotations

import socket

import pytest


@pytest.mark.needs("Xvfb")
def test_a_display_answers(display: str) -> None:
    """X servers listen on a socket whose name contains the display number."""
    with socket.socket(socket.AF_UNIX) as client:
        client.connect(f"/tmp/.X11-unix/X{display[1:]}")
