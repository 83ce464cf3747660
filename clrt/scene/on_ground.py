"""The ground of a scene as a mesh, which is rendered only in images of light."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from .materials.material_types import Diffuse
from .model import Ground, Mesh, Scene
from .ray_list import RayList

#: Integrators whose images have a ground, and those of them that support catchers.
LIGHT = ("path", "direct", "local", "raster")
CATCHING = ("path", "direct")


class GroundMesh(Mesh):
    """The mesh of a ground, whose number follows those of all objects."""


def on_ground(scene: Scene) -> Scene:
    """Return the scene with its ground as its last mesh, or without.

    In front of a backdrop, or in a transparent image, it is a catcher. It is left out of images of data, if it would
    have to be a catcher and the integrator does not support that, and if the camera is below it.
    """
    ground, settings = scene.ground, scene.render
    if ground is None:
        return scene
    hidden = settings.transparent or scene.backdrop is not None or not scene.environment.camera_visible
    shown = settings.integrator in (CATCHING if hidden else LIGHT) and not is_below(scene)
    return replace(scene, meshes=[*scene.meshes, _floor(ground, hidden)] if shown else scene.meshes, ground=None)


def on_plain_ground(scene: Scene) -> Scene:
    """Return the scene with the ground that its images of light have, for images of data: never as a catcher."""
    ground = scene.ground
    if ground is None:
        return scene
    return replace(scene, meshes=[*scene.meshes, *[_floor(ground, False)] * (not is_below(scene))], ground=None)


def is_below(scene: Scene) -> bool:
    """Return whether the camera is below the ground, which would hide the scene; rays given one by one are not."""
    if scene.ground is None or isinstance(scene.camera, RayList):
        return False
    return scene.camera.position[1] < scene.ground.height


@lru_cache(maxsize=8)
def _floor(ground: Ground, catcher: bool) -> GroundMesh:
    """Return the mesh; the same object for an equal ground, so that what is made of it can be reused."""
    x, z = ground.center
    corners = [(-1, -1), (-1, 1), (1, 1), (1, -1)]
    vertices = [(x + ground.radius * right, ground.height, z + ground.radius * front) for right, front in corners]
    return GroundMesh(
        vertices=np.array(vertices, np.float32),
        faces=np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        material=Diffuse(color=ground.color, catcher=catcher),
        name="ground",
    )
