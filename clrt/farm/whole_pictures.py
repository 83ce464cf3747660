"""Many images, each rendered by one worker from its first sample to its last: frames, and bands of a large image.

The results are those of one machine. Images are handed on as they arrive, so the client's memory does not grow with the
number of workers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from .cluster import Cluster
from .dispatch import Dispatch
from .orders import PictureOrder
from .serialization import Serialized, pack
from .worker_states import BadResult, Task, WorkerState
from .worker_tasks import identity, introduce, render_whole

#: With more images than this left per worker, each worker has the next one queued.
PLENTY = 3


class WholePictures:
    """Images by name. order: returns a worker's order for a name; the results are those of `band_renderer.render`."""

    def __init__(
        self,
        cluster: Cluster,
        names: Sequence[str],
        order: Callable[[str], PictureOrder],
        devices: tuple[str | int, ...] = (),
    ) -> None:
        self._names, self._order, self._devices = list(reversed(names)), order, devices
        self._results: list[tuple[str, dict[str, Any]]] = []
        self._common: tuple[PictureOrder, Serialized] | None = None
        self.dispatch = Dispatch(cluster, self)

    def results(self) -> Iterator[tuple[str, dict[str, Any]] | None]:
        """Yield names and results as they arrive, and None from time to time between them.

        Raises DeviceError if an image was given up, or no worker is left.
        """
        for _ in self.dispatch.run():
            results, self._results = self._results, []
            yield None
            yield from results
        yield from self._results

    def introduction(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """Return the call by which a worker reports its devices."""
        return introduce, (identity(), self._devices)

    def meet(self, member: WorkerState) -> None:
        """Accept every worker that passed the introduction."""

    def left(self) -> bool:
        """Return whether there are names left, or in progress."""
        return bool(self._names or self.dispatch.tasks)

    def ahead(self, members: int) -> int:
        """Return 2 while there are plenty of images left, else 1."""
        return 2 if len(self._names) > PLENTY * members else 1

    def next(self, member: WorkerState) -> Task | None:
        """Return a task for the next image."""
        if not self._names:
            return None
        name = self._names.pop()
        order, cluster = self._order(name), self.dispatch.cluster
        parcel, part = self._packed(replace(order, camera=None, band=None)), pack((order.camera, order.band)).text
        cluster.keep_only({*parcel.arrays}.union(*(task.what[1] for task in self.dispatch.tasks)))
        return Task(
            (name, set(parcel.arrays)),
            name,
            1.0,
            render_whole,
            lambda: (identity(), parcel.key, parcel.text, part, list(parcel.arrays), *cluster.put(parcel.arrays)),
        )

    def _packed(self, order: PictureOrder) -> Serialized:
        """Pack what most orders have in common, once for all of them."""
        if self._common is None or self._common[0] != order:
            self._common = order, pack(order)
        return self._common[1]

    def accept(self, task: Task, result: dict[str, Any], member: WorkerState) -> None:
        """Store the result until it is handed on. Raises BadResult unless its pixels are finite."""
        if not np.isfinite(result["pixels"]).all():
            raise BadResult("it returned pixels that are not finite")
        self._results.append((task.what[0], result))
