"""Measurements of light at chosen places: radiance along rays, and irradiance at points of surfaces."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, NamedTuple, Unpack, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..accel.methods import HitTests
from ..device.open import Selectors
from ..errors import UsageError
from ..float_errors import with_default_errors
from ..scene.editing import materials_of, with_material
from ..scene.geometry.ray_arrays import ray_arrays
from ..scene.model import Scene
from ..scene.ray_list import REPLICAS, RayList
from ..scene.render_settings import RenderSettings, Sampler
from ..scene.validation.validate import check_is_scene
from .compile.choices import Choices
from .listed_keywords import listed
from .renderer import Renderer
from .renderer_options import RendererOptions, TracingOptions


class Measurement(NamedTuple):
    """Linear Rec. 709 values (n, 3) float64, and the standard errors of each."""

    value: NDArray[np.float64]
    standard_error: NDArray[np.float64]


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
    return _measured(scene, *_rays(origins, directions, "directions"), False, options)


@listed(SensorOptions, (RenderSettings, Choices, HitTests))
@with_default_errors
def irradiance(scene: Scene, points: ArrayLike, normals: ArrayLike, **options: Unpack[SensorOptions]) -> Measurement:
    """Measure the irradiance at points of surfaces, on the side that the normals point to.

    points, normals: (n, 3), or (3,) for all. The light of the whole hemisphere is gathered as a white Lambertian
    surface gathers it: directly from lights, point lights included, and by reflection on the scene's surfaces; the
    surface at the point itself casts no shadow. In the scene's unit of radiance, times sr. Standard errors and
    exceptions: as in `radiance`.
    """
    value, error = _measured(scene, *_rays(points, normals, "normals"), True, options)
    return Measurement(np.pi * value, np.pi * error)


def _rays(origins: ArrayLike, directions: ArrayLike, name: str) -> tuple[NDArray[np.floating], NDArray[np.float32]]:
    """Return origins, and unit directions."""
    starts, ways, _ = ray_arrays(origins, directions, np.inf)
    finite = np.isfinite(starts).all(axis=1) & np.isfinite(ways).all(axis=1)
    lengths = np.linalg.norm(ways.astype(np.float64), axis=1)
    if len(bad := np.flatnonzero(~finite | (lengths == 0))):
        row = int(bad[0])
        raise UsageError(
            f"ray {row}, from {starts[row].tolist()}, {name} {ways[row].tolist()}: give finite numbers, and directions "
            "that are not 0"
        )
    return starts, (ways / lengths[:, None]).astype(np.float32)


def _measured(
    scene: Scene,
    origins: NDArray[np.floating],
    directions: NDArray[np.float32],
    receivers: bool,
    options: SensorOptions,
) -> Measurement:
    check_is_scene(scene)
    if not len(origins):
        return Measurement(np.zeros((0, 3)), np.zeros((0, 3)))
    rays = RayList(origins=origins, directions=directions, receivers=receivers)
    settings = replace(
        scene.render,
        size=rays.size,
        integrator="path",
        filter="box",
        adaptive=False,
        clamp_direct=0,
        clamp_indirect=0,
        transparent=False,
    )
    given = cast(RendererOptions, dict(options))
    if receivers:
        given["paths"] = "lanes"  # the other executions begin at the camera's rays
    # Without a planned number of samples each pixel has a sequence of its own, so that replicas are independent.
    spp = given.pop("spp", None)
    renderer = Renderer(replace(_without_compositing(scene), camera=rays, render=settings), **given)
    for state in renderer.passes(spp=-(-(settings.spp if spp is None else spp) // REPLICAS)):
        pass
    means = state.film.mean.reshape(-1, REPLICAS, 3)[: len(origins)]
    return Measurement(means.mean(axis=1), means.std(axis=1, ddof=1) / np.sqrt(REPLICAS))


def _without_compositing(scene: Scene) -> Scene:
    """Return the scene with its environment as what is behind it, and with catchers as ordinary surfaces."""
    for material in materials_of(scene).values():
        if material.catcher:
            scene = with_material(scene, material, replace(material, catcher=False))
    seen = scene.environment if scene.environment.camera_visible else replace(scene.environment, camera_visible=True)
    return replace(scene, backdrop=None, environment=seen)
