"""Measurements by lists of rays, one list after the other with the same BVH, buffers and program."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, Literal, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from ..scene.editing import materials_of, with_material
from ..scene.model import Scene
from ..scene.on_ground import on_plain_ground
from ..scene.ray_list import REPLICAS, RayList
from .film.film import Film
from .renderer import Renderer
from .renderer_options import RendererOptions, settings_of

Doubles = NDArray[np.float64]
#: Which light is measured: all, or that of paths of at most or more than two segments.
LightPart = Literal["all", "direct", "indirect"]


class Measurement(NamedTuple):
    """Linear Rec. 709 values (n, 3) float64, and the standard errors of each."""

    value: NDArray[np.float64]
    standard_error: NDArray[np.float64]


class LightMeter:
    """Measurements in one scene. options: the renderer's; lists that follow each other should have the same length."""

    def __init__(self, scene: Scene, options: Mapping[str, Any], part: LightPart = "all") -> None:
        self._scene, self._part = _without_compositing(scene), part
        left = {name: value for name, value in options.items() if name not in ("spp", "seed")}
        self._options = cast(RendererOptions, left)
        # Without a planned number of samples each pixel has a sequence of its own, so that replicas are independent.
        planned = settings_of(scene.render, {"spp": options.get("spp"), "seed": options.get("seed")})
        self.spp, self._seed = planned.spp, planned.seed
        if part != "all":
            self._options["aovs"] = ["direct"]
        self._renderer: Renderer | None = None
        self._lists = 0

    @property
    def device_name(self) -> str:
        """Names of the devices, once a list was begun."""
        return self._renderer.name if self._renderer else ""

    @property
    def device_bytes(self) -> int:
        """Memory used on the device, once a list was begun."""
        return self._renderer.session.device_bytes if self._renderer else 0

    def measure(self, rays: RayList) -> Iterator[tuple[int, Measurement]]:
        """Yield the samples so far and what they show, at powers of two of the samples, at intervals, and at the end.

        Each measurement is made by REPLICAS pixels, of as many consecutive rays as that takes.
        """
        renderer = self._renderer_of(rays)
        for state in renderer.passes(spp=-(-self.spp // REPLICAS)):
            yield state.spp * REPLICAS, self._measurement(state.film, rays)

    def _renderer_of(self, rays: RayList) -> Renderer:
        """Return a renderer of the rays, whose random numbers no other list has."""
        settings = replace(
            self._scene.render,
            size=rays.size,
            seed=(self._seed + self._lists) % 2**32,
            integrator="normals" if rays.measures == "ambient_occlusion" else "path",  # which shows no light
            filter="box",
            adaptive=False,
            clamp_direct=0,
            clamp_indirect=0,
            transparent=False,
        )
        options = self._options
        if rays.on_surfaces:
            options["paths"] = "lanes"  # the other executions begin at the camera's rays
        if self._renderer is not None:
            options["before"], options["device"] = self._renderer, self._renderer.devices
            options.pop("on_phase", None)
        # The light is that of the scene's exposure; rays have no rows, which could open one after the other.
        seen = replace(rays, shutter=self._scene.camera.shutter)
        measured = on_plain_ground(replace(self._scene, camera=seen, render=settings))
        self._renderer = Renderer(measured, **options)
        self._lists += 1
        return self._renderer

    def _measurement(self, film: Film, rays: RayList) -> Measurement:
        """Return the means, and the errors by the differences of pixels with the same ray."""
        count = len(rays.origins) * rays.replicas // REPLICAS
        means = self._light_of(film).reshape(-1, REPLICAS // rays.replicas, rays.replicas, 3)[:count]
        variance = means.var(axis=2, ddof=1).mean(axis=1)
        return Measurement(means.mean(axis=(1, 2)), np.sqrt(variance / REPLICAS))

    def _light_of(self, film: Film) -> Doubles:
        if self._part == "all":
            return film.mean
        direct = film.direct
        return direct if self._part == "direct" else np.maximum(film.mean - direct, 0)


def _without_compositing(scene: Scene) -> Scene:
    """Return the scene with its environment as what is behind it, and with catchers as ordinary surfaces."""
    for material in materials_of(scene).values():
        if material.catcher:
            scene = with_material(scene, material, replace(material, catcher=False))
    seen = scene.environment if scene.environment.camera_visible else replace(scene.environment, camera_visible=True)
    return replace(scene, backdrop=None, environment=seen)
