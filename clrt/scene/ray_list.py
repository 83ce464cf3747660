"""A camera of rays that are given one by one, for measurements of light at chosen places."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

from .cameras import Camera, CameraType

Measured = Literal["radiance", "irradiance", "ambient_occlusion"]
#: Consecutive pixels of each measurement: their differences show the error of their mean.
REPLICAS = 16
#: Maximum number of rays in a row of the image.
ACROSS = 256


class ListedRays(CameraType):
    """Rays given one by one."""

    kernel = "listed_rays"
    all_around = True


@dataclass(frozen=True, kw_only=True, eq=False)
class RayList(Camera):
    """Rays from `origins` (n, 3) in unit `directions` (n, 3) float32, each traced by `replicas` consecutive pixels.

    measures: the radiance along the rays; or, at points of surfaces whose shading normals are the directions and whose
    geometric normals are `surface_normals` (n, 3) float32, their irradiance, or the fraction of the hemisphere in which
    no surface is nearer than `reach` (0: at any distance).
    """

    origins: Any  # arrays, which the validation of fields has no types for
    directions: Any
    surface_normals: Any = None
    measures: Measured = "radiance"
    reach: float = 0.0
    replicas: int = REPLICAS

    def __post_init__(self) -> None:
        """Keep the arrays, which a Camera converts to tuples."""

    @property
    def type(self) -> type[CameraType]:
        return ListedRays

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the image."""
        across = min(len(self.origins), ACROSS)
        return across * self.replicas, -(-len(self.origins) // across)

    @property
    def on_surfaces(self) -> bool:
        """Whether the rays start at surfaces, which have normals."""
        return self.measures != "radiance"

    def scaled(self, factor: float) -> Camera:
        return replace(super().scaled(factor), reach=self.reach * factor)  # type: ignore[call-arg]
