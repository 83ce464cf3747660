"""Scenes of the trial, generated: a room of few primitives, and one with a large mesh and two material types."""

from __future__ import annotations

from dataclasses import replace

from ...scene.materials.material_types import Diffuse, Plastic
from ...scene.model import Camera, Mesh, RenderSettings, Scene, Sphere
from ..rays.workloads import bumpy_ball, closed_room

#: Subdivisions of the large mesh, a ball: 49 152 triangles.
SUBDIVISIONS = 6


def trial_scenes(side: int) -> dict[str, Scene]:
    """Return the scenes by name, for images of `side` by `side` pixels: a lamp and a ball in a closed room."""
    vertices, faces = bumpy_ball(SUBDIVISIONS)
    corners, walls = closed_room(vertices, faces)
    lamp = Sphere(center=(0.0, 2.0, 0.0), radius=0.4, material=Diffuse(emission=(8.0, 8.0, 8.0)))
    room = Scene(
        meshes=[Mesh(corners[len(vertices) :], walls[len(faces) :] - len(vertices), Diffuse(color=(0.6, 0.6, 0.6)))],
        spheres=[lamp, Sphere(radius=1.0, material=Diffuse())],
        camera=Camera(position=(1.2, 0.8, 2.6), look_at=(0.0, 0.0, 0.0)),
        render=RenderSettings(size=(side, side), max_depth=8),
    )
    ball = replace(room, meshes=[*room.meshes, Mesh(vertices, faces, Plastic())], spheres=[lamp])
    return {"room": room, "ball": ball}
