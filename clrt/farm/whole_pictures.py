"""Many pictures, each rendered by one worker from its first sample to its last: frames, and bands of a large picture.

What a worker gives is what one machine would. No more than what is being rendered is ever here, however many workers
there are: a picture is handed on as it comes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from .cluster import Cluster
from .dispatch import Dispatch
from .members import BadResult, Member, Task
from .orders import PictureOrder
from .parcels import Parcel, pack
from .remote import identity, introduce, render_whole

#: With so many pictures left for each worker it has the next one at hand before it has ended one.
PLENTY = 3


class WholePictures:
    """Pictures by name. order: what a worker is to render for a name; a result is `band_renderer.render`'s."""

    def __init__(self, cluster: Cluster, names: Sequence[str], order: Callable[[str], PictureOrder],
                 devices: tuple[str | int, ...] = ()) -> None:
        self._names, self._order, self._devices = list(reversed(names)), order, devices
        self._results: list[tuple[str, dict[str, Any]]] = []
        self._common: tuple[PictureOrder, Parcel] | None = None
        self.dispatch = Dispatch(cluster, self)

    def results(self) -> Iterator[tuple[str, dict[str, Any]] | None]:
        """Names and results as they come; None from time to time between them. DeviceError where a picture was given
        up, or no worker is left."""
        for _ in self.dispatch.run():
            results, self._results = self._results, []
            yield None
            yield from results
        yield from self._results

    def introduction(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """Workers tell who they are."""
        return introduce, (identity(), self._devices)

    def meet(self, member: Member) -> None:
        """Whoever passed the introduction may work."""

    def left(self) -> bool:
        """Whether there are names left, or in work."""
        return bool(self._names or self.dispatch.tasks)

    def ahead(self, members: int) -> int:
        """One, and the next where there are plenty."""
        return 2 if len(self._names) > PLENTY * members else 1

    def next(self, member: Member) -> Task | None:
        """The next picture."""
        if not self._names:
            return None
        name = self._names.pop()
        order, cluster = self._order(name), self.dispatch.cluster
        parcel, part = self._packed(replace(order, camera=None, band=None)), pack((order.camera, order.band)).text
        cluster.keep_only({*parcel.arrays}.union(*(task.what[1] for task in self.dispatch.tasks)))
        return Task((name, set(parcel.arrays)), name, 1.0, render_whole, lambda: (
            identity(), parcel.key, parcel.text, part, list(parcel.arrays), *cluster.put(parcel.arrays)))

    def _packed(self, order: PictureOrder) -> Parcel:
        """A parcel of what most pictures have in common, packed once for all of them."""
        if self._common is None or self._common[0] != order:
            self._common = order, pack(order)
        return self._common[1]

    def accept(self, task: Task, result: dict[str, Any], member: Member) -> None:
        """Keeps it until it is handed on; BadResult unless it is a picture."""
        if not np.isfinite(result["pixels"]).all():
            raise BadResult("it returned pixels that are no finite numbers")
        self._results.append((task.what[0], result))
