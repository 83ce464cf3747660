"""The camera's shutter, and the transformations at its times: pbrt has them at two times of its own."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...scene.geometry.motion import Motion
from .entities import Entity
from .tokens import Doubles


class Shutter(NamedTuple):
    """When the shutter opens and closes, and the times of the transformations at the start and at the end."""

    opens: float
    closes: float
    times: tuple[float, float]

    @classmethod
    def of(cls, camera: Entity, times: tuple[float, float]) -> Shutter:
        """Return the shutter of a camera."""
        return cls(camera.number("shutteropen", 0.0), camera.number("shutterclose", 1.0), times)

    def poses(self, start: Doubles, end: Doubles | None) -> tuple[Doubles, Doubles | None]:
        """Return a transformation (4, 4) when the shutter opens, and when it closes; None if that is the same.

        Before and after its times it is that at the nearer one.
        """
        first, last = self.times
        if end is None or not first < last:
            return start, None
        places = np.clip([(time - first) / (last - first) for time in (self.opens, self.closes)], 0, 1)
        opened, closed = (_between(start, end, float(s)) for s in places)
        return opened, None if np.array_equal(opened, closed) else closed


def _between(start: Doubles, end: Doubles, s: float) -> Doubles:
    if s in (0, 1):
        return end if s else start
    matrix = Motion.between(start[None, :3], end[None, :3], np.eye(3, 4)[None]).at(s)[0]
    return np.vstack([matrix, [0.0, 0.0, 0.0, 1.0]])
