"""The raster integrator: first hits against float64 and against rays, and its images against those of `local`."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.rays.raster_speed import seen_both_ways
from clrt.device.open import Device
from clrt.formats.load_scene import load
from clrt.rendering.compile.choices import Choices
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.scene.lights import DirectionalLight
from clrt.scene.materials.material_types import Diffuse, Mirror
from clrt.scene.model import Camera, Environment, Instance, Mesh, RenderSettings, Scene, Sphere

from ..covering import others
from .pictures import box, film, frame, quad, session, view_rays
from .rays import grid, hit_triangles, icosphere
from .test_variants import everything, painted, planted

Doubles = NDArray[np.float64]
SIZE = (29, 21)
SETTINGS = RenderSettings(size=SIZE, spp=4, integrator="raster", max_depth=2)
SCENES = Path(__file__).parents[2] / "scenes"
GALLERY = sorted(path.stem for path in SCENES.glob("*.toml"))
#: Sights of which others have as many triangles, as large on the image, or are as narrow.
ALIKE = ("5120 triangles", "the same, narrow", "a floor of many")
#: Barycentric margin relative to a triangle; in the image, float32 leaves an error of about 1e-6.
MARGIN = 1e-3


def soup(count: int, seed: int) -> Mesh:
    """Return triangles of any size all around the origin, many of them through the plane of a camera there."""
    rng = np.random.default_rng(seed)
    sizes = 10.0 ** rng.uniform(-2, 0.7, (count, 1, 1))
    corners = rng.uniform(-4, 4, (count, 1, 3)) + sizes * rng.normal(size=(count, 3, 3))
    return Mesh(corners.reshape(-1, 3).astype(np.float32), np.arange(3 * count, dtype=np.int32).reshape(-1, 3))


def ball(subdivisions: int, center: tuple[float, float, float] = (0.0, 0.0, 0.0), stretch: float = 1.0) -> Mesh:
    vertices, faces = icosphere(subdivisions)
    return Mesh((vertices * [1, stretch, 1] + center).astype(np.float32), faces)


def with_rubbish(mesh: Mesh) -> Mesh:
    """Add triangles without area: points, lines, and one that the camera at the origin sees edge-on."""
    bad = np.array([[[0, 0, -1]] * 3, [[-1, 0, -1], [1, 0, -1], [0, 0, -1]], [[-1, 0, -1], [1, 0, -1], [0, 0, -2]]])
    faces = np.arange(9, dtype=np.int32).reshape(3, 3) + np.int32(len(mesh.vertices))
    return Mesh(
        np.concatenate([mesh.vertices, bad.reshape(-1, 3)]).astype(np.float32), np.concatenate([mesh.faces, faces])
    )


def plain(half: float, below: float) -> Mesh:
    return quad([(-half, -below, half), (half, -below, half), (half, -below, -half), (-half, -below, -half)], Diffuse())


AHEAD = Camera(position=(0.0, 0.0, 0.0), look_at=(0.1, -0.2, -1.0), fov_degrees=70)
SIGHTS: dict[str, tuple[Mesh, Camera]] = {
    "5120 triangles": (ball(4, (0.0, 0.0, -3.0)), AHEAD),
    "from inside": (ball(4), replace(AHEAD, position=(0.2, 0.1, 0.3))),
    "smaller than samples": (ball(4, (0.0, -8.0, -40.0)), AHEAD),
    "through the eye's plane": (soup(3000, 1), AHEAD),
    "the same, wide": (soup(600, 2), replace(AHEAD, fov_degrees=160)),
    "the same, narrow": (soup(3000, 3), replace(AHEAD, fov_degrees=2)),
    "ground below": (plain(1e5, 1e-3), AHEAD),
    "a room": (box(2.0, Diffuse()), AHEAD),
    "a floor of many": (Mesh(grid(40)[0] - np.array([20.3, 0.7, 20.2], np.float32), grid(40)[1]), AHEAD),
    "slivers": (ball(3, (0.0, 0.0, -3.0), stretch=1e-4), replace(AHEAD, position=(0.0, 0.01, 0.0), look_at=(0, 0, -3))),
    "without an area": (with_rubbish(ball(2, (0.0, 0.0, -4.0))), AHEAD),
}


@cache
def exactly_seen(name: str, *places: bytes) -> tuple[Doubles, NDArray[np.int64], Doubles]:
    """Return the distance of first hits at image points x and y, the triangle, and the decision's margin."""
    mesh, camera = SIGHTS[name]
    x, y = ((np.frombuffer(axis, np.float32).astype(np.float64) + 1) * size / 2 for axis, size in zip(places, SIZE))
    directions = view_rays(camera, SIZE, x, y)
    origins = np.broadcast_to(np.array(camera.position, np.float32).astype(np.float64), directions.shape)
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    t, triangle, margin = hit_triangles(corners[areas > 0], origins, directions)
    return t * np.linalg.norm(directions, axis=1), np.flatnonzero(areas > 0)[triangle], margin


@pytest.mark.parametrize(
    "name, lanes",
    [
        *((name, 8) for name in SIGHTS if name not in ALIKE),
        ("through the eye's plane", 1),
        *others(*((name, 8) for name in ALIKE)),
        *others(("5120 triangles", 1), ("5120 triangles", 16), ("through the eye's plane", 16)),
    ],
)
def test_what_is_seen_first_is_what_float64_says(device: Device, name: str, lanes: int) -> None:
    """First hits agree wherever they do not depend on rounding."""
    mesh, camera = SIGHTS[name]
    seen, _ = seen_both_ways(device, Scene(meshes=[mesh], camera=camera, render=SETTINGS), lanes=lanes)
    lengths, triangle, margin = exactly_seen(name, seen["x"].tobytes(), seen["y"].tobytes())
    sure = margin > MARGIN
    assert sure.mean() > (0.3 if name in ("smaller than samples", "slivers", "ground below") else 0.8)
    found, expected = seen["primitive"].ravel()[sure], np.where(np.isfinite(lengths), triangle, -1)[sure]
    assert np.array_equal(found, expected), np.count_nonzero(found != expected)
    hit = sure & np.isfinite(lengths)
    np.testing.assert_allclose(seen["t"].ravel()[hit], lengths[hit], rtol=2e-3 if name == "ground below" else 1e-4)


@pytest.mark.parametrize("name", ["from inside", "a room"])
@pytest.mark.parametrize("sample", range(3))
def test_closed_meshes_have_no_cracks(device: Device, name: str, sample: int) -> None:
    mesh, camera = SIGHTS[name]
    settings = replace(SETTINGS, size=(512, 512), seed=sample)
    seen, _ = seen_both_ways(device, Scene(meshes=[mesh], camera=camera, render=settings), sample)
    assert np.all(seen["primitive"] >= 0)


def test_places_on_edges_belong_to_a_triangle_beside_them(device: Device) -> None:
    """A fan around the view axis and a regular pixel grid: samples on edges could be missed or hit twice."""
    vertices, faces = grid(8)
    mesh = Mesh(vertices[:, [0, 2, 1]] - np.array([4, 4, 4], np.float32), faces)
    camera = Camera(position=(0.0, 0.0, 0.0), look_at=(0.0, 0.0, -1.0), fov_degrees=90)
    settings = replace(SETTINGS, size=(256, 256))
    seen, traced = seen_both_ways(device, Scene(meshes=[mesh], camera=camera, render=settings))
    assert np.all(seen["primitive"] >= 0) and np.mean(seen["primitive"] == traced["primitive"]) > 0.999


def test_of_equals_the_first_is_seen(device: Device) -> None:
    mesh = ball(2, (0.0, 0.0, -3.0))
    twice = replace(mesh, faces=np.concatenate([mesh.faces] * 3))
    seen, _ = seen_both_ways(device, Scene(meshes=[twice], camera=AHEAD, render=SETTINGS))
    assert seen["primitive"].max() < len(mesh.faces) and np.any(seen["primitive"] >= 0)


@pytest.mark.parametrize(
    "spheres",
    [
        [Sphere(center=(x, y, -6.0), radius=0.3) for x in (-2.0, 0.0, 2.0) for y in (-2.0, 0.0, 2.0)],
        [Sphere(center=(0.0, 0.1, 0.0), radius=5.0)],
        [Sphere(center=(0.0, -1e5, 0.0), radius=1e5 - 1)],
        [Sphere(center=(0.0, -20.0, -120.0), radius=0.9), Sphere(center=(-1.0, 0.0, -0.2), radius=0.9)],
        *others([Sphere(center=(0.3 * i - 3, np.sin(i), -4 - 0.1 * i), radius=0.2) for i in range(40)]),
    ],
    ids=["few", "around the eye", "ground", "far and beside", "many"],
)
def test_spheres_are_seen_as_rays_hit_them(device: Device, spheres: list[Sphere]) -> None:
    """The same test of the same ray is used: results are equal except for the side of a silhouette."""
    scene = Scene(spheres=spheres, meshes=[soup(20, 4)], camera=AHEAD, render=replace(SETTINGS, size=(128, 96)))
    for each in (scene, replace(scene, meshes=[])):
        seen, traced = seen_both_ways(device, each)
        same = seen["primitive"] == traced["primitive"]
        assert np.mean(same) > 0.999 and np.any(traced["primitive"] >= 0)
        round_ones = same & (seen["primitive"] >= sum(len(mesh.faces) for mesh in each.meshes))
        assert np.array_equal(seen["t"][round_ones], traced["t"][round_ones])


def corners_of(device: Device, scene: Scene, seen: NDArray[Any]) -> Doubles:
    """Return the corners (n, 3, 3) of the triangles of SEEN records, in the frame of the camera's scene."""
    scene = replace(scene, render=replace(scene.render, integrator="raster"))
    compiled = compile_scene(scene, Choices(), device=device)
    which, to_world = seen["primitive"].astype(np.int64), np.eye(3, 4)[None]
    if "placements" in compiled.buffers:
        placements = compiled.buffers["placements"][1][seen["instance"]]
        which, to_world = which + placements["first"], placements["to_world"].astype(np.float64)
    triangles = compiled.buffers["triangles"][1][np.minimum(which, int(compiled.counts["triangles"][0]) - 1)]
    corners = np.stack([triangles[name] for name in ("p0", "p1", "p2")], axis=1).astype(np.float64)
    return np.asarray(corners @ to_world[..., :3].transpose(0, 2, 1) + to_world[:, None, :, 3])


def to_edges(corners: Doubles, camera: Camera, size: tuple[int, int], seen: NDArray[Any]) -> Doubles:
    """Return the distance in pixels (n,) from the points of SEEN records to the nearest edge line of their
    triangles."""
    forward, right, up, extent = frame(camera)
    across, down = extent * size[0] / size[1] * right, -extent * up
    p = corners - camera.position
    n = np.cross(p, np.roll(p, -1, axis=1))
    a, b, c = n @ across, n @ down, n @ forward
    value = a * seen["x"][:, None] + b * seen["y"][:, None] + c
    return np.asarray(np.min(np.abs(value) / np.hypot(a * 2 / size[0], b * 2 / size[1]), axis=1))


def bare(scene: Scene) -> Scene:
    """Return only the scene's shapes, with one material, so that most scenes share a program."""
    meshes = {
        id(mesh): Mesh(mesh.vertices, mesh.faces)
        for mesh in [*scene.meshes, *(instance.mesh for instance in scene.instances)]
    }
    return Scene(
        meshes=[meshes[id(mesh)] for mesh in scene.meshes],
        instances=[Instance(meshes[id(instance.mesh)], instance.to_world) for instance in scene.instances],
        spheres=[Sphere(center=ball.center, radius=ball.radius) for ball in scene.spheres],
        camera=scene.camera,
        render=scene.render,
    )


@pytest.mark.parametrize("name", [*(name for name in GALLERY if name != "instances"), *others("instances")])
def test_the_gallery_is_seen_as_rays_see_it(device: Device, name: str) -> None:
    """Primitive and instance ids agree, except where an edge of one of both triangles is within 0.01 pixels."""
    scene = bare(load(SCENES / f"{name}.toml"))
    size = 96, 96 * scene.render.size[1] // scene.render.size[0]
    camera = replace(scene.camera, aperture_radius=0.0, focus_distance=None)
    scene = replace(scene, camera=camera, render=replace(scene.render, size=size))
    seen, traced = seen_both_ways(device, scene)
    other = (seen["primitive"] != traced["primitive"]) | (seen["instance"] != traced["instance"])
    assert np.mean(other) < (0.02 if name == "instances" else 1e-3)
    if other.any():
        near = [
            np.where(each["primitive"] < 0, np.inf, to_edges(corners_of(device, scene, each), camera, size, each))
            for each in (seen[other], traced[other])
        ]
        assert np.max(np.minimum(*near)) < 0.01


def differing(one: Doubles, other: Doubles) -> float:
    return float(np.mean(np.any(np.abs(one - other) > 1e-4 * (other + 0.1), axis=2)))


BELL = replace(everything(), render=replace(everything().render, filter="blackman_harris"))
PLANTED = planted(painted(BELL))


@pytest.mark.programs
@pytest.mark.parametrize("scene, lanes", [(PLANTED, 8), *others((BELL, 1))], ids=["planted, 8", "wide filter, 1"])
def test_pictures_are_those_of_local(device: Device, scene: Scene, lanes: int) -> None:
    """They agree sample by sample except at edges; mirrors, glass, alpha masks, textures and shadows use the first
    hit."""
    one, other = (
        film(device, replace(scene, render=replace(scene.render, integrator=integrator)), lanes=lanes).mean
        for integrator in ("raster", "local")
    )
    assert differing(one, other) < 0.01 and one.std() > 0.1


@pytest.mark.programs
@pytest.mark.parametrize("integrator", ["raster", "local"])
def test_without_shadows_all_that_faces_a_light_is_lit(device: Device, integrator: Any) -> None:
    """A sphere between a sun overhead and the ground: without shadows color·(sky + sun) everywhere; with them
    there is one below the sphere."""
    sun, sky, red = DirectionalLight(direction=(0, -1, 0), irradiance=(np.pi,) * 3), (0.1, 0.2, 0.3), (0.7, 0.3, 0.2)
    shade = Sphere(center=(0.0, 3.0, 0.0), radius=1.0)
    camera = Camera(position=(0.0, 1.0, 0.0), look_at=(0.0, 0.0, 0.0), up=(0.0, 0.0, -1.0), fov_degrees=100)
    ground = replace(plain(50.0, 0.0), material=Diffuse(color=red))
    settings = replace(SETTINGS, integrator=integrator, shadows=False)
    scene = Scene(
        meshes=[ground],
        spheres=[shade],
        lights=[sun],
        camera=camera,
        environment=Environment(color=sky),
        render=settings,
    )
    lit = np.broadcast_to(np.multiply(red, np.add(sky, 1)), (*SIZE[::-1], 3))
    np.testing.assert_allclose(film(device, scene).mean, lit, rtol=1e-5)
    if integrator == "raster":
        dark = film(device, replace(scene, render=replace(settings, shadows=True))).mean[10, 14]
        np.testing.assert_allclose(dark, np.multiply(red, sky), rtol=1e-5)


@pytest.mark.programs
def test_mirrors_end_with_the_depth(device: Device) -> None:
    """At depth 2 a mirror shows the sky and emitters; at higher depths, what it reflects."""
    mirror = quad([(-2, -2, -2), (2, -2, -2), (2, 2, -2), (-2, 2, -2)], Mirror(color=(0.5,) * 3))
    behind = quad([(-9, -9, 3), (9, -9, 3), (9, 9, 3), (-9, 9, 3)], Diffuse(color=(0.7,) * 3))
    scene = Scene(
        meshes=[mirror, behind],
        camera=replace(AHEAD, look_at=(0.0, 0.0, -1.0), fov_degrees=20),
        environment=Environment(color=(0.6, 0.6, 0.6)),
        render=SETTINGS,
    )
    shallow, deep = (film(device, replace(scene, render=replace(SETTINGS, max_depth=depth))).mean for depth in (2, 3))
    assert not shallow.any() and np.allclose(deep, 0.5 * 0.6 * 0.7, rtol=1e-5)


@pytest.mark.programs
def test_it_follows_a_camera_that_moves(device: Device) -> None:
    scene = replace(PLANTED, render=replace(PLANTED.render, integrator="raster", max_depth=2))
    moved = replace(scene, camera=Camera(position=(2.0, 1.0, 5.0), look_at=(0.0, 1.0, 0.0)))
    running, other = session(device, scene), session(device, moved)
    for name in ("position", "right", "up", "forward"):
        running.launch[name] = other.launch[name]
    for each in (running, other):
        assert list(each.render(2))
    assert np.array_equal(running.film().mean, other.film().mean)


@pytest.mark.programs
def test_thousands_of_instances_are_numbered_right(device: Device) -> None:
    vertices, faces = icosphere(3)
    places = [
        np.column_stack([np.diag([s, 0.5, -s]) * 0.4, [x, 0.0, -z]])
        for s, x, z in ((0.5 + 0.1 * (i % 7), i % 12 - 5.5, 3 + i // 12) for i in range(120))
    ]
    shown = Mesh(vertices, faces)
    scene = Scene(
        meshes=[plain(30.0, 1.0)],
        instances=[Instance(shown, place) for place in places],
        camera=Camera(position=(0.0, 4.0, 2.0), look_at=(0.0, 0.0, -6.0), fov_degrees=70),
        spheres=[Sphere(center=(0.0, 1.0, -4.0), radius=0.5)],
        render=replace(SETTINGS, size=(200, 150)),
    )
    seen, traced = seen_both_ways(device, scene)
    assert len(np.unique(traced["instance"])) > 60
    same = (seen["primitive"] == traced["primitive"]) & (seen["instance"] == traced["instance"])
    assert np.mean(same) > 0.998
