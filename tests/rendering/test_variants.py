"""The same image from every variant of the computation, and only the code that the scene needs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from typing import Any, get_args

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.accel.traversal_kernels import BOX_TESTS, SPHERE_TESTS, TREES, TRIANGLE_TESTS, HitTests
from clrt.bench.kernel_probe import choices
from clrt.bench.numerics.bsdf_cases import variants
from clrt.device.open import Device
from clrt.errors import UsageError
from clrt.rendering.accumulation import launch_plan
from clrt.rendering.compile import pack_scene as pack_module
from clrt.rendering.compile.choices import LANES, OFFSETS, Choices
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.scene.cameras import CameraEnd
from clrt.scene.light_images import LightImage
from clrt.scene.lights import DirectionalLight, GoniometricLight, PointLight, ProjectorLight, SpotLight
from clrt.scene.materials.material_types import MATERIALS, Dielectric, Diffuse, MetallicRoughness, Mirror
from clrt.scene.materials.textures import Picture, Texture
from clrt.scene.model import Camera, Environment, Instance, Mesh, RenderSettings, Scene, Sphere
from clrt.scene.render_settings import Integrator, Sampler

from ..covering import others
from . import rays
from .pictures import box, film, quad, session

Doubles = NDArray[np.float64]


def everything() -> Scene:
    """Return a scene with all kinds of primitives, materials and lights, of an odd width that leaves SIMD lanes
    empty."""
    vertices, faces = rays.icosphere(2)
    gold = MetallicRoughness(preset="gold", roughness=0.4, multiple_scattering=True)
    plastic = MetallicRoughness(roughness=0.2, smith="schlick")
    ball = Mesh(vertices + np.array([1.2, 0.8, 0], np.float32), faces, gold, normals=vertices)
    lamp = quad([(-1, 4, -1), (1, 4, -1), (1, 4, 1), (-1, 4, 1)], Diffuse(emission=(6.0, 5.0, 4.0)))
    floor = quad([(-9, 0, 9), (9, 0, 9), (9, 0, -9), (-9, 0, -9)], Diffuse(color=(0.7, 0.6, 0.5)))
    sky = (2 * np.random.default_rng(0).random((8, 16, 1)) ** 6 * [1.0, 0.8, 0.6]).astype(np.float32)
    slide = LightImage(pixels=np.random.default_rng(1).random((3, 4, 3)).astype(np.float32))
    return Scene(
        meshes=[floor, lamp, ball],
        spheres=[
            Sphere(center=(-1.0, 0.7, 0.5), radius=0.7, material=Mirror(color=(0.9, 0.9, 0.9))),
            Sphere(center=(0.0, 2.2, 0.0), radius=0.2, material=Diffuse(emission=(9.0, 1.0, 1.0))),
            Sphere(center=(0.0, 0.3, 1.5), radius=0.3, material=plastic),
            Sphere(center=(0.7, 0.35, 2.0), radius=0.35, material=Dielectric()),
        ],
        lights=[
            PointLight(position=(3.0, 2.0, 2.0), intensity=(5.0, 5.0, 9.0)),
            DirectionalLight(direction=(1.0, -2.0, -1.0), irradiance=(0.5, 0.4, 0.3)),
            DirectionalLight(direction=(-1.0, -2.0, -1.0), irradiance=(0.2, 0.3, 0.4), angle_degrees=20.0),
            SpotLight(position=(-3.0, 3.0, 2.0), direction=(1.0, -1.0, -0.5), intensity=(9.0, 9.0, 5.0)),
            SpotLight(position=(3.0, 3.0, -2.0), direction=(-1.0, -1.0, 0.5), intensity=(9.0, 9.0, 5.0), image=slide),
            ProjectorLight(
                position=(-2.0, 3.0, -2.0), direction=(1.0, -1.0, 1.0), intensity=(5.0, 9.0, 5.0), image=slide
            ),
            GoniometricLight(position=(0.5, 3.0, 2.0), intensity=(1.0, 2.0, 1.0), image=slide),
        ],
        environment=Environment(image=sky, rotation_degrees=30.0),
        camera=Camera(position=(0.0, 2.0, 6.0), look_at=(0.0, 1.0, 0.0)),
        render=RenderSettings(size=(45, 33), spp=4, max_depth=6, seed=11),
    )


def painted(scene: Scene) -> Scene:
    """Return it with textures on every parameter that allows one, both UV sets, vertex colours, and alpha masks."""
    texels = np.random.default_rng(5).integers(0, 256, (6, 5, 4), np.uint8)
    here = Texture(picture=Picture(texels))
    there = Texture(picture=Picture(texels[1:4]), uv_set=1, wrap=("mirror", "clamp"))
    floor, lamp, ball = scene.meshes
    gold = MetallicRoughness(
        color=there,
        metallic=here,
        roughness=replace(here, channel="green", filter="nearest"),
        normal_map=here,
        opacity=replace(here, channel="alpha"),
        clearcoat=there,
        clearcoat_roughness=0.3,
        clearcoat_normal_map=there,
    )
    flat = floor.vertices[:, [0, 2]]
    meshes = [
        replace(
            floor,
            material=Diffuse(color=here, alpha_cutoff=0.3, opacity=there),
            uv=flat,
            uv1=flat[:, ::-1].copy(),
            colors=np.linspace(0, 1, 16, dtype=np.float32).reshape(4, 4),
        ),
        replace(lamp, material=Diffuse(emission=replace(here, factor=6.0)), uv=lamp.vertices[:, [0, 2]]),
        replace(ball, material=gold, uv=ball.vertices[:, :2].copy(), uv1=ball.vertices[:, 1:].copy()),
    ]
    spheres = [
        *scene.spheres,
        Sphere(
            center=(2.0, 0.4, 2.0),
            radius=0.3,
            material=Diffuse(color=here, emission=there, normal_map=there, one_sided=True),
        ),
    ]
    return replace(scene, meshes=meshes, spheres=spheres)


def shelf() -> Scene:
    """Return a small sphere of each material in each of its variants, in rows."""
    materials = [material for kind in MATERIALS for material in variants(kind)]
    across = int(np.ceil(np.sqrt(len(materials))))
    spheres = [
        Sphere(center=(i % across - across / 2, i // across - across / 2, 0.0), radius=0.45, material=material)
        for i, material in enumerate(materials)
    ]
    return replace(
        everything(),
        meshes=[],
        spheres=spheres,
        camera=Camera(position=(0, 0, 3.0 * across), look_at=(0, 0, 0), fov_degrees=20),
    )


def planted(scene: Scene) -> Scene:
    """Return the scene with two instances of its last mesh."""
    places = np.array([np.column_stack([np.diag(scale), [x, 0, 0]]) for scale, x in (((1, 2, 1), -3), ((-1, 1, 1), 6))])
    return replace(scene, instances=[Instance(scene.meshes[-1], place) for place in places])


def plastic_ball() -> Scene:
    """Return a scene with a plastic sphere on a floor below a light and a sky: a small program."""
    floor, lamp, _ = everything().meshes
    return replace(everything(), meshes=[floor, lamp], spheres=everything().spheres[2:3], lights=[])


def sights(scene: Scene) -> Iterator[tuple[str, Scene]]:
    """Yield the scene with each camera and each integrator without paths."""
    camera = scene.camera
    yield "lens", replace(scene, camera=replace(camera, aperture_radius=0.1))
    yield "orthographic", replace(scene, camera=replace(camera, projection="orthographic"))
    round_about = Camera(position=camera.position, look_at=camera.look_at, projection="equirectangular")
    yield "equirectangular", replace(scene, camera=round_about)
    distorted = replace(camera, distortion=(-0.2, 0.05, 0.01, 0.01))
    yield "distorted", replace(scene, camera=distorted)
    yield "distorted lens", replace(scene, camera=replace(distorted, aperture_radius=0.1))
    yield "fisheye", replace(scene, camera=replace(camera, projection="fisheye"))
    moves = [Instance(mesh, to_world_end=np.column_stack([np.eye(3), [0.1, 0.2, 0]])) for mesh in scene.meshes[1:]]
    moving = replace(camera, shutter=(0, 1), end=CameraEnd(position=(0.3, 3, 9)))
    yield "moving", replace(scene, meshes=scene.meshes[:1], instances=[*scene.instances, *moves], camera=moving)
    for integrator in get_args(Integrator):
        if integrator not in ("path", "direct"):
            yield integrator, replace(scene, render=replace(scene.render, integrator=integrator))


#: Layouts and SIMD widths that are compared with the reference by default.
WAYS = [("cwbvh", 1), ("packs", 8)]


@pytest.fixture(scope="module")
def reference(device: Device) -> Doubles:
    return film(device, everything(), lanes=8, layout="bvh8").mean


@pytest.mark.programs
@pytest.mark.parametrize("layout, lanes", WAYS + others(*(way for way in product(TREES, LANES) if way not in WAYS)))
def test_lanes_and_layouts_agree(device: Device, reference: Doubles, layout: str, lanes: int) -> None:
    """They agree to float rounding: a sample is a chain of some hundred operations, so most pixels agree to 1e-5.

    Rounding can also flip a decision (which lobe, which side of an edge): then one of the 4 samples of a pixel is
    different. Each sample takes some 50 decisions that a relative 1e-6 may flip: fewer than 1 pixel in 1000.
    """
    assert_most_agree(film(device, everything(), lanes=lanes, layout=layout).mean, reference)


@pytest.mark.programs
@pytest.mark.parametrize(
    "chosen", [{"layout": None, "tree": False}, {"layout": "bvh8", "builder": "midpoint"}], ids=str
)
def test_builders_agree(device: Device, reference: Doubles, chosen: dict[str, Any]) -> None:
    """As above; also without a BVH."""
    assert_most_agree(film(device, everything(), lanes=8, **chosen).mean, reference)


def assert_most_agree(picture: Doubles, reference: Doubles) -> None:
    differs = np.any(np.abs(picture - reference) > 1e-5 * (reference + 0.1), axis=2)
    assert np.mean(differs) < 1e-3, np.argwhere(differs)


@pytest.mark.programs
@pytest.mark.parametrize("lanes, layout", [(1, "bvh8"), *others((16, "cwbvh"))])
def test_lanes_agree_on_textures_and_holes(device: Device, lanes: int, layout: str) -> None:
    """As above; textures add edges at which samples can differ."""
    scene = painted(everything())
    expected = film(device, scene, lanes=8, layout="bvh8").mean
    picture = film(device, scene, lanes=lanes, layout=layout).mean
    differs = np.any(np.abs(picture - expected) > 1e-5 * (expected + 0.1), axis=2)
    assert expected.mean() > 0.1 and np.mean(differs) < 4e-3, np.argwhere(differs)


@pytest.mark.programs
def test_spheres_in_the_tree_and_out_of_it_agree(
    device: Device, reference: Doubles, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As above; few spheres are tested before the BVH, many in it (test_parts.py has them in every layout)."""
    assert "LONE_SPHERES" in session(device, everything(), layout="bvh8").compiled.features
    monkeypatch.setattr(pack_module, "FEW_SPHERES", 0)
    assert "LEAF_SPHERES" in session(device, everything(), layout="bvh8").compiled.features
    assert_most_agree(film(device, everything(), layout="bvh8").mean, reference)


@pytest.mark.programs
@pytest.mark.parametrize("sampler, lanes", [("sobol", 16), *others(("stratified", 8))])
def test_lanes_agree_with_every_sampler(device: Device, sampler: Sampler, lanes: int) -> None:
    """As above, for a smaller scene."""
    reference, picture = (film(device, plastic_ball(), sampler=sampler, lanes=each).mean for each in (1, lanes))
    assert np.mean(np.any(np.abs(picture - reference) > 1e-5 * (reference + 0.1), axis=2)) < 1e-3


@pytest.mark.programs
def test_pictures_do_not_depend_on_passes_and_launches(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bit for bit: eight samples in one pass or several, in one launch or many, and the same twice."""
    scene = replace(everything(), render=RenderSettings(size=(64, 48), spp=8, seed=2))
    films = []
    for passes, first_launch in (([8], 1 << 15), ([8], 1), ([1] * 8, 1 << 20), ([3, 5], 1), ([8], 1 << 15)):
        monkeypatch.setattr(launch_plan, "FIRST_LAUNCH_SAMPLES", first_launch)
        running = session(device, scene)
        for samples in passes:
            for _ in running.render(samples):
                pass
        films.append(running.film().pixels)
    assert all(pixels.tobytes() == films[0].tobytes() for pixels in films[1:])


def test_a_tree_can_be_wanted_or_not() -> None:
    """For few triangles as for many; contradictory choices are rejected."""
    few, many = quad([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], Diffuse()), Mesh(*rays.icosphere(3))
    scenes = [Scene(meshes=[few]), Scene(meshes=[many])]
    for tree, layouts in {None: ["packs", "bvh8"], True: ["bvh8", "bvh8"], False: ["packs", "packs"]}.items():
        assert [compile_scene(scene, Choices(tree=tree)).tree.name for scene in scenes] == layouts
    precomputed = Choices(tree=False, tests=HitTests("precomputed"))
    assert [compile_scene(scene, precomputed).tree.name for scene in scenes] == ["list", "list"]
    for layout, tree in (("list", True), ("bvh2", False)):
        with pytest.raises(UsageError, match=f"the layout {layout}"):
            Choices(layout=layout, tree=tree)


def test_seeds_differ(device: Device) -> None:
    """Another seed gives other noise: images of independent samples differ in nearly all pixels with noise."""
    scene = Scene(
        meshes=[box(1.0, Diffuse(color=(0.5,) * 3, emission=(2.0, 2.0, 2.0)))],
        camera=Camera(position=(0.1, 0.2, 0.3), look_at=(1.0, 0.5, 0.2), fov_degrees=90),
        render=everything().render,
    )
    pictures = [
        film(device, replace(scene, render=replace(scene.render, seed=seed))).mean for seed in (0, 1, 2**32 - 1)
    ]
    for i, j in ((0, 1), (0, 2), (1, 2)):
        assert np.mean(np.any(pictures[i] != pictures[j], axis=2)) > 0.95
        mean = [p.mean() for p in (pictures[i], pictures[j])]
        assert abs(mean[0] / mean[1] - 1) < 0.2


def test_empty_scene_is_the_sky(device: Device) -> None:
    """Every sample has exactly the sky's color."""
    sky = Environment(color=(0.3, 0.6, 0.1), strength=2.0)
    picture = film(device, Scene(environment=sky, render=RenderSettings(size=(20, 10), spp=5)))
    assert np.all(picture.mean.astype(np.float32) == np.array([0.6, 1.2, 0.2], np.float32))
    black = film(device, Scene(render=RenderSettings(size=(20, 10), spp=5)))
    assert not black.mean.any() and black.samples == 1000


@pytest.mark.parametrize("layout", ["bvh8", "bvh2", "cwbvh", "packs", "list"])
def test_a_scene_compiles_to_what_it_needs(device: Device, layout: str) -> None:
    """Files, features and buffers of a scene of spheres, of one of triangles, and of an empty one."""
    triangle = quad([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], Diffuse())
    compiled = {
        name: compile_scene(scene, choices(device, layout=layout))
        for name, scene in {
            "spheres": Scene(spheres=[Sphere()]),
            "triangles": Scene(meshes=[triangle]),
            "empty": Scene(),
        }.items()
    }
    assert "geometry/sphere.cl" in compiled["spheres"].files
    assert "geometry/triangle_watertight.cl" in compiled["triangles"].files
    for name, unwanted in {"spheres": "triangle", "triangles": "sphere"}.items():
        program = compiled[name]
        assert not [file for file in program.files if unwanted in file.split("/")[-1]]
        assert unwanted.upper() + "S" not in program.features
        assert not [buffer for buffer in program.buffers if unwanted in buffer]
        scene_struct = next(line for line in program.source.splitlines() if line.endswith(" Scene;"))
        assert unwanted not in scene_struct.lower().replace("counts", "")
    for name in ("spheres", "triangles", "empty"):
        program = compiled[name]
        lights = {file for file in program.files if file.startswith("light/")}
        assert lights <= {"light/dispatch.cl", "light/interface.cl"}
        assert not {"LIGHTS", "EMITTERS", "SKY", "SMOOTH_NORMALS"} & set(program.features)
        assert "bsdf/mirror.cl" not in program.files and "bsdf/metallic_roughness.cl" not in program.files
    trees = ("geometry/", "traverse/bvh", "traverse/cwbvh", "traverse/packs", "traverse/list")
    assert not [file for file in compiled["empty"].files if file.startswith(trees)]


@pytest.mark.parametrize(
    "kind, known", {"triangle": TRIANGLE_TESTS, "box": BOX_TESTS, "sphere": SPHERE_TESTS, "offset": OFFSETS}.items()
)
def test_of_each_test_one_is_compiled(device: Device, kind: str, known: dict[str, str]) -> None:
    """Only the chosen file is compiled; by default the first of each kind."""
    default = compile_scene(everything(), choices(device))
    assert set(known.values()) & set(default.files) == {next(iter(known.values()))}
    assert "SCENE_UNIT" not in default.source
    for name, file in known.items():
        chosen = compile_scene(everything(), choices(device, **{kind: name}))
        assert set(known.values()) & set(chosen.files) == {file}
        assert set(default.files) ^ set(chosen.files) <= {*known.values(), "geometry/plain_ray.cl"}


@pytest.mark.programs
def test_other_tests_make_much_the_same_picture(device: Device, reference: Doubles) -> None:
    """Ray origins and hits differ slightly, so few samples are bit-identical, but the image is the same."""
    picture = film(device, everything(), triangle="baldwin_weber", box="plain", sphere="textbook", offset="ulp").mean
    same = np.all(np.abs(picture - reference) <= 0.02 * (reference + 0.1), axis=2)
    assert np.mean(same) > 0.9
    assert abs(picture.mean() / reference.mean() - 1) < 0.01


def test_settings_do_not_change_the_program(device: Device) -> None:
    """Camera, size, samples, depth, seed and all numbers of the scene are kernel arguments."""
    scene = everything()
    other = replace(
        scene,
        camera=Camera(position=(1.0, 1.0, 9.0), fov_degrees=70.0),
        render=RenderSettings(size=(7, 5), spp=3, max_depth=2, seed=99),
        lights=[PointLight(position=(0.0, 9.0, 0.0), intensity=(1.0, 2.0, 3.0)), *scene.lights[1:]],
    )
    assert session(device, scene).compiled.source == session(device, other).compiled.source
