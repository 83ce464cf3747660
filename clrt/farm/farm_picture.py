"""An image rendered by the workers of a cluster. The film is on the client.

A task has some tiles, their current pixels, and the samples to add: the same as a device of a crew gets
(rendering/accumulation/device_pool.py), only larger. A tile is in one task at a time, and the returned pixels replace
the film's. So each pixel's samples are added one after another in a fixed order: the result does not depend on which
worker did what, or when, the sums are bit-identical to those of one machine, and repeated tasks count once. Tiles that
have all samples of a pass get those of the next while the others catch up (next_pass.py).
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection, Iterator, Sequence
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..device.memory_plan import check_host
from ..device.open import Device
from ..errors import ClrtError
from ..rendering.accumulation.accumulation import Accumulation
from ..rendering.accumulation.launch_plan import FEWEST_TILES
from ..rendering.accumulation.scene_on_device import SceneOnDevice
from ..rendering.accumulation.work_queue import WorkQueue
from ..rendering.film.film import Film
from ..rendering.film.tiles import TILE_PIXELS, row_by_row, tile_by_tile
from ..scene.model import Scene
from .cluster import Cluster
from .dispatch import Dispatch
from .next_pass import NextPass
from .orders import Order
from .serialization import pack
from .worker_check import WorkerCheck
from .worker_request import ask
from .worker_states import BadResult, Task, WorkerState
from .worker_tasks import draw, identity, prepare, render_share

#: Target seconds per task with few workers; with many, more, so that client and scheduler handle at most
#: TASKS_A_SECOND.
TASK_SECONDS, TASKS_A_SECOND = 1.0, 32
#: Samples in the first task of a worker with unknown speed.
FIRST_SAMPLES = 1 << 17
#: The smallest task as a fraction of a full one (1/SMALLEST), and the maximum number of tiles per task, to keep what is
#: sent below 10 MB.
SMALLEST, MOST_TILES = 8, 2048
#: Tasks queued per worker, and the maximum if the client is away for longer; and tasks per worker and pass.
AHEAD, MOST_AHEAD, PASS_TASKS = 2, 8, 36
#: Minimum ratio of a pass's duration to the time that the client takes between two, to estimate the image's error.
GAP_COST = 10
#: Maximum wait at the end of a render for tasks in flight, in multiples of a task's duration.
DRAIN = 2.5
#: The result of a worker that drops a larger fraction of its samples is rejected.
MOST_DROPPED = 0.5
_log = logging.getLogger(__name__)


class FarmAccumulation(Accumulation):
    """Samples of the order's scene, accumulated by a cluster. pixel: the film's record."""

    def __init__(self, cluster: Cluster, order: Order, pixel: np.dtype[Any]) -> None:
        super().__init__(order.scene.render.size)
        tiles = self.work.samples.size
        check_host(tiles * TILE_PIXELS * pixel.itemsize, *self.size)
        self._ahead = NextPass(np.zeros((tiles, TILE_PIXELS), pixel))
        self._inside = _inside(self.size)
        self._parcel = pack(order)
        self._proofs, self._drops = WorkerCheck(), False
        self._doubted: dict[Task, tuple[WorkerState, NDArray[Any]]] = {}
        self._ended = self._gap = 0.0
        #: Bytes of pixels and tile numbers sent to workers and back.
        self.moved_bytes = 0
        self.dispatch = Dispatch(cluster, self)

    def machine(self, devices: Sequence[Device]) -> dict[str, Any]:
        """Return the report's data on the workers; for data on builds, that of one of them."""
        reports = [each.facts["report"] for each in self.dispatch.everyone() if each.facts]
        return {
            **reports[0],
            "platform": self.told("platform"),
            "driver": self.told("driver"),
            "moved_bytes": self.moved_bytes,
            "devices": self.shares(),
        }

    def told(self, what: str) -> str:
        """Return the distinct values of a field in the workers' answers."""
        return " + ".join(dict.fromkeys(str(each.facts[what]) for each in self.dispatch.everyone() if each.facts))

    def guides(self) -> dict[str, NDArray[np.float32]]:
        """See `render_guides`."""
        return self._drawn(None)

    def first_hits(self, scene: Scene, names: Collection[str]) -> dict[str, NDArray[np.generic]]:
        """See `first_hits`."""
        return {**self._drawn(tuple(names))}

    def _drawn(self, names: tuple[str, ...] | None) -> dict[str, NDArray[Any]]:
        """Return AOVs of the first hits, from one worker (see `remote.draw`)."""
        pictures: dict[str, NDArray[Any]] = ask(self.dispatch, draw, self._parcel.key, names)
        return pictures

    def introduction(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """Return the call that sends the scene to a worker and compiles it there."""
        key, text, arrays = self._parcel.key, self._parcel.text, self._parcel.arrays
        return prepare, (identity(), key, text, list(arrays), *self.dispatch.cluster.put(arrays))

    def meet(self, member: WorkerState) -> None:
        """Compare the worker's proof with the others'."""
        self._proofs.compare(member)

    def left(self) -> bool:
        """Return whether any part of the pass is waiting or in flight."""
        return self._busy

    def ahead(self, members: int) -> int:
        """Return the tasks to queue per worker: the current, the next, and more to cover the client's absence."""
        return min(MOST_AHEAD, AHEAD + round(self._gap / self._task_seconds))

    def next(self, member: WorkerState) -> Task | None:
        """Return a task that takes the target time, or less near the end, so that all workers end at the same time."""
        rates = [each.rate for each in self.dispatch.members.values() if each.ready]
        known = [rate for rate in rates if rate]
        size = (member.rate or sum(known) / max(1, len(known))) * self._task_seconds or FIRST_SAMPLES
        left = self.work.left + (self._ahead.work.left if self._ahead.work else 0)
        fair = left * TILE_PIXELS / max(1, len(rates)) / 2
        most = evenly(int(min(size, max(fair, size / SMALLEST)) / TILE_PIXELS), self.work)
        found = self._ahead.cut(
            self.work, most, FEWEST_TILES, MOST_TILES, [task.what[1] for task in self.dispatch.tasks]
        )
        if found is None:
            return None
        work, part = found
        tiles = work.tiles[part.first : part.end]
        pixels = self._ahead.film[tiles] if part.samples else None
        self.moved_bytes += tiles.nbytes + (0 if pixels is None else pixels.nbytes)
        name = f"a task of {len(tiles)} tiles, samples {part.samples} to {part.samples + part.more}"
        return Task(
            (work, part, tiles),
            name,
            len(tiles) * TILE_PIXELS * part.more,
            render_share,
            lambda: (self._parcel.key, tiles, part.samples, part.more, pixels),
        )

    def accept(self, task: Task, result: NDArray[Any], member: WorkerState) -> None:
        """Store the pixels in the film if they are plausible."""
        work, part, tiles = task.what
        dropped = check_pixels(result, self._ahead.film[tiles], self._inside[tiles], part.more)
        if dropped > MOST_DROPPED * task.work and not self._drops:
            self._doubt(task, result, member)
        self._ahead.take(work, tiles, result)
        self.moved_bytes += result.nbytes

    def _doubt(self, task: Task, result: NDArray[Any], member: WorkerState) -> None:
        """Raise BadResult for a worker that drops most samples, unless another got the same result for the task."""
        other, found = self._doubted.pop(task, (None, None))
        if other is None or found is None or found.tobytes() != result.tobytes():
            self._doubted[task] = member, result
            raise BadResult("it returned NaN or infinity for most samples")
        self._drops, other.refused = True, ""

    def advance(self, room: Callable[[int], int]) -> Iterator[None]:
        """See `Accumulation.advance`. The pass may have begun already, and the next one may begin before it ends."""
        self.mend()
        done = self.samples_done
        if not self._busy:
            if self._ahead.work and self._ahead.samples <= room(done):
                self.work = self._ahead.work
                self._ahead.begin()
            else:
                self._forget_ahead()
                self.work.add_to_all(max(1, min(room(done), self.pass_limit())))
        then = int(self.work.then.flat[0])
        if self._ahead.work is None and room(then):
            self._ahead.plan(self.work, min(room(then), self.pass_limit()))
        yield from self._run()

    def double(self, tiles: NDArray[np.intp]) -> Iterator[None]:
        """See `Accumulation.double`."""
        self._forget_ahead()
        yield from super().double(tiles)

    def _forget_ahead(self) -> None:
        """Discard the pass that was begun ahead."""
        self.dispatch.forget([task for task in self.dispatch.tasks if task not in self._at_pass])
        self._ahead.forget()

    def _work(self) -> Iterator[None]:
        if self._ended:
            self._gap = perf_counter() - self._ended
        yield from self.dispatch.run()
        self.work.settle()
        self._ended = perf_counter()

    @property
    def _at_pass(self) -> list[Task]:
        """Return the tasks of the current pass."""
        return [task for task in self.dispatch.tasks if task.what[0] is self.work]

    @property
    def _busy(self) -> bool:
        return bool(self.work.parts or self._at_pass)

    @property
    def _task_seconds(self) -> float:
        return TASK_SECONDS * max(1.0, len(self.dispatch.members) / TASKS_A_SECOND)

    def _clear(self) -> None:
        self._ahead.film.fill(0)

    def wait(self) -> None:
        """Wait for tasks of the pass in flight, but not for slow workers: their work is put back."""
        with self._tearing():
            for task in self.dispatch.drain(self._at_pass, DRAIN * self._task_seconds):
                self.work.give_back(task.what[1])
            self._settle()

    def work_left(self) -> WorkQueue:
        """Return the remaining work of the pass, including tasks in flight."""
        kept = WorkQueue(self.work.samples, self.work.then, self.work.tiles, self.work.parts)
        for task in self._at_pass:
            kept.give_back(task.what[1])
        return kept

    def pass_limit(self) -> int:
        """Return the samples per pixel that keep all busy for some tasks, and much longer than the client is away."""
        rates = sum(each.rate for each in self.dispatch.ready())
        seconds = max(PASS_TASKS * self._task_seconds, GAP_COST * self._gap)
        return max(1, int(rates * seconds / (self.size[0] * self.size[1])))

    def film(self) -> Film:
        """Return the film so far, without tasks in flight, or samples of the next pass."""
        return Film(row_by_row(self._ahead.shown(), self.size), self.backdrop)

    def restore(self, film: Film, work: WorkQueue) -> None:
        """Resume from a film of this size and the work that produced it."""
        self.work, self._ahead = work, NextPass(tile_by_tile(film.pixels))

    def shares(self) -> list[dict[str, Any]]:
        """Return each worker's samples and speed."""
        return [
            {
                "worker": each.name,
                "device": (each.facts or {}).get("name"),
                "samples": each.done,
                "samples_per_second": each.rate,
                "lost": each.gone or bool(each.refused),
            }
            for each in self.dispatch.everyone()
            if each.facts
        ]

    @property
    def scene(self) -> SceneOnDevice:
        """Raise ClrtError: the scene is not on the client."""
        raise ClrtError("the scene is loaded on the workers, not on this client")

    @property
    def device_bytes(self) -> int:
        """Return the size of all buffers on the worker that uses most."""
        return max(
            (each.facts["report"]["peak_device_bytes"] for each in self.dispatch.everyone() if each.facts), default=0
        )

    @property
    def longest_launch(self) -> float:
        """Return 0: only workers measure it."""
        return 0.0


def _inside(size: tuple[int, int]) -> NDArray[np.bool_]:
    """Return which of the tiles' pixels are in the image, (tiles, TILE_PIXELS)."""
    width, height = size
    return np.asarray(tile_by_tile(np.ones((height, width), bool)))


def evenly(most: int, work: WorkQueue) -> int:
    """Round `most` samples of a tile's pixels, so that tasks of FEWEST_TILES tiles leave no small rest of a pass."""
    each, samples = max(1, most // FEWEST_TILES), int((work.then - work.samples).max())
    return most if samples <= each else FEWEST_TILES * -(-samples // round(samples / each))


def check_pixels(found: NDArray[Any], before: NDArray[Any], inside: NDArray[np.bool_], more: int) -> int:
    """Raise BadResult unless these can be the pixels with `more` more samples; return how many were dropped."""
    if not isinstance(found, np.ndarray) or found.shape != before.shape or found.dtype != before.dtype:
        raise BadResult("it returned something other than pixels")
    floats = [name for name in found.dtype.names or () if found.dtype[name].base.kind == "f"]
    if not all(np.isfinite(found[name]).all() for name in floats):
        raise BadResult("it returned pixels that are not finite")
    kept, dropped = (found[name].astype(np.int64) - before[name] for name in ("count", "dropped"))
    if ((kept + dropped)[inside] != more).any():
        raise BadResult(f"it returned pixels with fewer than their {more} samples")
    return int(dropped.sum())
