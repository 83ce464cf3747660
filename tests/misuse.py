"""Random sequences of valid and invalid public calls with threads, interrupts, forks and copies.

    python -m tests.misuse 600 --first 40     # run for 600 seconds, from sequence 40 on

Sequence i makes the same calls in every run, in its own process, which must exit by itself; after every call the
same queries and renders must give the same results as at its start.
"""

from __future__ import annotations

import argparse
import copy
import faulthandler
import gc
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
import warnings
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

import clrt
from clrt.errors import ClrtError, UsageError

CALLS = 30
SECONDS = 240  # after which a sequence counts as hung
SCENE = Path(__file__).parents[1] / "scenes" / "cornell.toml"
SIZE, SPP = (24, 16), 4
LAYOUTS = ("bvh8", "bvh2", "cwbvh", "packs", "list", None)
WRONG: tuple[Any, ...] = (None, "x", -1, np.nan, [], [[1, 2]], np.zeros((2, 4)), {"a": 1}, object(), np.array(["a"]))


class Interrupted(BaseException):
    """Exception raised by the signal handler at an arbitrary point of the program."""


class Sequence:
    """Calls that one process makes, with `check` after each."""

    def __init__(self, number: int) -> None:
        self.rng = np.random.default_rng(number)
        data = np.random.default_rng(7)
        self.vertices, self.faces = data.random((400, 3)), data.integers(0, 400, (700, 3))
        self.rays = data.random((3000, 3)), data.normal(size=(3000, 3))
        self.query, self.scene = clrt.RayQuery(self.vertices, self.faces), clrt.load(SCENE)
        self.hits, self.all_hits = self.query.closest_hit(*self.rays), self.query.all_hits(*self.rays)[1]
        self.renderer = self._renderer()
        self.pixels = self._finished(self._renderer())
        self.kept: list[Any] = []
        self.armed = False
        signal.signal(signal.SIGALRM, self._on_alarm)
        self.calls: list[Callable[[], None]] = [
            self.ask,
            self.ask_interrupted,
            self.ask_from_threads,
            self.ask_wrongly,
            self.refit,
            self.build,
            self.copy_query,
            self.fork,
            self.instances,
            self.render,
            self.leave_early,
            self.render_interrupted,
            self.drop_generators,
            self.render_from_threads,
            self.render_wrongly,
            self.move_camera,
            self.copy_scene,
            self.collect,
        ]

    def run(self) -> None:
        for _ in range(CALLS):
            call = self.calls[self.rng.integers(len(self.calls))]
            print(call.__name__, flush=True)
            call()
            self.check()

    def check(self) -> None:
        """Check that the query, a newly built query and a new render give the initial results."""
        self.ask()
        another = clrt.RayQuery(self.vertices, self.faces, layout=self._any(LAYOUTS))
        np.testing.assert_array_equal(another.closest_hit(*self.rays), self.hits)
        np.testing.assert_array_equal(another.any_hit(*self.rays), self.hits["primitive"] >= 0)
        np.testing.assert_array_equal(self._finished(self._renderer()), self.pixels)

    def ask(self) -> None:
        """Compare hits with the initial ones; t may be rounded differently after a refit there and back."""
        for found, expected in (
            (self.query.closest_hit(*self.rays), self.hits),
            (self.query.all_hits(*self.rays)[1], self.all_hits),
        ):
            assert (found["primitive"] == expected["primitive"]).mean() > 0.999
            both = (found["primitive"] >= 0) & (expected["primitive"] >= 0)
            assert np.median(abs(found["t"][both] - expected["t"][both])) < 1e-6

    def ask_interrupted(self) -> None:
        """A kernel left running after an interrupt would overwrite freed memory, where the guard arrays now lie."""
        origins, directions = np.tile(self.rays[0], (60, 1)), np.tile(self.rays[1], (60, 1))
        for _ in range(3):
            self._interrupt(
                0.1, self._any((self.query.closest_hit, self.query.any_hit, self.query.all_hits)), origins, directions
            )
        guards = [np.full((5000, 4), 7.0) for _ in range(50)]
        time.sleep(0.05)
        assert all((guard == 7.0).all() for guard in guards)

    def ask_from_threads(self) -> None:
        self._at_once([self.ask] * 4)

    def ask_wrongly(self) -> None:
        for _ in range(8):
            one, other = self._any(WRONG), self._any((*WRONG, self.rays[0]))
            call = self._any(
                (self.query.closest_hit, self.query.any_hit, self.query.all_hits, clrt.RayQuery, self.query.refit)
            )
            with suppress(ClrtError):
                call(one) if call == self.query.refit else call(one, other)

    def refit(self) -> None:
        """Refit to moved vertices, possibly interrupted, and back."""
        moved = self.vertices + self.rng.normal(size=3)
        if self.rng.random() < 0.5:
            self.query.refit(moved)
        else:
            self._interrupt(0.02, self.query.refit, moved)
        self.query.refit(self.vertices)

    def build(self) -> None:
        layout, builder = self._any(LAYOUTS), self._any(("sah", "midpoint", "ploc", "reinsertion", None))

        def keep() -> None:
            with suppress(UsageError):  # not every builder supports every layout
                self.kept.append(clrt.RayQuery(self.vertices, self.faces, layout=layout, builder=builder))

        self._interrupt(0.3, keep)

    def copy_query(self) -> None:
        how = self._any((copy.copy, copy.deepcopy, lambda each: pickle.loads(pickle.dumps(each))))
        self.query = how(self.query)

    def fork(self) -> None:
        """In the child process every query and render must raise ClrtError; the parent continues to work."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # other threads may be running
            child = os.fork()
        if child == 0:
            refused = 0
            for call in (lambda: self.query.closest_hit(*self.rays), lambda: self._renderer(), self._finished_again):
                try:
                    call()
                except ClrtError:
                    refused += 1
            os._exit(refused)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 3

    def instances(self) -> None:
        places = np.concatenate([np.tile(np.eye(3), (3, 1, 1)), self.rng.normal(size=(3, 3, 1))], axis=2)
        many = clrt.InstancedRayQuery([(self.vertices, self.faces)], [0, 0, 0], places)
        before = many.closest_hit(*self.rays)
        self._interrupt(0.02, many.move, places + 1)
        many.move(places)
        np.testing.assert_array_equal(many.closest_hit(*self.rays), before)

    def render(self) -> None:
        self.renderer = self.renderer if self.rng.random() < 0.5 else self._renderer()
        assert np.isfinite(self._finished(self.renderer)).all()

    def leave_early(self) -> None:
        most = self.rng.integers(1, 6)
        for count, _ in enumerate(self._renderer().passes(spp=1 << 20)):
            if count == most:
                break

    def render_interrupted(self) -> None:
        renderer = self._renderer()
        for _ in range(2):
            self._interrupt(0.05, self._finished, renderer)
        np.testing.assert_array_equal(self._finished(renderer), self.pixels)

    def drop_generators(self) -> None:
        passes: list[Any] = [self._renderer().passes(spp=1 << 20) for _ in range(3)]
        for each in passes:
            next(each)
        passes[0].close()
        self.kept.append(passes[1])

    def render_from_threads(self) -> None:
        """If several threads use one renderer, each call ends with an error or the image."""
        renderer = self._renderer()

        def finish() -> None:
            with suppress(ClrtError):
                list(renderer.passes(spp=SPP))

        self._at_once([finish, finish, lambda: renderer.state() and None, lambda: renderer.look(self.scene.camera)])
        renderer.look(self.scene.camera)
        np.testing.assert_array_equal(self._finished(renderer), self.pixels)

    def render_wrongly(self) -> None:
        for _ in range(6):
            name = self._any(
                (
                    "spp",
                    "size",
                    "max_depth",
                    "seed",
                    "integrator",
                    "sampler",
                    "filter",
                    "layout",
                    "aovs",
                    "clamp_direct",
                    "device",
                    "error_percentile",
                )
            )
            with suppress(ClrtError):
                clrt.render(self.scene, **{"spp": 1, "size": (8, 8), name: self._any(WRONG)})
            with suppress(ClrtError):
                list(self._renderer().passes(**{"spp": 1, self._any(("spp", "time", "error")): self._any(WRONG[1:])}))

    def move_camera(self) -> None:
        renderer = self._renderer()
        passes = renderer.passes(spp=SPP)
        next(passes)
        self._interrupt(0.02, renderer.look, self.scene.camera)
        renderer.look(self.scene.camera)
        with suppress(ClrtError):
            list(passes)
        np.testing.assert_array_equal(self._finished(renderer), self.pixels)

    def copy_scene(self) -> None:
        self.scene = self._any((copy.deepcopy, lambda each: pickle.loads(pickle.dumps(each))))(self.scene)

    def collect(self) -> None:
        self.kept.clear()
        gc.collect()

    def _renderer(self) -> clrt.Renderer:
        return clrt.Renderer(self.scene, size=SIZE, spp=SPP, max_depth=4)

    def _finished(self, renderer: clrt.Renderer) -> Any:
        *_, state = renderer.passes(spp=SPP)
        return state.film.mean

    def _finished_again(self) -> None:
        list(self.renderer.passes(spp=1 << 10))

    def _at_once(self, calls: list[Callable[[], Any]]) -> None:
        faults: list[BaseException] = []

        def kept(call: Callable[[], Any]) -> None:
            try:
                call()
            except BaseException as fault:
                faults.append(fault)

        threads = [threading.Thread(target=kept, args=(call,)) for call in calls]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        if faults:
            raise faults[0]

    def _interrupt(self, seconds: float, call: Callable[..., object], *given: Any) -> None:
        """Call `call` and raise an exception from a signal handler at a random time within `seconds`."""
        delay = max(self.rng.random() * seconds, 1e-6)
        try:
            self.armed = True
            signal.setitimer(signal.ITIMER_REAL, delay)
            call(*given)
        except Interrupted:
            pass
        finally:
            self.armed = False
            signal.setitimer(signal.ITIMER_REAL, 0)

    def _on_alarm(self, number: int, frame: Any) -> None:
        if self.armed:
            self.armed = False
            raise Interrupted

    def _any(self, choices: Any) -> Any:
        return choices[self.rng.integers(len(choices))]


def outcome(number: int) -> str:
    """Run a sequence in its own process; return "" if it succeeded, otherwise a description of the failure."""
    command = [sys.executable, "-m", __spec__.name, "--sequence", str(number)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS)
    except subprocess.TimeoutExpired as late:
        calls = (late.stdout or b"").decode().split()
        return f"sequence {number} hangs in {calls[-1:]}, after {calls[:-1]}"
    if done.returncode == 0:
        return ""
    return f"sequence {number}: exit {done.returncode} after {done.stdout.split()}\n{done.stderr[-3000:]}"


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.misuse", description=__doc__)
    parser.add_argument("seconds", nargs="?", type=float, default=600.0)
    parser.add_argument("--first", type=int, default=0, help="number of the first sequence")
    parser.add_argument("--sequence", type=int, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.sequence is not None:
        faulthandler.enable()
        faulthandler.dump_traceback_later(SECONDS - 10)
        Sequence(given.sequence).run()
        return 0
    number, faults, end = given.first, 0, time.perf_counter() + given.seconds
    while time.perf_counter() < end:
        if fault := outcome(number):
            faults += 1
            print(fault, flush=True)
        number += 1
    print(f"{faults} of {number - given.first} sequences of {CALLS} calls went wrong")
    return min(faults, 1)


if __name__ == "__main__":
    sys.exit(main())
