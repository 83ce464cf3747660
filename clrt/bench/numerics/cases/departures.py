"""G9: far from the origin, surfaces do not shadow themselves and closed boxes do not leak light."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ....scene.lights import DirectionalLight
from ....scene.materials.material_types import Diffuse
from ....scene.model import Camera, Environment, Mesh, RenderSettings, Scene, Sphere
from ...rays.workloads import Doubles
from ..row import Row
from .subject import Subject
from .watertight import AWAY, words

#: (Scale factor, translation in scene sizes). At 1e7, float32 is too coarse for anything but a level plane.
PLACES = ((1.0, 0.0), (1.0, 1e3), (1.0, 1e6), (1.0, 1e7), (1e-5, 0.0), (1e5, 0.0))
SIDE, QUICK_SIDE, SEEDS = 1024, 128, 2
LEVEL, TILTED = np.eye(3), np.linalg.qr([[0.6, 0.5, -0.3], [0.2, 0.7, 0.4], [-0.5, 0.3, 0.8]])[0]


def measure_departures(subject: Subject, *, quick: bool) -> Iterator[Row]:
    """Count lit points rendered dark, out of 2^21 per scene and place, and dark points that are rendered lit."""
    for factor, sizes in PLACES:
        place, where = 2 * factor * sizes * AWAY, words(sizes, factor)
        scenes = lit_scenes(place, factor, level_only=sizes > 1e6) | held_scenes(place, factor, level_only=sizes > 1e6)
        for name, scene in scenes.items():
            yield Row("G9", f"{name}, {where}: dark", *wrong_pixels(subject, scene, quick, lit=False))
        yield Row("G9", f"closed box, {where}: lit", *wrong_pixels(subject, dark_box(place, factor), quick, lit=True))


def wrong_pixels(subject: Subject, scene: Scene, quick: bool, *, lit: bool) -> tuple[int, int]:
    """Return how many pixels were rendered with one sample each, and how many of them are lit (`lit`) or dark."""
    side, found, seeds = (QUICK_SIDE, 0, 1) if quick else (SIDE, 0, SEEDS)
    for seed in range(seeds):
        settings = replace(scene.render, size=(side, side), seed=seed)
        shining = subject.picture(replace(scene, render=settings)).any(axis=2)
        found += int(np.count_nonzero(shining == lit))
    return side * side * seeds, found


def lit_scenes(place: Doubles, factor: float, *, level_only: bool) -> dict[str, Scene]:
    """Return scenes of about size 2·factor around `place` that fill the image, with unoccluded lights."""
    level = _scene(place, factor, LEVEL, PLANE, [0.3, 1, 0.2], [0.2, 2, 0.3])
    scenes = {"level plane": level, "grazed plane": replace(level, lights=[_light(LEVEL, [1, 0.01, 0.2])])}
    if level_only:
        return scenes
    sphere = replace(
        _scene(place, factor, LEVEL, PLANE, [0.2, 3, 0.3], [0.2, 3, 0.3]),
        meshes=[],
        spheres=[Sphere(center=_tuple(place.astype(np.float32)), radius=factor)],
    )
    return scenes | {
        "tilted plane": _scene(place, factor, TILTED, PLANE, [0.3, 1, 0.2], [0.2, 2, 0.3]),
        "corner of two walls": _scene(place, factor, TILTED, WALLS, [0.5, 1, 0], [1, 1.2, 0.1]),
        "sphere": replace(sphere, camera=replace(sphere.camera, fov_degrees=25)),
    }


def held_scenes(place: Doubles, factor: float, *, level_only: bool) -> dict[str, Scene]:
    """Return scenes the device can't recenter: with a sphere on the other side of the origin; or with a huge ground."""
    if not place.any():
        ground = Sphere(center=(0, -1e6 * factor, 0), radius=1e6 * factor)
        level = lit_scenes(place, factor, level_only=True)["level plane"]
        return {"ground a million times as large": replace(level, meshes=[], spheres=[ground])}
    ball = Sphere(center=_tuple(-place), radius=0.5 * factor)
    return {
        f"{name} and a far sphere": replace(scene, spheres=[*scene.spheres, ball])
        for name, scene in lit_scenes(place, factor, level_only=level_only).items()
        if "corner" not in name
    }


def dark_box(place: Doubles, factor: float) -> Scene:
    """Return a closed box around the camera, with a sky outside."""
    corners = np.stack(np.unravel_index(np.arange(8), (2, 2, 2)), axis=1) * 2.0 - 1
    sides = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    faces = np.concatenate([sides[:, [0, 1, 2]], sides[:, [0, 2, 3]]]).astype(np.int32)
    box = Mesh((place + 2 * factor * corners).astype(np.float32), faces)
    camera = replace(_camera(place, factor, LEVEL, [0.5, 0.4, 0.3]), fov_degrees=120)
    return Scene(
        meshes=[box], camera=camera, environment=Environment(color=(1, 1, 1)), render=RenderSettings(max_depth=8)
    )


#: PLANE: a triangle around the origin in the plane y = 0; WALLS: two triangles, walls at x = 0 and y = 0.
PLANE = np.array([[[-20, 0, -12], [0, 0, 24], [20, 0, -12]]])
WALLS = np.array([[[0, 0, -20], [0, 0, 20], [40, 0, 0]], [[0, 0, -20], [0, 40, 0], [0, 0, 20]]])


def _scene(
    place: Doubles, factor: float, frame: Doubles, triangles: Doubles, light: list[float], camera: list[float]
) -> Scene:
    points = (place + factor * triangles.reshape(-1, 3) @ frame).astype(np.float32)
    faces = np.arange(len(points), dtype=np.int32).reshape(-1, 3)
    return Scene(
        meshes=[Mesh(points, faces, Diffuse(color=(0.5, 0.5, 0.5)))],
        lights=[_light(frame, light)],
        camera=_camera(place, factor, frame, camera),
        render=RenderSettings(integrator="direct"),
    )


def _light(frame: Doubles, towards: list[float]) -> DirectionalLight:
    return DirectionalLight(direction=_tuple(-np.asarray(towards) @ frame), irradiance=(3, 3, 3))


def _camera(place: Doubles, factor: float, frame: Doubles, position: list[float]) -> Camera:
    return Camera(
        position=_tuple(place + factor * np.asarray(position) @ frame),
        look_at=_tuple(place),
        up=_tuple(np.array([0, 0, 1]) @ frame),
    )


def _tuple(vector: Doubles) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z
