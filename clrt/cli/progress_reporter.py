"""Progress on standard error: a bar for terminals, plain lines for logs, JSON lines for programs, or nothing."""

from __future__ import annotations

import logging
import time
from math import floor
from types import TracebackType
from typing import TYPE_CHECKING, Any

from .goal import FrameSpeed, Goal, RenderSpeed, duration, time_left
from .streams import tell

if TYPE_CHECKING:
    from ..baking.bake import BakeState
    from ..rendering.renderer import State

PHASES = {
    "connect": "starting the workers",
    "load": "loading the scene",
    "build": "building the BVH",
    "compile": "compiling the kernel",
    "train": "compiling the kernels and training the guiding field",
    "render": "rendering",
    "bake": "baking",
    "write": "writing",
    "denoise": "denoising",
}


class Progress:
    """Progress that shows nothing; base class of the others."""

    def __init__(self) -> None:
        self._pace, self._frames = RenderSpeed(), FrameSpeed()
        self._all_left: float | None = None
        self._workers: list[dict[str, Any]] = []
        self._bands = -1

    def workers(self, shares: list[dict[str, Any]]) -> None:
        """Set what each of several workers has done so far (`Picture.shares`)."""
        self._workers = [share for share in shares if "worker" in share]

    def _left(self, state: State, goal: Goal) -> float | None:
        self._pace.add(state.seconds, state.film.samples)
        return time_left(state, goal, self._pace.rate)

    def _told(self, state: State, goal: Goal) -> str:
        told = [*figures(state, self._pace.rate), describe_workers(self._workers)]
        return goal.percent(state) + "  ".join(filter(None, told))

    def phase(self, name: str, device: str = "", device_bytes: int = 0) -> None:
        """Begin a phase of PHASES; for "render" with the device and the memory it uses there."""

    def frame(self, number: int, done: int, count: int) -> None:
        """Begin the frame with this number; `done` of the `count` frames to render are finished."""
        self._pace = RenderSpeed()
        self._all_left = self._frames.left(time.monotonic(), done, count)

    def state(self, state: State, goal: Goal) -> None:
        """Show a state of the render."""

    def bands(self, done: int, count: int) -> None:
        """Show how many bands of a large image are finished."""

    def bake(self, state: BakeState) -> None:
        """Show a state of a bake."""

    def __enter__(self) -> Progress:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the display."""


class PlainProgress(Progress):
    """Progress as a line for each phase and state."""

    def phase(self, name: str, device: str = "", device_bytes: int = 0) -> None:
        tell(PHASES[name] + where(device, device_bytes))

    def frame(self, number: int, done: int, count: int) -> None:
        super().frame(number, done, count)
        left = "" if self._all_left is None else f", about {duration(self._all_left)} left for all"
        tell(f"frame {number}, {done + 1} of {count}{left}")

    def state(self, state: State, goal: Goal) -> None:
        left = self._left(state, goal)
        tell(self._told(state, goal) + (f"  about {duration(left)} left" if left is not None else ""))

    def bands(self, done: int, count: int) -> None:
        if done != self._bands:
            tell(f"{done} of {count} bands")
        self._bands = done

    def bake(self, state: BakeState) -> None:
        percent, left = f"{floor(100 * state.done):3} %", f"about {duration(bake_left(state))} left"
        tell("  ".join([percent, *bake_figures(state), left]))


class JsonProgress(Progress):
    """Progress as JSON objects, one per line, with `phase`; in the phase "render" with the state. Includes warnings."""

    def __init__(self) -> None:
        super().__init__()
        self._phase = "load"
        self._log = JsonLog(self)

    def warning(self, message: str) -> None:
        """Show a logged message."""
        _tell_json({"phase": self._phase, "warning": message})

    def __enter__(self) -> Progress:
        logging.getLogger().addHandler(self._log)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        logging.getLogger().removeHandler(self._log)

    def phase(self, name: str, device: str = "", device_bytes: int = 0) -> None:
        self._phase = name
        _tell_json({"phase": name, **({"device": device, "device_bytes": device_bytes} if device else {})})

    def frame(self, number: int, done: int, count: int) -> None:
        super().frame(number, done, count)
        values = {"phase": "frame", "frame": number, "done": done, "frames": count, "seconds_left": self._all_left}
        _tell_json(values)

    def state(self, state: State, goal: Goal) -> None:
        left = self._left(state, goal)
        values: dict[str, Any] = {
            "phase": "render",
            "spp": state.spp,
            "seconds": state.seconds,
            "noise": state.noise,
            "relmse": state.relmse,
            "samples_per_second": self._pace.rate,
            "seconds_left": left,
        }
        if self._workers:
            values["workers"] = self._workers
        _tell_json(values)

    def bands(self, done: int, count: int) -> None:
        if done != self._bands:
            _tell_json({"phase": "render", "bands": done, "of": count})
        self._bands = done

    def bake(self, state: BakeState) -> None:
        _tell_json({"phase": "bake", **state._asdict(), "seconds_left": bake_left(state)})


def _tell_json(values: dict[str, Any]) -> None:
    from ..output.json_text import json_text  # imports numpy, which is being loaded in another thread

    tell(json_text(values))


class JsonLog(logging.Handler):
    """Log handler that forwards messages to a display."""

    def __init__(self, progress: JsonProgress) -> None:
        super().__init__()
        self._progress = progress

    def emit(self, record: logging.LogRecord) -> None:
        """Forward a record to the display."""
        self._progress.warning(self.format(record))


def where(device: str, device_bytes: int) -> str:
    """Describe the device and its memory use."""
    return f" on {device}, {device_bytes / 2**20:.1f} MiB" if device else ""


def figures(state: State, rate: float) -> list[str]:
    """Return samples, time, samples per second, and errors if known."""
    told = [f"{state.spp} spp", f"{state.seconds:.1f} s", f"{rate / 1e6:.2f} Msamples/s"]
    tiles = "" if state.tile_noise is None else f" (tiles {state.tile_noise:.4f})"
    if state.noise is not None:
        told.append(f"noise {state.noise:.4f}{tiles}")
    if state.relmse is not None:
        told.append(f"relMSE {state.relmse:.3g}")
    return told


def bake_figures(state: BakeState) -> list[str]:
    """Return samples per texel, errors and time of a bake."""
    error = f"standard error {state.standard_error:.3g} ({100 * state.noise:.2g} %)"
    return [f"{state.spp:.0f} spp", error, f"{state.seconds:.1f} s"]


def bake_left(state: BakeState) -> float:
    """Return the seconds until a bake ends, if the rest is as fast."""
    return state.seconds * (1 - state.done) / max(state.done, 1e-9)


def describe_workers(workers: list[dict[str, Any]]) -> str:
    """Describe how many workers are active, and the rates of the slowest and the fastest."""
    rates = [worker["samples_per_second"] / 1e6 for worker in workers if not worker["lost"]]
    return f"{len(rates)} workers, {min(rates):.2f} to {max(rates):.2f} Msamples/s each" if rates else ""
