"""Who is asked: a device, and by which tests it intersects."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...query import RayQuery
from ...rendering.film import Film
from ...rendering.renderer import Renderer
from ...scene.model import Scene
from ..rays import Floats
from ..workloads import Doubles, Mesh

NO_MESH: Mesh = (np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32))


@dataclass(frozen=True)
class Subject:
    """device: an index of `clrt.devices()`; the rest: see RayQuery and Renderer."""

    device: int
    layout: str | None = None
    triangle: str = "watertight"
    box: str = "robust"
    sphere: str = "robust"
    offset: str = "bound"

    def query(self, mesh: Mesh = NO_MESH, spheres: ArrayLike | None = None, **options: Any) -> RayQuery:
        """The mesh and spheres to shoot at; options: further ones of RayQuery."""
        options = {"device": self.device, "layout": self.layout, "triangle": self.triangle, "box": self.box,
                   **options}
        if spheres is not None:
            options |= {"spheres": spheres, "sphere": self.sphere}
        return RayQuery(*mesh, **options)

    def picture(self, scene: Scene, spp: int = 1) -> Floats:
        """(height, width, 3): the scene after `spp` samples a pixel."""
        return self.film(replace(scene, render=replace(scene.render, spp=spp))).mean.astype(np.float32)

    def film(self, scene: Scene) -> Film:
        """The scene by its own settings."""
        renderer = Renderer(scene, device=self.device, layout=self.layout, triangle=self.triangle, box=self.box,
                            sphere=self.sphere, offset=self.offset)
        *_, last = renderer.passes(spp=scene.render.spp)
        return last.film


def unit_vectors(rng: np.random.Generator, count: int) -> Doubles:
    """(count, 3) directions, each as likely."""
    w = rng.normal(size=(count, 3))
    return np.asarray(w / np.linalg.norm(w, axis=1, keepdims=True))


def endless(origins: Doubles, directions: Doubles) -> tuple[Floats, Floats, Floats]:
    """Rays without an end, rounded to float32."""
    return origins.astype(np.float32), directions.astype(np.float32), np.full(len(origins), np.inf, np.float32)


def ulps(found: Floats, exact: Doubles) -> Doubles:
    """How many units in the last place float32 answers are off; inf for what is not finite."""
    with np.errstate(invalid="ignore", over="ignore"):
        off = np.abs(found.astype(np.float64) - exact) / np.spacing(np.abs(exact).astype(np.float32)).astype(np.float64)
    return np.asarray(np.where(np.isfinite(found), off, np.inf))
