"""A camera of rays that are given one by one, for measurements of light at chosen places."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .cameras import Camera, CameraType

#: Consecutive pixels of each ray, as in kernels/camera/listed_rays.cl: their differences show the error of their mean.
REPLICAS = 16
#: Maximum number of rays in a row of the image.
ACROSS = 256


class ListedRays(CameraType):
    """Rays given one by one."""

    kernel = "listed_rays"
    all_around = True


@dataclass(frozen=True, kw_only=True, eq=False)
class RayList(Camera):
    """Rays from `origins` (n, 3) in unit `directions` (n, 3) float32. receivers: the origins are points of surfaces
    whose normals are the directions, and what is measured is the light that reaches them."""

    origins: Any  # arrays, which the validation of fields has no types for
    directions: Any
    receivers: bool = False

    @property
    def type(self) -> type[CameraType]:
        return ListedRays

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the image."""
        across = min(len(self.origins), ACROSS)
        return across * REPLICAS, -(-len(self.origins) // across)
