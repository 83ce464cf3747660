"""The device and the intersection tests under study."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ....accel.methods import BoxTest, LayoutName, SphereTest, TriangleTest
from ....queries.mesh import RayQuery
from ....rendering.compile.choices import Offset
from ....rendering.film.film import Film
from ....rendering.renderer import Renderer
from ....scene.model import Scene
from ...rays.ray_speed import Floats
from ...rays.workloads import Doubles, Mesh

NO_MESH: Mesh = (np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32))


@dataclass(frozen=True)
class Subject:
    """A configuration under study. device: index into `clrt.devices()`; other fields: see RayQuery and Renderer."""

    device: int
    layout: LayoutName | None = None
    triangle: TriangleTest = "watertight"
    box: BoxTest = "robust"
    sphere: SphereTest = "robust"
    offset: Offset = "bound"

    def query(self, mesh: Mesh = NO_MESH, spheres: ArrayLike | None = None, **options: Any) -> RayQuery:
        """Return a query of the mesh and spheres; options: further arguments of RayQuery."""
        options = {"device": self.device, "layout": self.layout, "triangle": self.triangle, "box": self.box, **options}
        if spheres is not None:
            options |= {"spheres": spheres, "sphere": self.sphere}
        return RayQuery(*mesh, **options)

    def picture(self, scene: Scene, spp: int = 1) -> Floats:
        """Render the scene with `spp` samples per pixel and return the image (height, width, 3)."""
        return self.film(replace(scene, render=replace(scene.render, spp=spp))).mean.astype(np.float32)

    def film(self, scene: Scene) -> Film:
        """Render the scene with its own settings and return the film."""
        renderer = Renderer(
            scene,
            device=self.device,
            layout=self.layout,
            triangle=self.triangle,
            box=self.box,
            sphere=self.sphere,
            offset=self.offset,
        )
        *_, last = renderer.passes(spp=scene.render.spp)
        return last.film


def unit_vectors(rng: np.random.Generator, count: int) -> Doubles:
    """Return (count, 3) uniformly distributed unit vectors."""
    w = rng.normal(size=(count, 3))
    return np.asarray(w / np.linalg.norm(w, axis=1, keepdims=True))


def endless(origins: Doubles, directions: Doubles) -> tuple[Floats, Floats, Floats]:
    """Return rays with infinite t_max, rounded to float32."""
    return origins.astype(np.float32), directions.astype(np.float32), np.full(len(origins), np.inf, np.float32)


def ulps(found: Floats, exact: Doubles) -> Doubles:
    """Return the errors of float32 results in units in the last place; inf if a result is not finite."""
    with np.errstate(invalid="ignore", over="ignore"):
        off = np.abs(found.astype(np.float64) - exact) / np.spacing(np.abs(exact).astype(np.float32)).astype(np.float64)
    return np.asarray(np.where(np.isfinite(found), off, np.inf))
