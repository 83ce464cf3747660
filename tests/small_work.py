"""Runs every kernel in all its variants on inputs small enough for a simulator."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

import clrt
from clrt.accel.build import build_tree
from clrt.accel.device_builder import SHAPES
from clrt.accel.traversal_kernels import BOX_TESTS, SPHERE_TESTS, TREES, TRIANGLE_TESTS, UPPER_LEVELS, HitTests
from clrt.bench.kernel_probe import choices
from clrt.debug.trace import trace_pixel
from clrt.device.open import Device
from clrt.output.aov_files import layered
from clrt.queries.query_program import TRAVERSALS
from clrt.rendering.accumulation.denoiser_guides import render_guides
from clrt.rendering.accumulation.first_hits import first_hits
from clrt.rendering.accumulation.launch_plan import LaunchPlan
from clrt.rendering.accumulation.single_device import SingleDeviceAccumulation
from clrt.rendering.aovs import AOVS, film_aovs
from clrt.rendering.compile.choices import OFFSETS
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.rendering.film.film import Film
from clrt.rendering.guiding.training import Training, guided
from clrt.scene.model import Environment, Mesh, RenderSettings, Scene, Sphere
from clrt.scene.ray_list import Measured, RayList

from .accel.cases import soup, spheres
from .rendering.lamps import lamps
from .rendering.rays import icosphere
from .rendering.test_variants import everything, painted, planted, shelf, sights
from .rendering.test_wavefront import catching

SETTINGS = RenderSettings(size=(6, 4), spp=2, max_depth=5, seed=11)
TRIANGLES = soup(60, 0.5)
FACES = np.arange(3 * len(TRIANGLES), dtype=np.int32).reshape(-1, 3)
RNG = np.random.default_rng(7)
ORIGINS = RNG.uniform(-1, 2, (33, 3)).astype(np.float32)
DIRECTIONS = (RNG.random((33, 3)) - ORIGINS).astype(np.float32)
TO_WORLD = np.concatenate([np.linalg.qr(RNG.normal(size=(5, 3, 3)))[0], RNG.normal(size=(5, 3, 1))], axis=2)
TRAINING = Training((1, 1), 24)
Answers = dict[str, NDArray[Any]]


def scene() -> Scene:
    """Return a scene with all kinds of primitives, materials and lights, and few triangles."""
    full, (vertices, faces) = everything(), icosphere(0)
    smooth = [
        Mesh((mesh.vertices.mean(axis=0) + vertices).astype(np.float32), faces, mesh.material, normals=vertices)
        for mesh in full.meshes
        if mesh.normals is not None
    ]
    return replace(full, meshes=[*(mesh for mesh in full.meshes if mesh.normals is None), *smooth], render=SETTINGS)


def started(device: Device, what: Scene, **chosen: Any) -> SingleDeviceAccumulation:
    """Return a session ready to render the scene. chosen: see Choices."""
    plan = LaunchPlan.of(what.render, None)
    compiled, *_ = guided([device], [compile_scene(what, choices(device, **chosen), device=device)], plan, TRAINING)
    return SingleDeviceAccumulation(device, compiled, plan)


def picture(device: Device, what: Scene, **chosen: Any) -> Answers:
    """Return the mean image, (h, w, 3). chosen: see Choices."""
    return {"mean": film(started(device, what, **chosen), what.render.spp).mean}


def film(session: SingleDeviceAccumulation, spp: int) -> Film:
    """Render and return the film."""
    for _ in session.render(spp):
        pass
    return session.film()


def hits(query: clrt.RayQuery | clrt.InstancedRayQuery) -> Answers:
    """Return the closest hits, the first two hits, and whether anything is hit within t = 0.7, per ray."""
    closest, (ray, several) = query.closest_hit(ORIGINS, DIRECTIONS), query.all_hits(ORIGINS, DIRECTIONS, max_hits=2)
    return {
        "t": closest["t"],
        "primitive": closest["primitive"],
        "blocked": query.any_hit(ORIGINS, DIRECTIONS, 0.7),
        "ray": ray,
        "several": several["primitive"],
    }


def mesh_hits(device: Device, layout: str, traversal: str) -> Answers:
    """Intersect a mesh with a BVH that was built over other triangles and refitted."""
    query = clrt.RayQuery(
        TRIANGLES[::-1].reshape(-1, 3),
        FACES,
        device=device.info.index,
        layout=layout,
        builder="sah",
        traversal=traversal,
    )
    query.refit(TRIANGLES.reshape(-1, 3))
    return hits(query)


def instance_hits(device: Device, layout: str, traversal: str) -> Answers:
    """Intersect five instances of two meshes."""
    meshes = [(TRIANGLES[part].reshape(-1, 3), FACES[: len(TRIANGLES[part])]) for part in (slice(0, 40), slice(40, 60))]
    return hits(
        clrt.InstancedRayQuery(
            meshes, [0, 1, 1, 0, 1], TO_WORLD, device=device.info.index, layout=layout, traversal=traversal
        )
    )


def variants() -> Iterator[tuple[RenderSettings, dict[str, Any]]]:
    """Yield each alternative triangle, box and sphere test and ray offset at least once, except the defaults, which
    other work covers; and each other sampler."""
    settings = [replace(SETTINGS, sampler="stratified", filter="tent"), replace(SETTINGS, sampler="independent")]
    for i, triangle in enumerate(TRIANGLE_TESTS):
        box, sphere, offset = (list(known)[i % len(known)] for known in (BOX_TESTS, SPHERE_TESTS, OFFSETS))
        if i:
            yield settings[i % 2], {"tests": HitTests(triangle, box, sphere), "offset": offset}


def ball() -> Scene:
    """Return a scene with one material type."""
    alone = Scene(spheres=[Sphere()], environment=Environment(color=(1, 1, 1)), render=SETTINGS)
    return replace(alone, lights=lamps(3).lights)


def measured(device: Device) -> Iterator[tuple[str, Answers]]:
    """Yield measurements of light at two points of surfaces."""
    normals = np.array([[0, 1, 0], [0.6, 0.8, 0]], np.float32)
    for measures in get_args(Measured):
        rays = RayList(origins=ORIGINS[:2], directions=normals, surface_normals=normals, measures=measures)
        settings = replace(SETTINGS, size=rays.size, filter="box")
        yield measures, picture(device, replace(scene(), camera=rays, render=settings), paths="lanes")


def queued_pictures(device: Device) -> Iterator[tuple[str, Answers]]:
    """Yield images that are rendered by queues, which need scalar kernels."""
    if device.lanes > 1:
        return
    painting = replace(painted(scene()), render=SETTINGS)
    subjects = {
        "scene": scene(),
        "ball": ball(),
        "painted": dict(sights(painting))["lens"],
        "planted": planted(painting),
    }
    for name, subject in subjects.items():
        apart = {"direct_light": name == "scene", "light_groups": name == "ball"}
        yield f"{name} queues", picture(device, subject, paths="queues", **apart)


def work(device: Device) -> Iterator[tuple[str, Answers]]:
    """Yield answers by subject and variant. All devices should give the same."""
    for layout in TREES:
        builder = "ploc" if layout in SHAPES else "sah"
        yield f"scene {layout}", picture(device, scene(), layout=layout, builder=builder)
    yield from queued_pictures(device)
    for settings, chosen in variants():
        yield chosen["tests"].triangle, picture(device, replace(scene(), render=settings), **chosen)
    yield "ball", picture(device, ball())
    yield "guided", picture(device, scene(), guiding="on")
    yield "ball groups", picture(device, ball(), light_groups=True)
    yield "catching", picture(device, replace(catching(scene()), render=replace(SETTINGS, transparent=True)))
    yield from measured(device)
    lit = replace(lamps(40), spheres=[*lamps(40).spheres, Sphere(radius=0.8)], render=SETTINGS)
    yield "lamps", picture(device, lit)
    painting = replace(painted(scene()), render=SETTINGS)
    seen = dict(sights(painting))
    yield "painted", picture(device, seen["lens"])
    yield "guides of it", {**render_guides(started(device, seen["lens"]), 2)}
    cameras = {"normals": "orthographic", "albedo": "equirectangular"}
    for name in sorted(seen.keys() - {"lens", *cameras.values()}):
        yield name, picture(device, replace(seen[name], camera=seen[cameras.get(name, name)].camera))
    yield "shelf", picture(device, replace(shelf(), render=SETTINGS))
    for layout in UPPER_LEVELS:
        yield f"planted {layout}", picture(device, planted(painting), layout=layout)
    apart = started(device, scene(), direct_light=True)
    light = film(apart, SETTINGS.spp)
    every = first_hits(apart, scene(), AOVS) | film_aovs(light, AOVS)
    yield "aovs", {"layers": layered(light.mean.astype(np.float32), every)[0]}
    yield "guides", {**render_guides(started(device, scene()), 2)}
    for name, subject in (("pixel", scene()), ("planted_pixel", planted(painting))):
        yield name, {"values": trace_pixel(subject, device, (3, 2)).values}
    build_tree(device, device.layout, "ploc", soup(0), spheres(30))
    build_tree(device, device.layout, "reinsertion", soup(120, 0.3))
    for layout, traversal in [*((layout, "single") for layout in TREES), *(("bvh8", way) for way in TRAVERSALS[1:])]:
        yield f"mesh {layout} {traversal}", mesh_hits(device, layout, traversal)
        if layout in UPPER_LEVELS and traversal != "packet":
            yield f"instances {layout} {traversal}", instance_hits(device, layout, traversal)
