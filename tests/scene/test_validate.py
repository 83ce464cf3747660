from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from clrt.errors import SceneError
from clrt.scene.fields.field_types import show
from clrt.scene.lights import DirectionalLight, PointLight
from clrt.scene.materials.material_types import Diffuse, MetallicRoughness
from clrt.scene.model import Camera, Environment, Instance, Mesh, RenderSettings, Scene, Sphere
from clrt.scene.validation.validate import validate

from .shapes import icosphere


def good_scene() -> Scene:
    vertices, faces = icosphere(1)
    return Scene(
        meshes=[Mesh(vertices, faces, MetallicRoughness(preset="gold"), vertices.copy(), "ball")],
        spheres=[Sphere(material=Diffuse(color=(0.0, 0.5, 1.0), emission=(10.0, 0.0, 0.0)))],
        lights=[
            PointLight(position=(0.0, 1.0, 2.0), intensity=(1.0, 1.0, 1.0)),
            DirectionalLight(direction=(0.0, -1.0, 0.0), irradiance=(1.0, 1.0, 1.0)),
        ],
        environment=Environment(image=np.ones((2, 4, 3), np.float32)),
    )


def set_array(name: str, index: Any, value: float) -> Callable[[Scene], object]:
    def change(scene: Scene) -> None:
        array = getattr(scene.meshes[0], name).copy()
        array[index] = value
        replace(scene.meshes[0], **{name: array})

    return change


def set_mesh(**values: Any) -> Callable[[Scene], object]:
    return lambda scene: replace(scene.meshes[0], **values)


def set_scene(**values: Any) -> Callable[[Scene], object]:
    return lambda scene: replace(scene, **values)


def make(kind: type, **values: Any) -> Callable[[Scene], object]:
    return lambda scene: kind(**values)


TRIANGLE = Mesh(np.array([[0, 0, 0], [9, 0, 0], [0, 9, 0]], np.float32), np.array([[0, 1, 2]], np.int32))


def place(*matrices: Any, **values: Any) -> Callable[[Scene], object]:
    def change(scene: Scene) -> None:
        for matrix in matrices:
            Instance(**{"mesh": scene.meshes[0], "to_world": matrix, **values})

    return change


def light(direction: Any) -> Callable[[Scene], object]:
    return make(DirectionalLight, direction=direction, irradiance=(1.0, 1.0, 1.0))


def sky(*shape: int, value: float = 1.0) -> Callable[[Scene], object]:
    image = np.ones(shape, np.float32)
    image.flat[-1:] = value
    return make(Environment, image=image)


NAN = float("nan")
MISTAKES: dict[str, tuple[Callable[[Scene], object], str]] = {
    "vertex": (set_array("vertices", (5, 1), np.nan), 'mesh "ball": vertices[5] = ['),
    "vertices": (set_array("vertices", (slice(5, 8), 1), np.inf), "is not finite (and 2 more)"),
    "index above": (set_array("faces", (7, 2), 42), "faces[7] uses vertex 42, but valid indices are 0 to 41"),
    "index below": (set_array("faces", (7, 0), -1), "faces[7] uses vertex -1, but valid indices are 0 to 41"),
    "normal": (set_array("normals", 3, 0), "normals[3] = [0.0, 0.0, 0.0] points nowhere"),
    "colors above 1": (set_mesh(colors=np.full((42, 3), 1.5, np.float32)), "colors[0] = [1.5, 1.5, 1.5] is not a"),
    "colors below 0": (set_mesh(colors=np.full((42, 4), -1, np.float32)), "is not a colour from 0 to 1 (and 41 more)"),
    "normals": (set_mesh(normals=np.ones((4, 3), np.float32)), "normals has shape (4, 3); it must be (42, 3)"),
    "faces dtype": (set_mesh(faces=np.zeros((1, 3))), "faces has dtype float64; write integers"),
    "faces beyond int32": (set_mesh(faces=np.array([[0, 1, 2**32]])), "faces[0] uses vertex 4294967296, but"),
    "vertices dtype": (set_mesh(vertices=np.ones((42, 3), complex)), "vertices has dtype complex128"),
    "vertices beyond float32": (set_mesh(vertices=np.full((42, 3), 1e39)), "vertices[0] = [inf, inf, inf] is not"),
    "vertices shape": (set_mesh(vertices=np.ones((9, 2), np.float32), normals=None), "shape (9, 2); it must be"),
    "vertices list": (
        set_mesh(vertices=[[0, 0, 0], [1]], normals=None),
        "vertices: [[0, 0, 0], [1]] is not an array of numbers; write one",
    ),
    "no faces": (set_mesh(faces=np.zeros((0, 3), np.int32)), 'mesh "ball": has no triangles'),
    "no list": (set_scene(spheres=Sphere()), "is not a list; write spheres=[...]"),
    "no mesh": (set_scene(meshes=["ball"]), 'mesh[0]: "ball" is not of type Mesh'),
    "material": (make(Diffuse, color=(0, 1.5, 0)), "Diffuse.color[1]: 1.5 is above 1"),
    "no material": (set_mesh(material="gold"), 'mesh "ball".material: "gold" is not of type Material; write a clrt.'),
    "emission": (make(Diffuse, emission=(0, -1, 0)), "Diffuse.emission[1]: -1 is below 0"),
    "radius": (make(Sphere, radius=0), "Sphere.radius: 0 is not above 0"),
    "sphere type": (make(Sphere, radius="1"), 'Sphere.radius: "1" is not a number'),
    "instance": (place(np.diag([1, 2, 0]) @ np.eye(3, 4)), 'instance "instance": to_world [[1.0, 0.0, 0.0, 0.0], ['),
    "instance flat": (place(np.diag([1, 2, 1e-14]) @ np.eye(3, 4)), "flattens the mesh; repair it"),
    "instances": (place(*[np.full((3, 4), np.nan)] * 3), "is not finite; repair it"),
    "instance shape": (place(np.eye(3)), 'instance "instance": to_world has shape (3, 3); write a numpy array of'),
    "instance affine": (place(np.ones((4, 4))), "to_world has shape (4, 4); write a numpy array of shape (3, 4), or"),
    "instance text": (place("up"), 'to_world is "up"; write a numpy array'),
    "instance huge": (place(1e38 * np.eye(3, 4), mesh=TRIANGLE), "moves the mesh outside the range of float32"),
    "instance mesh": (
        place(np.eye(3, 4), mesh=3),
        'instance "instance".mesh: 3 is not of type Mesh; write a clrt.Mesh',
    ),
    "instance no mesh": (place(np.eye(3, 4), mesh="ball"), 'instance "instance".mesh: "ball" is not of type Mesh'),
    "instance material": (
        place(np.eye(3, 4), material="gold"),
        'instance "instance".material: "gold" is not of type Material',
    ),
    "no instance": (set_scene(instances=["ball"]), 'instance[0]: "ball" is not of type Instance; write a clrt'),
    "light": (light((0, 0, 0)), "DirectionalLight.direction: [0, 0, 0] is not a direction"),
    "light nan": (light((0, NAN, 0)), "DirectionalLight.direction[1]: nan is not a finite number"),
    "light text": (light("up"), 'DirectionalLight.direction: "up" is not a list; write the numbers'),
    "light short": (light((0,)), "DirectionalLight.direction: [0] has 1 entries; write 3"),
    "named material": (set_scene(materials={"a": 5}), 'materials["a"]: 5 is not of type Material'),
    "named camera": (set_scene(cameras={"a": 5}), 'cameras["a"]: 5 is not of type Camera; write a clrt.Camera'),
    "no light": (
        set_scene(lights=[Sphere()]),
        "is not of type Light; write a clrt.PointLight or clrt.SpotLight or",
    ),
    "look_at": (make(Camera, position=(1, 2, 3), look_at=(1, 2, 3)), "Camera.look_at: [1, 2, 3] is the"),
    "up": (make(Camera, up=(0, 0, 2e-9)), "Camera.up: [0, 0, 2e-09] is parallel to the view"),
    "no up": (make(Camera, up=(0, 0, 0)), "Camera.up: [0, 0, 0] is not a direction"),
    "fov": (make(Camera, fov_degrees=180), "Camera.fov_degrees: 180 is not below 180"),
    "huge": (make(Camera, position=(1e39, 0, 0)), "Camera.position: [1e+39, 0, 0] is outside"),
    "bool": (make(Camera, fov_degrees=True), "Camera.fov_degrees: true is not a number"),
    "size": (make(RenderSettings, size=(0, 5)), "RenderSettings.size[0]: 0 is below 1; write at least 1"),
    "spp": (make(RenderSettings, spp=2.5), "RenderSettings.spp: 2.5 is not an integer"),
    "sky shape": (sky(4, 4), "Environment.image: has shape (4, 4)"),
    "sky empty": (sky(0, 4, 3), "Environment.image: has shape (0, 4, 3)"),
    "sky nan": (sky(2, 4, 3, value=NAN), "1 pixels are not finite, the first in row 1"),
    "sky negative": (sky(2, 4, 3, value=-1), "1 pixels are negative, the first in row 1"),
    "sky dtype": (make(Environment, image=np.ones((2, 4, 3), np.uint8)), "is uint8; write"),
    "strength": (make(Environment, strength=-1), "Environment.strength: -1 is below 0"),
}


def test_good_scene_passes() -> None:
    validate(good_scene())
    validate(Scene())


def test_numpy_numbers_pass() -> None:
    x, y, z = np.array([1, 2, 3], np.float32)
    validate(Scene(camera=Camera(position=(x, y, z)), render=RenderSettings(spp=np.int64(3))))  # type: ignore


@pytest.mark.parametrize("name", MISTAKES)
def test_each_mistake_is_the_one_problem_of_the_object_that_is_made(name: str) -> None:
    change, sentence = MISTAKES[name]
    scene = good_scene()
    with pytest.raises(SceneError) as caught:
        change(scene)
    assert len(caught.value.problems) == 1
    assert sentence in caught.value.problems[0]


def test_what_is_assigned_is_validated_before_a_render() -> None:
    """All at once, each named by its place in the scene."""
    scene = good_scene()
    ball = scene.meshes[0]
    scene.instances.append(Instance(ball))
    ball.normals = np.zeros_like(ball.vertices)
    scene.instances[0].to_world = np.zeros((3, 4))
    scene.environment.strength = -1
    scene.lights.append(3)  # type: ignore[arg-type]
    with pytest.raises(SceneError) as caught:
        validate(scene)
    assert [problem[: problem.index(";")] for problem in caught.value.problems] == [
        "environment.strength: -1 is below 0",
        'mesh[0] "ball": normals[0] = [0.0, 0.0, 0.0] points nowhere (and 41 more)',
        f'instance[0] "instance": to_world {show(((0.0,) * 4,) * 3)} flattens the mesh',
        "light[2]: 3 is not of type Light",
    ]
    ball.normals, scene.instances[0].to_world, scene.environment.strength = None, np.eye(3, 4), 1.0
    scene.lights.pop()
    validate(scene)


@pytest.mark.parametrize("dtype", [np.int64, np.uint8, np.uint32])
def test_meshes_of_numpy_s_own_dtypes(dtype: type) -> None:
    """float64 and any integers are converted to float32 and int32; those dtypes are not copied."""
    mesh = Mesh(np.eye(3), np.array([[0, 1, 2]], dtype))  # type: ignore[arg-type]
    validate(Scene(meshes=[mesh]))
    assert mesh.vertices.dtype == np.float32 and mesh.faces.dtype == np.int32 and mesh.faces.tolist() == [[0, 1, 2]]
    again = Mesh(mesh.vertices, mesh.faces)
    assert again.vertices is mesh.vertices and again.faces is mesh.faces
