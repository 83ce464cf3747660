"""Check small images with known pixels. They take several launches, most of them with several samples per pixel."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..device.open import Device
from ..rendering.film.film import Film
from ..rendering.renderer import Renderer
from ..scene.lights import DirectionalLight, PointLight
from ..scene.materials.material_types import Diffuse, Material, Mirror
from ..scene.model import Camera, Environment, Mesh, Scene, Sphere
from .effort import effort, share
from .findings import Findings

SIZE = 16
#: Path depth in the room, enough for Russian roulette to end some paths.
DEPTH = 6
#: A mean further than this many standard errors from the expected value fails; by chance one in a million does.
SIGMAS = 5.0


def check_furnace(device: Device, findings: Findings) -> None:
    """Furnace test: under a white sky, a plane that does not see itself has exactly its colour, and the sky is white.

    In the middle half of the image: diffuse on the left, mirror on the right, white above and coloured below.
    """
    truth, meshes, quarter = np.ones((SIZE, SIZE, 3), np.float32), list[Mesh](), SIZE // 4
    for row, colors in enumerate([((1.0, 1.0, 1.0), (1.0, 1.0, 1.0)), ((0.5, 0.25, 0.75), (0.75, 0.5, 0.25))]):
        for column, (kind, color) in enumerate(zip((Diffuse, Mirror), colors)):
            corner = (0.5 * column - 0.5, -0.5 * row, 0.0)
            meshes.append(_quad(corner, (0.5, 0.0, 0.0), (0.0, 0.5, 0.0), kind(color=color)))
            truth[quarter * (row + 1) : quarter * (row + 2), quarter * (column + 1) : quarter * (column + 2)] = color
    film = _film(
        device,
        findings,
        Scene(
            meshes=meshes,
            environment=Environment(color=(1.0, 1.0, 1.0)),
            camera=Camera(position=(0.0, 0.0, 1.0), look_at=(0.0, 0.0, 0.0), fov_degrees=90),
        ),
        spp=16,
    )
    findings.same(film.mean.astype(np.float32).ravel(), truth.ravel(), "colour under a white sky")


def check_lamp(device: Device, findings: Findings) -> None:
    """Check a floor, a wall and a point light: black behind the wall, else color/π · I · cos θ/d² within the pixel."""
    color, intensity, (x, height, z) = (0.8, 0.5, 0.2), (60.0, 40.0, 20.0), (0.75, 3.0, 0.5)
    material = Diffuse(color=color)
    floor = _quad((-9.0, 0.0, 9.0), (18.0, 0.0, 0.0), (0.0, 0.0, -18.0), material)
    wall = _quad((0.0, 0.0, 9.0), (0.0, 3.5, 0.0), (0.0, 0.0, -18.0), material)
    film = _film(
        device,
        findings,
        Scene(
            meshes=[floor, wall],
            lights=[PointLight(position=(x, height, z), intensity=intensity)],
            camera=Camera(
                position=(0.0, 4.0, 0.0),
                look_at=(0.0, 0.0, 0.0),
                up=(0.0, 0.0, -1.0),
                fov_degrees=float(np.degrees(2 * np.arctan(1 / 16))),
            ),
        ),
        spp=16,
        max_depth=2,
    )
    edges = np.linspace(-0.25, 0.25, SIZE + 1)  # of the pixels, on the floor, along x and z
    nearest, farthest = [], []
    for lamp in (z, x):
        low, high = edges[:-1] - lamp, edges[1:] - lamp
        nearest.append(np.maximum(np.maximum(low, -high), 0))
        farthest.append(np.maximum(np.abs(low), np.abs(high)))
    light = np.multiply(color, intensity) / np.pi * (edges[:-1, None] >= 0)
    least, most = (
        (height / (height**2 + np.add.outer(b**2, a**2)) ** 1.5)[..., None] * light for b, a in (farthest, nearest)
    )
    inside = (least * (1 - 1e-5) <= film.mean) & (film.mean <= most * (1 + 1e-5))
    findings.expect(
        inside.ravel(),
        "light of a point light on a floor",
        ("gave", film.mean.ravel()),
        ("not between", least.ravel()),
        ("and", most.ravel()),
    )


def check_ball(device: Device, findings: Findings) -> None:
    """Check an emissive sphere in the sun: e + color/π · E · cos θ for some visible point, without any noise.

    So the sphere, which is also an emitter to be sampled, must be known to contribute nothing at each of its own
    points, although rounding leaves the difference that decides it on either side of 0, depending on the device.
    """
    color, shine, sun, radius = (0.8, 0.5, 0.2), (0.1, 0.2, 0.3), (3.0, 2.0, 1.0), 0.7
    center, towards, distance = np.array([0.3, -0.2, 0.1]), np.array([0.36, 0.48, 0.8]), 7.0
    x, y, z = (center + distance * towards).tolist()
    corner = np.arcsin(0.3 * radius / distance)  # angle of the image's corner from the view direction
    film = _film(
        device,
        findings,
        Scene(
            spheres=[Sphere(center=(0.3, -0.2, 0.1), radius=radius, material=Diffuse(color=color, emission=shine))],
            lights=[DirectionalLight(direction=(-0.36, -0.48, -0.8), irradiance=sun)],
            camera=Camera(
                position=(x, y, z),
                look_at=(0.3, -0.2, 0.1),
                fov_degrees=float(np.degrees(2 * np.arctan(np.tan(corner) / np.sqrt(2)))),
            ),
        ),
        spp=16,
        max_depth=2,
    )
    light, least_cosine = np.multiply(color, sun) / np.pi, np.cos(np.arcsin(0.3) - corner)
    inside = (shine + least_cosine * light <= film.mean * (1 + 1e-5)) & (film.mean <= (shine + light) * (1 + 1e-5))
    findings.expect(
        inside.reshape(-1, 3).all(axis=1), "light of the sun on an emissive sphere", ("gave", film.mean.reshape(-1, 3))
    )


def check_room(device: Device, findings: Findings) -> None:
    """Check a closed room whose surfaces all emit e and reflect with albedo a: depth d gives e·(1 + a + … + a^(d − 1)).

    With walls, a diffuse and a mirror sphere: light sampling of triangles and spheres, BSDF sampling, MIS weights, and
    Russian roulette must all add up to that.
    """
    share, shine = np.array([0.8, 0.5, 0.2]), np.array([1.0, 2.0, 0.5])
    diffuse, mirror = (kind(color=(0.8, 0.5, 0.2), emission=(1.0, 2.0, 0.5)) for kind in (Diffuse, Mirror))
    walls = []
    for axis in range(3):
        n, a, b = np.roll(np.eye(3), -axis, axis=0)
        walls += [_quad(-n - a - b, 2 * a, 2 * b, diffuse), _quad(n - a - b, 2 * b, 2 * a, diffuse)]
    film = _film(
        device,
        findings,
        Scene(
            meshes=walls,
            spheres=[
                Sphere(center=(-0.4, -0.3, -0.4), radius=0.4, material=mirror),
                Sphere(center=(0.5, -0.6, -0.2), radius=0.3, material=diffuse),
            ],
            camera=Camera(position=(0.1, 0.2, 0.9), look_at=(0.0, -0.1, -1.0), fov_degrees=70),
        ),
        spp=256,
        max_depth=DEPTH,
        size=SIZE if effort(device) * 256 >= 2 else SIZE // 2,
    )
    truth = shine * (1 - share**DEPTH) / (1 - share)
    count, mean = film.samples, film.mean.mean(axis=(0, 1))
    squares = (film.pixels["square"].astype(np.float64) + film.pixels["square_error"]).sum(axis=(0, 1)) / count
    errors = np.abs(mean - truth) / np.sqrt((squares - mean**2) / count)
    findings.at_most(SIGMAS, errors, "light in a room", "standard errors", truth)


def _quad(corner: ArrayLike, side: ArrayLike, other: ArrayLike, material: Material) -> Mesh:
    """Return a parallelogram, seen from its front if `side` turns to `other` counter-clockwise."""
    a, b, c = (np.asarray(vector, np.float32) for vector in (corner, side, other))
    return Mesh(np.stack([a, a + b, a + b + c, a + c]), np.array([[0, 1, 2], [0, 2, 3]], np.int32), material)


def _film(device: Device, findings: Findings, scene: Scene, spp: int, max_depth: int = 8, size: int = SIZE) -> Film:
    """Return the film of size² pixels with `spp` samples each, fewer on a slow device; lost samples are a failure."""
    spp = share(device, spp, 2)
    renderer = Renderer(scene, device=device.info.id, size=(size, size), max_depth=max_depth)
    *_, state = renderer.passes(spp=spp)
    count, dropped = (state.film.pixels[name].ravel() for name in ("count", "dropped"))
    findings.expect(count == spp, "samples per pixel", ("kept", count), ("dropped", dropped))
    return state.film
