"""Requirements for opening a window."""

from __future__ import annotations

import os
import sys

from ..errors import OutputError, UsageError

NO_DISPLAY = (
    "no window can be opened: {}. Run it on a desktop, through `ssh -X`, or on a virtual display "
    "(`xvfb-run -s '-screen 0 1280x800x24' clrt view SCENE`); `clrt render` needs no display"
)


def check_window() -> None:
    """Raise UsageError unless the packages of the extra `view` are installed, OutputError if there is no display."""
    try:
        import imgui_bundle  # noqa: F401
        import OpenGL  # noqa: F401
    except ImportError as fault:
        raise UsageError(
            f"the window needs the packages imgui-bundle and PyOpenGL ({fault}): install them with "
            "`pip install imgui-bundle PyOpenGL`"
        ) from fault
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise no_display("neither DISPLAY nor WAYLAND_DISPLAY is set")


def no_display(fault: str) -> OutputError:
    """Return the error that no window can be opened, with its reason and remedy."""
    return OutputError(NO_DISPLAY.format(fault))
