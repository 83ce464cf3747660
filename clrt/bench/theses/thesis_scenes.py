"""Scenes of the theses' experiments, as far as described and licensed: models are generated, or read from files.

The dragon and the tree stand among spheres under a sky, the only light (Nadolny 2026, 5.2); the statue stands in a
hall, lit by a point light, optionally between two parallel mirrors (Suchiński 2022, 7.4 and 7.5).
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from ...formats.models import read_model
from ...scene.default_sky import default_sky
from ...scene.geometry.normals import smooth_normals
from ...scene.lights import PointLight
from ...scene.materials.material_types import Diffuse, Material, MetallicRoughness, Mirror, Phong
from ...scene.model import Camera, Mesh, RenderSettings, Scene, Sphere
from ..rays.workloads import Mesh as Arrays
from .figures import column, dragon, statue, tree

GROUND = Diffuse(color=(0.45, 0.43, 0.4))
BALLS = [
    Sphere(center=(-1.2, 0.35, 1.1), radius=0.35, material=MetallicRoughness(preset="gold", roughness=0.15)),
    Sphere(center=(0.9, 0.25, 1.3), radius=0.25, material=Mirror(color=(0.9, 0.9, 0.9))),
    Sphere(center=(1.9, 0.5, -0.9), radius=0.5, material=MetallicRoughness(color=(0.7, 0.1, 0.08), roughness=0.3)),
    Sphere(center=(-1.9, 0.45, -0.7), radius=0.45, material=MetallicRoughness(preset="copper", roughness=0.35)),
]
STONE = Phong(color=(0.68, 0.64, 0.58), specular=(0.3, 0.3, 0.3), shininess=30.0)
FLOOR = Phong(color=(0.4, 0.34, 0.3), specular=(0.0, 0.0, 0.0))
GLASS = Mirror(color=(0.9, 0.94, 0.92))
#: Half the distance of the mirrors, half their width, and their height.
REACH, HALF, HEIGHT = 2.6, 4.5, 4.5


def outdoors(figure: list[Mesh], name: str) -> Scene:
    """Return a model, about 3 units wide or high, among spheres under the default sky."""
    return Scene(
        meshes=[*figure, _quad("ground", [(-40, 0, -40), (-40, 0, 40), (40, 0, 40), (40, 0, -40)], GROUND)],
        spheres=BALLS,
        environment=default_sky(),
        name=name,
        camera=Camera(position=(1.0, 1.55, 5.2), look_at=(0.0, 0.75, 0.0), fov_degrees=34.0),
        render=RenderSettings(size=(2200, 1331), spp=6, max_depth=11),
    )


def dragon_scene(file: Path | None = None) -> Scene:
    """Return a scene of the dragon of 19 332 triangles, or of the model in a file."""
    material = MetallicRoughness(color=(0.2, 0.45, 0.32), roughness=0.35)
    figure = _standing(file, material, 1.9) if file else [_smooth("dragon", dragon(), material)]
    return outdoors(figure, "dragon")


def tree_scene(file: Path | None = None) -> Scene:
    """Return a scene of the tree of 264 triangles, or of the model in a file."""
    wood, leaves = (
        Mesh(*arrays, material=Diffuse(color=color), name=name)
        for arrays, color, name in zip(tree(), ((0.3, 0.19, 0.1), (0.16, 0.42, 0.1)), ("wood", "leaves"))
    )
    scene = outdoors(_standing(file, None, 3.0) if file else [wood, leaves], "tree")
    return replace(scene, camera=replace(scene.camera, position=(1.0, 1.7, 6.4), look_at=(0.0, 1.3, 0.0)))


def hall(
    detail: int, file: Path | None = None, *, mirrors: bool = False, figure: Material = STONE, far: bool = False
) -> Scene:
    """Return a scene of the statue, or the model in a file, among four columns: 700 thousand triangles at detail 4.

    mirrors: whether the ends of the hall are mirrors; figure: the statue's material; far: seen from the side, where it
    is small in the image.
    """
    made = _standing(file, figure, 2.1) if file else [_smooth("statue", statue(detail), figure)]
    shaft = _smooth("column", column(detail), STONE)
    columns = [
        replace(shaft, vertices=shaft.vertices + np.array([x, 0, z], np.float32))
        for x in (-1.9, 1.9)
        for z in (-1.6, 1.6)
    ]
    ends = [
        [
            (-s * HALF, 0, s * REACH),
            (s * HALF, 0, s * REACH),
            (s * HALF, HEIGHT, s * REACH),
            (-s * HALF, HEIGHT, s * REACH),
        ]
        for s in (-1, 1)
    ]
    walls = [_quad("end", end[::-1], GLASS if mirrors else STONE) for end in ends]
    floor = _quad("floor", [(-60, 0, -60), (-60, 0, 60), (60, 0, 60), (60, 0, -60)], FLOOR)
    camera = (
        Camera(position=(6.6, 2.2, 1.2), look_at=(-0.6, 1.1, -0.2), fov_degrees=46.0)
        if far
        else Camera(position=(0.9, 1.6, 2.2), look_at=(-0.05, 1.1, -0.6), fov_degrees=54.0)
    )
    return Scene(
        meshes=[*made, *columns, *walls, floor],
        name="hall",
        camera=camera,
        environment=replace(default_sky(), image=None, color=(0.22, 0.26, 0.34)),
        lights=[PointLight(position=(1.0, 3.4, 1.2), intensity=(18.0, 17.0, 15.0))],
        render=RenderSettings(size=(1280, 720), spp=1, integrator="local"),
    )


def _quad(name: str, corners: list[tuple[float, float, float]], material: Material) -> Mesh:
    return Mesh(np.array(corners, np.float32), np.array([[0, 1, 2], [0, 2, 3]], np.int32), material, name=name)


def _smooth(name: str, arrays: Arrays, material: Material) -> Mesh:
    return Mesh(*arrays, material=material, normals=smooth_normals(*arrays), name=name)


def _standing(file: Path, material: Material | None, size: float) -> list[Mesh]:
    """Read a model, scaled to a largest extent of `size`, standing on the ground at the origin."""
    model = read_model(file)
    low = np.min([mesh.vertices.min(axis=0) for mesh in model.meshes], axis=0)
    high = np.max([mesh.vertices.max(axis=0) for mesh in model.meshes], axis=0)
    foot, scale = np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2]), size / float(np.max(high - low))
    return [
        replace(
            mesh, vertices=np.asarray((mesh.vertices - foot) * scale, np.float32), material=material or mesh.material
        )
        for mesh in model.meshes
    ]
