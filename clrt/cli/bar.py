"""Progress as one line of a terminal, redrawn in place with plain characters: no escape sequences, no cursor that stays
hidden if the process is killed, no wrapping."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from contextlib import suppress
from math import floor
from types import TracebackType
from typing import TYPE_CHECKING, Any, TextIO, cast

from .goal import Goal, duration
from .progress_reporter import PHASES, Progress, bake_figures, bake_left, describe_workers, figures, where

if TYPE_CHECKING:
    from ..baking.bake import BakeState
    from ..rendering.renderer import State

#: Width of the bar in characters, and default number of terminal columns if it is unknown.
BAR, COLUMNS = 20, 80


class StatusLine:
    """The terminal line that contains the cursor."""

    def __init__(self, terminal: TextIO) -> None:
        self._terminal, self._shown = terminal, 0

    def show(self, parts: Iterable[str]) -> None:
        """Replace the line's text by as many of the parts as fit, the first ones first."""
        room = columns(self._terminal) - 1  # at the last column some terminals wrap
        text = fitted(parts, room)
        self._put("\r" + text.ljust(min(self._shown, room)))
        self._shown = len(text)

    def erase(self) -> None:
        """Clear the line."""
        if self._shown:
            self._put("\r" + " " * min(self._shown, columns(self._terminal) - 1) + "\r")
        self._shown = 0

    def keep(self) -> None:
        """Keep the text and continue on the next line."""
        if self._shown:
            self._put("\n")
        self._shown = 0

    def _put(self, text: str) -> None:
        with suppress(OSError):  # the terminal may be closed
            self._terminal.write(text)
            self._terminal.flush()


class _Other:
    """A stream to the same terminal: its output replaces the status line."""

    def __init__(self, stream: TextIO, line: StatusLine) -> None:
        self._stream, self._line = stream, line

    def write(self, text: str) -> int:
        """Erase the status line, then write the text."""
        self._line.erase()
        return self._stream.write(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


class BarProgress(Progress):
    """A bar with time left, samples, error and rate. The final state stays above the names of the files written."""

    def __init__(self) -> None:
        super().__init__()
        self._line = StatusLine(sys.stderr)
        self._streams = sys.stdout, sys.stderr
        self._frame, self._where = "", ""
        self._ended: list[str] = []

    def phase(self, name: str, device: str = "", device_bytes: int = 0) -> None:
        self._where = where(device, device_bytes).strip()
        if name == "write" and self._ended:
            self._line.show(self._ended)
            self._line.keep()
            self._ended = []
        self._line.show([self._frame + PHASES[name], self._where])

    def frame(self, number: int, done: int, count: int) -> None:
        super().frame(number, done, count)
        left = "" if self._all_left is None else f", {duration(self._all_left)} left"
        self._frame = f"frame {number}, {done + 1} of {count}{left}: "

    def state(self, state: State, goal: Goal) -> None:
        left = self._left(state, goal)
        samples, seconds, rate, *errors = figures(state, self._pace.rate)
        percent, told = goal.percent(state).strip(), [samples, *errors, seconds, rate, describe_workers(self._workers)]
        self._ended = [self._frame + percent, *told]
        self._line.show(
            [
                f"{self._frame}{PHASES['render']}",
                percent,
                bar(goal.done(state)),
                "" if left is None else f"{duration(left)} left",
                *told,
                self._where,
            ]
        )

    def bands(self, done: int, count: int) -> None:
        self._line.show([PHASES["render"], f"{done} of {count} bands", bar(done / count)])

    def bake(self, state: BakeState) -> None:
        percent, told = f"{floor(100 * state.done)} %", bake_figures(state)
        self._ended = [percent, *told]
        left = f"{duration(bake_left(state))} left"
        self._line.show([PHASES["bake"], percent, bar(state.done), left, *told, self._where])

    def __enter__(self) -> Progress:
        stdout, stderr = self._streams
        sys.stderr = cast(TextIO, _Other(stderr, self._line))
        if stdout.isatty():
            sys.stdout = cast(TextIO, _Other(stdout, self._line))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._line.erase()
        sys.stdout, sys.stderr = self._streams


def bar(done: float) -> str:
    """Draw a progress bar. done: from 0 to 1."""
    full = int(BAR * done)
    return f"[{'#' * full}{'-' * (BAR - full)}]"


def fitted(parts: Iterable[str], room: int) -> str:
    """Join the nonempty parts that fit into `room` columns, in order; the first one is truncated."""
    line = ""
    for part in filter(None, parts):
        longer = f"{line}  {part}" if line else part[:room]
        line = longer if len(longer) <= room else line
    return line


def columns(terminal: TextIO) -> int:
    """Return the terminal's number of columns, or COLUMNS of the environment if that is smaller."""
    with suppress(OSError, ValueError):
        found = os.get_terminal_size(terminal.fileno()).columns or COLUMNS
        asked = os.environ.get("COLUMNS", "")
        return min(found, int(asked)) if asked.isdecimal() and int(asked) else found
    return COLUMNS
