"""Choice of the progress display."""

from __future__ import annotations

import os
import sys

from .progress_reporter import JsonProgress, PlainProgress, Progress


def make_progress(kind: str | None, quiet: bool) -> Progress:
    """Return the display of that kind; by default a bar on an interactive terminal, otherwise plain lines.

    A bar needs a terminal: without one, plain lines are used instead.
    """
    if quiet:
        return Progress()
    if kind == "json":
        return JsonProgress()
    if sys.stderr.isatty() and (kind == "bar" or kind is None and _is_watched()):
        from .bar import BarProgress

        return BarProgress()
    return PlainProgress()


def _is_watched() -> bool:
    """Return whether the terminal can redraw lines and is not a CI log, by the variables TERM and CI."""
    terminal = os.environ.get("TERM", "xterm" if sys.platform == "win32" else "dumb")
    return terminal not in ("", "dumb", "unknown") and os.environ.get("CI", "false") in ("", "0", "false")
