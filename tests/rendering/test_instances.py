"""Instances render like meshes transformed in float64, and use the memory of one mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.kernel_probe import choices
from clrt.bench.numerics.cases.instances import transforms_of_kinds
from clrt.bench.significance import mean_test
from clrt.device.open import Device
from clrt.rendering.accumulation.denoiser_guides import render_guides
from clrt.rendering.accumulation.first_hits import first_hits
from clrt.rendering.checkpoint.identity import facts_of
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.scene.geometry import instancing
from clrt.scene.lights import DirectionalLight
from clrt.scene.materials.material_types import Dielectric, Diffuse, Material, MetallicRoughness, Mirror
from clrt.scene.materials.textures import Picture, Texture
from clrt.scene.model import Camera, Environment, Instance, Mesh, RenderSettings, Scene, Sphere

from ..covering import covering, others
from . import rays
from .pictures import film, quad, session

Doubles = NDArray[np.float64]
SETTINGS = RenderSettings(size=(64, 48), spp=4, max_depth=2, seed=3)
KINDS = ("turned", "stretched", "mirrored", "nearly flat")


@pytest.fixture(autouse=True)
def keep_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep instances of small meshes as instances."""
    monkeypatch.setattr(instancing, "FEW_TRIANGLES", 0)


def ball(smooth: bool = True, material: Material = Diffuse()) -> Mesh:
    vertices, faces = rays.icosphere(2)
    wavy = vertices * (1 + 0.1 * np.sin(5 * vertices.sum(axis=1, keepdims=True)))
    return Mesh(wavy.astype(np.float32), faces, material, vertices if smooth else None)


def by_hand(instance: Instance) -> Mesh:
    """Return the mesh in world space: points by the matrix, normals by its inverse transpose, faces that stay
    counter-clockwise on the front, and tangents by the matrix, with the bitangent of the mirrored frame."""
    linear, mesh = instance.to_world[:, :3], instance.mesh
    side = np.sign(np.linalg.det(linear))
    points = mesh.vertices.astype(np.float64) @ linear.T + instance.to_world[:, 3]
    normals = mesh.normals
    if normals is not None:
        normals = normals.astype(np.float64) @ np.linalg.inv(linear)
        normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)
    tangents = mesh.tangents
    if tangents is not None:
        turned = tangents[:, :3].astype(np.float64) @ linear.T
        turned /= np.linalg.norm(turned, axis=1, keepdims=True)
        tangents = np.column_stack([turned, side * tangents[:, 3]]).astype(np.float32)
    faces = mesh.faces if side > 0 else mesh.faces[:, ::-1].copy()
    return replace(
        mesh,
        vertices=points.astype(np.float32),
        faces=faces,
        normals=normals,
        tangents=tangents,
        material=instance.material or mesh.material,
    )


def matrices(kind: str, scale: float = 1.0) -> Doubles:
    """Return twelve matrices that put a ball of radius 1 into a block of 6x4x3."""
    transforms = transforms_of_kinds()[kind].copy()
    transforms[:, :, :3] *= scale * 0.6 / np.linalg.norm(transforms[:, :, :3], axis=1).max(axis=1)[:, None, None]
    transforms[:, :, 3] *= np.array([3, 2, 1.5]) / 8
    return transforms


def crowd(kind: str, spheres: int = 2, smooth: bool = True) -> Scene:
    """Return instances of two meshes, some with their own material, with a floor and spheres, a sun and a sky."""
    glass, gold = Dielectric(), MetallicRoughness(preset="gold", roughness=0.4)
    mesh, other = ball(smooth), ball(False, Mirror())
    rng, to_world = np.random.default_rng(0), matrices(kind)
    instances = [
        Instance(mesh if i % 3 else other, matrix, (None, None, glass, gold)[i % 4])
        for i, matrix in enumerate(to_world)
    ]
    floor = quad([(-9, -2, 9), (9, -2, 9), (9, -2, -9), (-9, -2, -9)], Diffuse(color=(0.7, 0.6, 0.5)))
    balls = [Sphere(center=tuple(rng.uniform(-2, 2, 3).tolist()), radius=0.2) for _ in range(spheres)]
    return Scene(
        meshes=[floor],
        instances=instances,
        spheres=balls,
        render=SETTINGS,
        lights=[DirectionalLight(direction=(1, -2, -1), irradiance=(2, 2, 2))],
        camera=Camera(position=(0, 1, 9)),
        environment=Environment(color=(0.4, 0.5, 0.6)),
    )


def as_meshes(scene: Scene) -> Scene:
    return replace(scene, instances=[], meshes=[*scene.meshes, *map(by_hand, scene.instances)])


def seen(device: Device, scene: Scene) -> tuple[Doubles, Doubles]:
    """Return the image and its normals, (h, w, 3) each."""
    running = session(device, scene)
    for _ in running.render(scene.render.spp):
        pass
    return running.film().mean, render_guides(running)["normal"].astype(np.float64)


@pytest.mark.combinations
@pytest.mark.parametrize("kind", KINDS)
def test_instances_look_like_meshes(device: Device, kind: str) -> None:
    """Nearly all pixels agree to float rounding; at edges a sample may fall on the other side. Flat shapes have more
    edges, and with a thickness of a thousandth the rounding error of normals grows a thousandfold."""
    scene = crowd(kind)
    compiled = compile_scene(scene, choices(device))
    assert {"INSTANCES", "SMOOTH_NORMALS"} <= set(compiled.features) and compiled.instances == 12
    (picture, normals), (expected, expected_normals) = (seen(device, each) for each in (scene, as_meshes(scene)))
    flat = kind == "nearly flat"
    assert (np.abs(picture - expected).max(axis=2) > (1e-2 if flat else 1e-4)).mean() < 0.005
    assert (np.abs(normals - expected_normals).max(axis=2) > (1e-2 if flat else 1e-4)).mean() < 0.005
    assert 0.1 < (np.abs(expected - expected[0, 0]).max(axis=2) > 0.01).mean()  # A large part of the image is covered


@pytest.mark.programs
@pytest.mark.parametrize("kind", ["turned", "stretched", "mirrored"])
def test_textures_normal_maps_and_colours_go_along(device: Device, kind: str) -> None:
    """Also with normal maps that only some instances have, or have for another UV set, and partial opacity."""
    rng, mesh = np.random.default_rng(2), ball()
    count = len(mesh.vertices)
    around = np.cross(mesh.vertices, [0.2, 1, 0.3])
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    mesh = replace(
        mesh,
        uv=rng.random((count, 2), np.float32),
        uv1=rng.random((count, 2), np.float32),
        colors=rng.random((count, 3), np.float32),
        tangents=np.column_stack([around, rng.choice([-1.0, 1.0], 1).repeat(count)]).astype(np.float32),
    )
    noise, bumps = (Picture(rng.integers(low, 256, (4, 4, 4), np.uint8)) for low in (0, 100))
    bumpy = [
        Diffuse(color=Texture(picture=noise), normal_map=Texture(picture=bumps, uv_set=uv_set)) for uv_set in (0, 1)
    ]
    paints = [None, Diffuse(opacity=0.5), *bumpy]
    scene = crowd(kind)
    scene = replace(
        scene, instances=[replace(each, mesh=mesh, material=paints[i % 4]) for i, each in enumerate(scene.instances)]
    )
    compiled = compile_scene(scene, choices(device))
    assert {"TEXTURES", "NORMAL_MAPS", "VERTEX_COLORS", "OPACITY"} <= set(compiled.features)
    assert compiled.instances == 12
    (picture, normals), (expected, expected_normals) = (seen(device, each) for each in (scene, as_meshes(scene)))
    assert (np.abs(picture - expected).max(axis=2) > 1e-4).mean() < 0.005
    assert (np.abs(normals - expected_normals).max(axis=2) > 1e-3).mean() < 0.005


@pytest.mark.statistics
def test_instances_look_like_meshes_after_many_bounces(device: Device) -> None:
    """The channel means agree, from independent random numbers."""
    scene = replace(crowd("stretched"), render=replace(SETTINGS, max_depth=8))
    films = [
        film(device, replace(each, render=replace(each.render, seed=seed)), 64)
        for seed, each in enumerate((scene, as_meshes(scene)))
    ]
    count = films[0].pixels["count"].astype(np.float64)[..., None]
    variance = sum(np.maximum(each.pixels["square"] / count - each.mean**2, 0) / (count - 1) for each in films)
    difference = (films[0].mean - films[1].mean).mean(axis=(0, 1))
    assert mean_test(difference, np.mean(variance, axis=(0, 1)), count.size, 0.0).min() > 1e-3


@pytest.mark.programs
@covering("layout, lanes, spheres", ["bvh2", "cwbvh"], [8, 1], [40, 2])
def test_lanes_and_layouts_agree(device: Device, layout: str, lanes: int, spheres: int) -> None:
    """Layouts trace the same rays and give bit-identical images; SIMD widths agree to float rounding.
    Spheres are tested before the BVH or stored in it."""
    scene = crowd("stretched", spheres)
    expected = film(device, scene, lanes=8, layout="bvh8").mean
    picture = film(device, scene, lanes=lanes, layout=layout).mean
    assert (np.abs(picture - expected).max(axis=2) > (0 if lanes == 8 else 1e-5)).mean() <= (0 if lanes == 8 else 0.005)


@pytest.mark.programs
@pytest.mark.parametrize("rest", ["spheres", *others("nothing")])
def test_whatever_else_is_in_the_scene(device: Device, rest: str) -> None:
    scene = crowd("turned")
    scene = replace(scene, meshes=[], spheres=scene.spheres if rest == "spheres" else [])
    picture, expected = (film(device, each).mean for each in (scene, as_meshes(scene)))
    assert (np.abs(picture - expected).max(axis=2) > 1e-4).mean() < 0.005


@pytest.mark.programs
@pytest.mark.parametrize("mesh_size, world_size", [(2.0**-66, 1.0), (2.0**50, 1.0), (1.0, 2.0**-66), (1.0, 2.0**50)])
def test_sizes_do_not_matter(device: Device, mesh_size: float, world_size: float) -> None:
    """Scaling meshes or the world by powers of two leaves the image bit-identical."""
    scene = replace(crowd("stretched", 0), meshes=[])
    meshes = {
        id(each.mesh): replace(each.mesh, vertices=each.mesh.vertices * np.float32(mesh_size))
        for each in scene.instances
    }
    scaled = replace(
        scene,
        camera=Camera(position=(0, world_size, 9 * world_size)),
        instances=[
            replace(each, mesh=meshes[id(each.mesh)], to_world=world_size * each.to_world * [*[1 / mesh_size] * 3, 1])
            for each in scene.instances
        ],
    )
    plain, other = (compile_scene(each, choices(device)) for each in (scene, scaled))
    assert plain.source == other.source
    np.testing.assert_array_equal(film(device, scaled).mean, film(device, scene).mean)


@pytest.mark.programs
def test_a_mesh_that_is_drawn_itself_is_stored_once(device: Device) -> None:
    scene = crowd("turned")
    mesh = scene.instances[1].mesh
    several = replace(scene, meshes=[*scene.meshes, mesh])
    before, compiled = (compile_scene(each, choices(device)) for each in (scene, several))
    assert compiled.counts["triangles"] == before.counts["triangles"] and compiled.instances == 13
    picture, expected = (film(device, each).mean for each in (several, as_meshes(several)))
    assert (np.abs(picture - expected).max(axis=2) > 1e-4).mean() < 0.005


@pytest.mark.combinations
def test_lamps_become_meshes(device: Device) -> None:
    """Emission of the mesh or of the instance's material; a mirrored emitter emits from its mirrored front."""
    lamp = quad([(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)], Diffuse(emission=(6, 5, 4)))
    hang = [np.column_stack([np.diag([1.0, side, 1.0]), (x, 3, 0)]) for x, side in ((-2, 1), (2, -1), (0, -1))]
    scene = replace(crowd("mirrored"), lights=[], environment=Environment())
    shining = [Instance(lamp, matrix) for matrix in hang[:2]]
    shining.append(Instance(ball(), hang[2], Diffuse(emission=(1, 1, 1))))
    scene = replace(scene, instances=scene.instances + shining)
    compiled = compile_scene(scene, choices(device))
    assert compiled.instances == 12 and compiled.counts["triangle_lights"][0] == 2 + len(ball().faces)
    picture, expected = (film(device, each).mean for each in (scene, as_meshes(scene)))
    assert (np.abs(picture - expected).max(axis=2) > 1e-4).mean() < 0.01 and expected.max() > 1


@pytest.mark.programs
def test_ten_thousand_instances_need_the_memory_of_one(device: Device) -> None:
    """A mesh's triangles and BVH are stored once; an instance adds two records and its part of the top-level BVH."""
    mesh = ball()
    grid = np.stack(np.unravel_index(np.arange(10_000), (100, 100)), axis=1) - 50.0
    moved = [Instance(mesh, np.column_stack([0.4 * np.eye(3), (x, 0, z)])) for x, z in grid]
    scene = Scene(
        instances=moved, camera=Camera(position=(0, 30, 60)), environment=Environment(color=(1, 1, 1)), render=SETTINGS
    )
    alone = compile_scene(Scene(meshes=[mesh], camera=scene.camera), choices(device))
    compiled = compile_scene(scene, choices(device))
    assert compiled.counts["triangles"][0] == len(mesh.faces) and compiled.instances == 10_000
    for name, (_, array) in alone.buffers.items():
        if name not in ("nodes", "diffuse"):
            assert compiled.buffers[name][1].nbytes == array.nbytes
    assert compiled.bytes - alone.bytes < 10_000 * 450
    picture = film(device, scene).mean
    assert 0.3 < (picture.mean(axis=2) < 0.99).mean()


def test_only_what_saves_memory_becomes_instances(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Meshes of few triangles or with a single instance are baked, and the program has no code for instances."""
    monkeypatch.undo()
    few = crowd("turned")
    compiled, baked = (compile_scene(each, choices(device)) for each in (few, as_meshes(few)))
    assert compiled.source == baked.source and compiled.instances == 0
    assert "surface/instance_transform.cl" not in compiled.files
    monkeypatch.setattr(instancing, "FEW_TRIANGLES", 0)
    once = replace(few, instances=[*few.instances, Instance(ball(), few.instances[0].to_world)])
    assert compile_scene(once, choices(device)).instances == 12


def test_checkpoints_tell_instances_apart() -> None:
    """By what they show, not by how many objects say it."""
    from clrt.rendering.compile.choices import Choices

    scene = crowd("turned")
    moved, painted = list(scene.instances), list(scene.instances)
    moved[3] = replace(moved[3], to_world=moved[3].to_world + 1e-3)
    painted[3] = replace(painted[3], material=Mirror(color=(0.5, 0.5, 0.5)))
    same = replace(scene, instances=[replace(each) for each in scene.instances])
    facts = [
        facts_of(each, Choices())
        for each in (scene, same, replace(scene, instances=moved), replace(scene, instances=painted))
    ]
    assert facts[0] == facts[1]
    assert all(facts[0]["instances"] != other["instances"] for other in facts[2:])


@pytest.mark.programs
@pytest.mark.parametrize("few", [0, *others(1 << 16)])
def test_numbers_of_objects(device: Device, few: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ids count meshes, instances, then spheres, from left to right, however each is stored: a mesh that is also drawn
    itself, one that is not, an emitter, and a single instance. Triangles are numbered within their mesh."""
    monkeypatch.setattr(instancing, "FEW_TRIANGLES", few)
    wall = quad([(-0.5, -2, 0), (0.5, -2, 0), (0.5, 2, 0), (-0.5, 2, 0)], Diffuse())
    other, once = replace(wall, material=Mirror()), replace(wall, material=Dielectric())
    lamp = Diffuse(emission=(1, 1, 1))
    shown = [(wall, None), (other, None), (wall, lamp), (other, None), (once, None), (wall, None)]
    instances = [
        Instance(mesh, np.column_stack([np.eye(3), (x + 2, 0, 0)]), material)
        for x, (mesh, material) in enumerate(shown)
    ]
    ground = replace(wall, vertices=wall.vertices + np.array([1, 0, 0], np.float32))
    scene = Scene(
        meshes=[wall, ground],
        instances=instances,
        environment=Environment(color=(1, 1, 1)),
        spheres=[Sphere(center=(8, 0, 0), radius=0.4, material=Mirror())],
        camera=Camera(position=(4.5, 0, 50), look_at=(4.5, 0, 0), fov_degrees=1.146),
        render=RenderSettings(size=(10, 1)),
    )
    running = session(device, scene)
    assert running.compiled.instances == (0 if few else 5)
    found = first_hits(running, scene, ["object", "material", "primitive"])
    assert found["object"].tolist() == [[0, 1, 2, 3, 4, 5, 6, 7, 8, -1]]
    assert found["material"].tolist() == [[0, 0, 0, 1, 2, 1, 3, 0, 1, -1]]
    assert set(found["primitive"][0, :8].tolist()) <= {0, 1} and found["primitive"][0, 8:].tolist() == [0, -1]
