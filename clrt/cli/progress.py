"""Progress on standard error: a bar for people, plain lines for logs, JSON lines for programs, or nothing."""

from __future__ import annotations

import json
import sys
from types import TracebackType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..rendering.renderer import State

PHASES = {"load": "loading the scene", "build": "building the tree", "compile": "compiling the kernel",
          "render": "rendering", "write": "writing"}


class Progress:
    """Shows nothing; the others override what they show."""

    def phase(self, name: str) -> None:
        """A phase of PHASES begins."""

    def state(self, state: State, spp: int | None, seconds: float | None) -> None:
        """A state was reached; spp, seconds: where the render will stop, as far as that is known."""

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        """Ends the display."""


class PlainProgress(Progress):
    """A line for each phase and state."""

    def phase(self, name: str) -> None:
        _say(PHASES[name])

    def state(self, state: State, spp: int | None, seconds: float | None) -> None:
        left = time_left(state, spp, seconds)
        _say(f"{describe(state)}" + (f"  about {left:.0f} s left" if left is not None else ""))


class JsonProgress(Progress):
    """One JSON object a line, with `phase`; in the phase "render" also the state."""

    def phase(self, name: str) -> None:
        _say(json.dumps({"phase": name}))

    def state(self, state: State, spp: int | None, seconds: float | None) -> None:
        values: dict[str, Any] = {"phase": "render", "spp": state.spp, "seconds": state.seconds, "noise": state.noise,
                                  "relmse": state.relmse, "samples_per_second": rate(state),
                                  "seconds_left": time_left(state, spp, seconds)}
        _say(json.dumps(values))


class BarProgress(Progress):
    """A bar that is redrawn in place, with rate, noise and time left."""

    def __init__(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress as Bar, TextColumn

        self._bar = Bar(TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[status]}"),
                        console=Console(stderr=True))
        self._task = self._bar.add_task("", total=None, status="")

    def phase(self, name: str) -> None:
        self._bar.update(self._task, description=PHASES[name])

    def state(self, state: State, spp: int | None, seconds: float | None) -> None:
        done = state.spp / spp if spp else state.seconds / seconds if seconds else 0.0
        left = time_left(state, spp, seconds)
        status = describe(state) + (f"  {left:.0f} s left" if left is not None else "")
        self._bar.update(self._task, total=1.0 if spp or seconds else None, completed=min(done, 1.0), status=status)

    def __enter__(self) -> Progress:
        self._bar.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self._bar.stop()


def make_progress(kind: str | None, quiet: bool) -> Progress:
    """The display of that kind; without one a bar on a terminal, else plain lines."""
    if quiet:
        return Progress()
    kind = kind or ("bar" if sys.stderr.isatty() else "plain")
    return {"bar": BarProgress, "plain": PlainProgress, "json": JsonProgress}[kind]()


def rate(state: State) -> float:
    """Samples a second since the render began."""
    return state.film.samples / max(state.seconds, 1e-9)


def time_left(state: State, spp: int | None, seconds: float | None) -> float | None:
    """Seconds until the render stops by `spp` or `seconds`, whatever comes first; None where neither is known."""
    ends = [] if seconds is None else [seconds - state.seconds]
    if spp is not None:
        ends.append((spp - state.spp) * state.seconds / state.spp)
    return max(0.0, min(ends)) if ends else None


def describe(state: State) -> str:
    """Samples, time, rate and error in one line."""
    error = "" if state.noise is None else f"  noise {state.noise:.4f}"
    if state.relmse is not None:
        error += f"  relMSE {state.relmse:.3g}"
    return f"{state.spp} spp  {state.seconds:.1f} s  {rate(state) / 1e6:.2f} Msamples/s{error}"


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)
