"""Progress on standard error: a bar for people, plain lines for logs, JSON lines for programs, or nothing."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..rendering.renderer import State

PHASES = {"load": "loading the scene", "build": "building the tree", "compile": "compiling the kernel",
          "render": "rendering", "write": "writing", "denoise": "denoising"}


class Progress:
    """Shows nothing; the others override what they show."""

    def phase(self, name: str) -> None:
        """A phase of PHASES begins."""

    def state(self, state: State, goal: Goal) -> None:
        """A state was reached on the way to the goal."""

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        """Ends the display."""


class PlainProgress(Progress):
    """A line for each phase and state."""

    def phase(self, name: str) -> None:
        _say(PHASES[name])

    def state(self, state: State, goal: Goal) -> None:
        left = time_left(state, goal)
        _say(f"{describe(state)}" + (f"  about {left:.0f} s left" if left is not None else ""))


class JsonProgress(Progress):
    """One JSON object a line, with `phase`; in the phase "render" also the state."""

    def phase(self, name: str) -> None:
        _say(json.dumps({"phase": name}))

    def state(self, state: State, goal: Goal) -> None:
        values: dict[str, Any] = {"phase": "render", "spp": state.spp, "seconds": state.seconds, "noise": state.noise,
                                  "relmse": state.relmse, "samples_per_second": rate(state),
                                  "seconds_left": time_left(state, goal)}
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

    def state(self, state: State, goal: Goal) -> None:
        left = time_left(state, goal)
        status = describe(state) + (f"  {left:.0f} s left" if left is not None else "")
        self._bar.update(self._task, total=1.0, completed=goal.done(state), status=status)

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


@dataclass(frozen=True)
class Goal:
    """Where a render will stop, as far as that is known."""

    spp: int | None
    seconds: float | None
    error: float | None

    def done(self, state: State) -> float:
        """The part that is done, 0 to 1."""
        parts = [state.spp / self.spp] if self.spp else []
        parts += [state.seconds / self.seconds] if self.seconds else []
        parts += [(self.error / state.noise) ** 2] if self.error and state.noise else []
        return min(1.0, max(parts, default=0.0))


def time_left(state: State, goal: Goal) -> float | None:
    """Seconds until the render stops by what comes first; None where nothing is known. Noise² falls as 1/samples."""
    ends = [] if goal.seconds is None else [goal.seconds - state.seconds]
    if goal.spp is not None:
        ends.append((goal.spp - state.spp) * state.seconds / max(1, state.spp))
    if goal.error is not None and state.noise:
        ends.append(((state.noise / goal.error) ** 2 - 1) * state.seconds)
    return max(0.0, min(ends)) if ends else None


def describe(state: State) -> str:
    """Samples, time, rate and error in one line."""
    error = "" if state.noise is None else f"  noise {state.noise:.4f}"
    if state.relmse is not None:
        error += f"  relMSE {state.relmse:.3g}"
    return f"{state.spp} spp  {state.seconds:.1f} s  {rate(state) / 1e6:.2f} Msamples/s{error}"


def _say(line: str) -> None:
    try:
        print(line, file=sys.stderr, flush=True)
    except OSError:
        return  # who listened has gone; the render goes on
