"""Measurements of light at chosen places: radiance along rays, irradiance and ambient occlusion at points."""

from __future__ import annotations

from typing import Annotated, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..accel.methods import HitTests
from ..device.open import Selectors
from ..errors import UsageError
from ..float_errors import with_default_errors
from ..scene.geometry.ray_arrays import ray_arrays
from ..scene.model import Scene
from ..scene.ray_list import RayList
from ..scene.render_settings import RenderSettings, Sampler
from .compile.choices import Choices
from .light_meter import LightMeter, Measurement
from .listed_keywords import listed
from .renderer_options import TracingOptions


class SensorOptions(TracingOptions, total=False):
    """Keywords of measurements; those left out are the scene's, or suit the device."""

    spp: Annotated[int | None, "Samples per ray or point, rounded up to a multiple of 16."]
    max_depth: int | None
    seed: int | None
    sampler: Sampler | None
    device: Annotated[Selectors, "See `clrt devices`, or an open device; several measure together."]


@listed(SensorOptions, (RenderSettings, Choices, HitTests))
@with_default_errors
def radiance(scene: Scene, origins: ArrayLike, directions: ArrayLike, **options: Unpack[SensorOptions]) -> Measurement:
    """Measure the radiance that arrives along rays, in the scene's unit of radiance.

    origins, directions: (n, 3), or (3,) for all rays; directions need not have unit length. A ray sees what a camera
    there would see. Standard errors are those of 16 independent estimates, so 99.1 % of the errors are below three of
    them (Student's t, 15 degrees of freedom). Raises UsageError for other arrays, and what `render` raises.
    """
    starts, ways = _rays(origins, directions, ("origins", "directions"))
    return _measured(scene, RayList(origins=starts, directions=ways), options)


@listed(SensorOptions, (RenderSettings, Choices, HitTests))
@with_default_errors
def irradiance(scene: Scene, points: ArrayLike, normals: ArrayLike, **options: Unpack[SensorOptions]) -> Measurement:
    """Measure the irradiance at points of surfaces, on the side that the normals point to.

    points, normals: (n, 3), or (3,) for all. The light of the whole hemisphere is gathered as a white Lambertian
    surface gathers it: directly from lights, point lights included, and by reflection on the scene's surfaces; the
    surface at the point itself casts no shadow. In the scene's unit of radiance, times sr. Standard errors and
    exceptions: as in `radiance`.
    """
    places, ways = _rays(points, normals, ("points", "normals"))
    rays = RayList(origins=places, directions=ways, surface_normals=ways, measures="irradiance")
    value, error = _measured(scene, rays, options)
    return Measurement(np.pi * value, np.pi * error)


@listed(SensorOptions, (RenderSettings, Choices, HitTests))
@with_default_errors
def ambient_occlusion(
    scene: Scene,
    points: ArrayLike,
    normals: ArrayLike,
    distance: float | None = None,
    **options: Unpack[SensorOptions],
) -> Measurement:
    """Measure ambient occlusion at points of surfaces, from 0, closed, to 1, open.

    It is the fraction of the hemisphere around the normal, weighted by the cosine, in which no surface is nearer than
    `distance` (None: at any distance). Values and standard errors are (n,). Points, normals, standard errors and
    exceptions: as in `irradiance`; UsageError also for a distance that is not above 0.
    """
    places, ways = _rays(points, normals, ("points", "normals"))
    rays = RayList(
        origins=places,
        directions=ways,
        surface_normals=ways,
        measures="ambient_occlusion",
        reach=reach_of(distance),
    )
    value, error = _measured(scene, rays, options)
    return Measurement(value[:, 0], error[:, 0])


def reach_of(distance: float | None) -> float:
    """Return the reach of a RayList, 0 for any distance. Raises UsageError for a distance that is not above 0."""
    if distance is not None and not 0 < distance < np.inf:
        raise UsageError(f"distance is {distance!r}; give a finite number above 0, or None for any distance")
    return distance or 0.0


def _rays(
    origins: ArrayLike, directions: ArrayLike, names: tuple[str, str]
) -> tuple[NDArray[np.floating], NDArray[np.float32]]:
    """Return origins, and unit directions; names: what the caller calls them."""
    starts, ways, _ = ray_arrays(origins, directions, np.inf, names)
    finite = np.isfinite(starts).all(axis=1) & np.isfinite(ways).all(axis=1)
    lengths = np.linalg.norm(ways.astype(np.float64), axis=1)
    if len(bad := np.flatnonzero(~finite | (lengths == 0))):
        row = int(bad[0])
        raise UsageError(
            f"{names[0]}[{row}] is {starts[row].tolist()}, and {names[1]}[{row}] {ways[row].tolist()}; give finite "
            f"numbers, and {names[1]} that are not 0"
        )
    return starts, (ways / lengths[:, None]).astype(np.float32)


def _measured(scene: Scene, rays: RayList, options: SensorOptions) -> Measurement:
    measured = Measurement(np.zeros((0, 3)), np.zeros((0, 3)))
    if len(rays.origins):
        for _, measured in LightMeter(scene, options).measure(rays):
            pass
    return measured
