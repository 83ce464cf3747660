"""Difficult lighting with known results: L3, L5 and L9, images against closed forms and quadrature in float64.

A camera that practically sees one point makes all pixels one experiment; its mean must be within some standard errors.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ...scene.lights import PointLight
from ...scene.materials.material_types import Diffuse, Mirror
from ...scene.model import Camera, Environment, Mesh, RenderSettings, Scene, Sphere
from ..rays.hard_meshes import icosphere
from ..rays.workloads import Doubles
from .cases.subject import Subject
from .row import Row

ALBEDO = 0.5
#: A mean is wrong if it is off by more standard errors; the probability of a false alarm is 1 in 300 000.
SIGMAS = 4.5
#: Fraction of light that a white mesh with interpolated normals may lose; it must not gain any.
LOST = 0.02
POINT = Camera(position=(0, 3, 0.001), look_at=(0, 0, 0), up=(0, 0, -1), fov_degrees=0.01)
FLOOR = Mesh(
    np.array([[-9, 0, -9], [-9, 0, 9], [9, 0, 9], [9, 0, -9]], np.float32),
    np.array([[0, 1, 2], [0, 2, 3]], np.int32),
    Diffuse(color=(ALBEDO, ALBEDO, ALBEDO)),
)


def measure_pictures(subject: Subject, *, quick: bool) -> Iterator[Row]:
    """Count the wrong means, and measure their deviations in standard errors."""
    settings = RenderSettings(size=(32, 32), spp=64 if quick else 4096, max_depth=2, sampler="independent")
    for case, what, scene, expected in lit_points():
        film = subject.film(replace(scene, camera=POINT, render=settings))
        mean, count = film.mean[..., 0], film.pixels["count"].astype(np.float64)
        squares = (film.pixels["square"].astype(np.float64) + film.pixels["square_error"])[..., 0]
        variance = np.maximum(squares / count - mean**2, 0).mean() / count.sum() + (1e-6 * expected) ** 2
        sigmas = abs(mean.mean() - expected) / np.sqrt(variance)
        yield Row(case, what, int(count.sum()), int(sigmas > SIGMAS), float(sigmas), "standard errors")
    mirrored = subject.picture(mirrored_lamp(), 4)
    yield Row("L3", "area light in a mirror keeps its radiance", mirrored.size, int(np.count_nonzero(mirrored != 2.5)))
    ball = subject.picture(white_ball(64 if quick else 256), 64 if quick else 256)
    yield Row(
        "L5",
        "white sphere of 80 triangles, smooth normals: gains light",
        ball.size // 3,
        int(np.count_nonzero(ball[..., 0] > 1 + 1e-5)),
    )
    yield Row(
        "L5",
        "white sphere of 80 triangles, smooth normals: loses more than 2 %",
        1,
        int(1 - ball.mean() > LOST),
        float(1 - ball.mean()),
        "lost",
    )


def lit_points() -> Iterator[tuple[str, str, Scene, float]]:
    """Yield case, description, a scene with a floor, and the expected radiance of the floor's center."""
    lamp = PointLight(position=(1, 2, 0.5), intensity=(30, 30, 30))
    d2 = 1 + 4 + 0.25
    yield "L9", "a point light", Scene(meshes=[FLOOR], lights=[lamp]), ALBEDO / np.pi * 30 * 2 / d2**1.5
    for name, radius in (("a spherical light", 0.5), ("a tiny spherical light", 1e-3)):
        scene = Scene(meshes=[FLOOR], spheres=[_lamp((1, 2, 0.5), radius, 2.0)])
        yield "L9" if radius > 0.1 else "L3", name, scene, ALBEDO * 2 * radius**2 * 2 / d2**1.5
    centers = [(x, 2.0, z) for x in np.linspace(-5, 5, 32) for z in np.linspace(-5, 5, 31)]
    lamps = [_lamp(center, 0.02, 10.0 * (1 + i % 7)) for i, center in enumerate(centers)]
    total = sum(
        ALBEDO * ball.material.radiance[0] * 0.02**2 * 2 / (4 + ball.center[0] ** 2 + ball.center[2] ** 2) ** 1.5
        for ball in lamps
    )
    yield "L3", f"{len(lamps)} lamps", Scene(meshes=[FLOOR], spheres=lamps), total
    sky = np.full((256, 512, 3), 0.5, np.float32)
    sky[60:62, 100:102] = 5e4
    yield (
        "L3",
        "a sky with a sun of four pixels",
        Scene(meshes=[FLOOR], environment=Environment(image=sky)),
        ALBEDO / np.pi * sky_irradiance(sky[..., 0].astype(np.float64)),
    )


def sky_irradiance(texels: Doubles, fine: int = 8) -> float:
    """Return a floor's irradiance by quadrature: fine² bilinear points per texel (h, w), v clamped at the poles."""
    height, width = texels.shape
    row = (np.arange(height * fine // 2) + 0.5) / fine - 0.5  # up to the horizon
    column = (np.arange(width * fine) + 0.5) / fine - 0.5
    below, left = np.floor(row).astype(int), np.floor(column).astype(int)
    v, u = (row - below)[:, None], column - left
    rows = [np.clip(below + k, 0, height - 1) for k in (0, 1)]
    across = [(1 - u) * texels[each][:, left % width] + u * texels[each][:, (left + 1) % width] for each in rows]
    mean = (1 - v) * across[0] + v * across[1]
    theta = (row + 0.5) * np.pi / height
    return float((mean.mean(axis=1) * np.sin(theta) * np.cos(theta)).sum() * 2 * np.pi * np.pi / (height * fine))


def mirrored_lamp() -> Scene:
    """Return a scene whose image is filled by a mirror that reflects an area light."""
    mirror = Mesh(FLOOR.vertices, FLOOR.faces, Mirror())
    camera = Camera(position=(0, 3, 3), look_at=(0, 0, 0), fov_degrees=10)
    return Scene(
        meshes=[mirror],
        spheres=[_lamp((0, 4, -4), 2.5, 2.5)],
        camera=camera,
        render=RenderSettings(size=(64, 64), max_depth=4),
    )


def white_ball(side: int) -> Scene:
    """Return a coarse white mesh with the normals of a sphere, in a white environment."""
    vertices, faces = icosphere(1)
    ball = Mesh(vertices, faces, Diffuse(color=(1, 1, 1)), normals=vertices.copy())
    camera, settings = Camera(position=(0, 0, 5), fov_degrees=26), RenderSettings(size=(side, side), max_depth=50)
    return Scene(meshes=[ball], environment=Environment(color=(1, 1, 1)), camera=camera, render=settings)


def _lamp(center: tuple[float, float, float], radius: float, radiance: float) -> Sphere:
    return Sphere(center=center, radius=radius, material=Diffuse(color=(0, 0, 0), emission=(radiance,) * 3))
