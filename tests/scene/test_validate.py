from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from clrt.errors import SceneError
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


def set_array(name: str, index: Any, value: float) -> Callable[[Scene], None]:
    def change(scene: Scene) -> None:
        getattr(scene.meshes[0], name)[index] = value

    return change


def set_mesh(**values: Any) -> Callable[[Scene], None]:
    def change(scene: Scene) -> None:
        scene.meshes[0] = replace(scene.meshes[0], **values)

    return change


def set_scene(**values: Any) -> Callable[[Scene], None]:
    def change(scene: Scene) -> None:
        for name, value in values.items():
            setattr(scene, name, value)

    return change


TRIANGLE = Mesh(np.array([[0, 0, 0], [9, 0, 0], [0, 9, 0]], np.float32), np.array([[0, 1, 2]], np.int32))


def place(*matrices: Any, **values: Any) -> Callable[[Scene], None]:
    def change(scene: Scene) -> None:
        scene.instances += [Instance(**{"mesh": scene.meshes[0], "to_world": matrix, **values}) for matrix in matrices]

    return change


def light(direction: Any) -> DirectionalLight:
    return DirectionalLight(direction=direction, irradiance=(1.0, 1.0, 1.0))


def sky(*shape: int, value: float = 1.0) -> Environment:
    image = np.ones(shape, np.float32)
    image.flat[-1:] = value
    return Environment(image=image)


NAN = float("nan")
MISTAKES: dict[str, tuple[Callable[[Scene], None], str]] = {
    "vertex": (set_array("vertices", (5, 1), np.nan), 'mesh[0] "ball": vertices[5] = ['),
    "vertices": (set_array("vertices", (slice(5, 8), 1), np.inf), "is not finite (and 2 more)"),
    "index above": (set_array("faces", (7, 2), 42), "faces[7] uses vertex 42, but valid indices are 0 to 41"),
    "index below": (set_array("faces", (7, 0), -1), "faces[7] uses vertex -1, but valid indices are 0 to 41"),
    "normal": (set_array("normals", 3, 0), "normals[3] = [0.0, 0.0, 0.0] points nowhere"),
    "colors above 1": (set_mesh(colors=np.full((42, 3), 1.5, np.float32)), "colors[0] = [1.5, 1.5, 1.5] is not a"),
    "colors below 0": (set_mesh(colors=np.full((42, 4), -1, np.float32)), "is not a colour from 0 to 1 (and 41 more)"),
    "normals": (set_mesh(normals=np.ones((4, 3), np.float32)), "normals has shape (4, 3); it must be (42, 3)"),
    "faces dtype": (set_mesh(faces=np.zeros((1, 3))), "faces has dtype float64; convert it"),
    "faces beyond int32": (set_mesh(faces=np.array([[0, 1, 2**32]])), "faces[0] uses vertex 4294967296, but"),
    "vertices dtype": (set_mesh(vertices=np.ones((42, 3), complex)), "vertices has dtype complex128"),
    "vertices beyond float32": (set_mesh(vertices=np.full((42, 3), 1e39)), "vertices[0] = [inf, inf, inf] is not"),
    "vertices shape": (set_mesh(vertices=np.ones((9, 2), np.float32), normals=None), "shape (9, 2); it must be"),
    "vertices list": (set_mesh(vertices=[[0, 0, 0], [1]], normals=None), "vertices is a list; write a numpy array"),
    "no faces": (set_mesh(faces=np.zeros((0, 3), np.int32)), 'mesh[0] "ball": has no triangles'),
    "no list": (set_scene(spheres=Sphere()), "is not a list; write spheres=[...]"),
    "no mesh": (set_scene(meshes=["ball"]), 'mesh[0]: "ball" is not a Mesh'),
    "material": (set_mesh(material=Diffuse(color=(0, 1.5, 0))), "mesh[0].material.color[1]: 1.5 is above 1"),
    "no material": (set_mesh(material="gold"), 'mesh[0].material: "gold" is not of type Material; write a clrt.'),
    "emission": (set_mesh(material=Diffuse(emission=(0, -1, 0))), "mesh[0].material.emission[1]: -1 is below 0"),
    "radius": (set_scene(spheres=[Sphere(), Sphere(radius=0)]), "sphere[1].radius: 0 is not above 0"),
    "sphere type": (set_scene(spheres=[Sphere(radius="1")]), 'sphere[0].radius: "1" is not a number'),  # type: ignore
    "instance": (place(np.diag([1, 2, 0]) @ np.eye(3, 4)), 'instance[0] "instance": to_world [[1.0, 0.0, 0.0, 0.0], ['),
    "instance flat": (place(np.diag([1, 2, 1e-14]) @ np.eye(3, 4)), "flattens the mesh; repair it"),
    "instances": (place(*[np.full((3, 4), np.nan)] * 3), "is not finite (and 2 more)"),
    "instance shape": (place(np.eye(3)), 'instance[0] "instance": to_world has shape (3, 3); write a numpy array of'),
    "instance affine": (place(np.ones((4, 4))), "to_world has shape (4, 4); write a numpy array of shape (3, 4), or"),
    "instance text": (place("up"), "to_world has shape (); write a numpy array"),
    "instance huge": (place(1e38 * np.eye(3, 4), mesh=TRIANGLE), "moves the mesh outside the range of float32"),
    "instance mesh": (
        place(np.eye(3, 4), mesh=Mesh(TRIANGLE.vertices, TRIANGLE.faces + 1)),
        'instance[0].mesh "mesh": faces[0] uses vertex 3',
    ),
    "instance no mesh": (place(np.eye(3, 4), mesh="ball"), 'instance[0].mesh: "ball" is not a Mesh'),
    "instance material": (place(np.eye(3, 4), material="gold"), 'instance[0].material: "gold" is not of type Material'),
    "no instance": (set_scene(instances=["ball"]), 'instance[0]: "ball" is not of type Instance; write a clrt'),
    "light": (set_scene(lights=[light((0, 0, 0))]), "light[0].direction: [0, 0, 0] is not a direction"),
    "light nan": (set_scene(lights=[light((0, NAN, 0))]), "light[0].direction[1]: nan is not a finite number"),
    "light text": (set_scene(lights=[light("up")]), 'light[0].direction: "up" is not a list; write the numbers'),
    "light short": (set_scene(lights=[light((0,))]), "light[0].direction: [0] has 1 entries; write 3"),
    "no light": (
        set_scene(lights=[Sphere()]),
        "is not a light; write a PointLight or SpotLight or",
    ),
    "look_at": (set_scene(camera=Camera(position=(1, 2, 3), look_at=(1, 2, 3))), "camera.look_at: [1, 2, 3] is the"),
    "up": (set_scene(camera=Camera(up=(0, 0, 2e-9))), "camera.up: [0, 0, 2e-09] is parallel to the view"),
    "no up": (set_scene(camera=Camera(up=(0, 0, 0))), "camera.up: [0, 0, 0] is not a direction"),
    "fov": (set_scene(camera=Camera(fov_degrees=180)), "camera.fov_degrees: 180 is not below 180"),
    "huge": (set_scene(camera=Camera(position=(1e39, 0, 0))), "camera.position: [1e+39, 0, 0] is outside"),
    "bool": (set_scene(camera=Camera(fov_degrees=True)), "camera.fov_degrees: true is not a number"),
    "size": (set_scene(render=RenderSettings(size=(0, 5))), "render.size[0]: 0 is below 1; write at least 1"),
    "spp": (set_scene(render=RenderSettings(spp=2.5)), "render.spp: 2.5 is not an integer"),  # type: ignore
    "sky shape": (set_scene(environment=sky(4, 4)), "environment.image: has shape (4, 4)"),
    "sky empty": (set_scene(environment=sky(0, 4, 3)), "environment.image: has shape (0, 4, 3)"),
    "sky nan": (set_scene(environment=sky(2, 4, 3, value=NAN)), "1 pixels are not finite, the first in row 1"),
    "sky negative": (set_scene(environment=sky(2, 4, 3, value=-1)), "1 pixels are negative, the first in row 1"),
    "sky dtype": (set_scene(environment=Environment(image=np.ones((2, 4, 3)))), "is float64; write"),  # type: ignore
    "strength": (set_scene(environment=Environment(strength=-1)), "environment.strength: -1 is below 0"),
}


def test_good_scene_passes() -> None:
    validate(good_scene())
    validate(Scene())


def test_numpy_numbers_pass() -> None:
    x, y, z = np.array([1, 2, 3], np.float32)
    validate(Scene(camera=Camera(position=(x, y, z)), render=RenderSettings(spp=np.int64(3))))  # type: ignore


@pytest.mark.parametrize("name", MISTAKES)
def test_each_mistake_is_the_one_problem(name: str) -> None:
    change, sentence = MISTAKES[name]
    scene = good_scene()
    change(scene)
    with pytest.raises(SceneError) as caught:
        validate(scene)
    assert len(caught.value.problems) == 1
    assert sentence in caught.value.problems[0]


def test_all_mistakes_come_at_once() -> None:
    """Errors in different parts of the scene are all reported together."""
    names = ["vertex", "index below", "normal", "radius", "light nan", "up", "size", "sky nan"]
    scene = good_scene()
    for name in names:
        MISTAKES[name][0](scene)
    with pytest.raises(SceneError) as caught:
        validate(scene)
    assert len(caught.value.problems) == len(names)
    for name in names:
        assert MISTAKES[name][1] in str(caught.value)


def test_a_shared_material_is_named_once() -> None:
    material = Diffuse(color=(2.0, 0.0, 0.0))
    with pytest.raises(SceneError) as caught:
        validate(Scene(spheres=[Sphere(material=material), Sphere(material=material)]))
    assert caught.value.problems == ["sphere[0].material.color[0]: 2.0 is above 1; write at most 1"]


@pytest.mark.parametrize("dtype", [np.int64, np.uint8, np.uint32])
def test_meshes_of_numpy_s_own_dtypes(dtype: type) -> None:
    """float64 and any integers are converted to float32 and int32; those dtypes are not copied."""
    mesh = Mesh(np.eye(3), np.array([[0, 1, 2]], dtype))  # type: ignore[arg-type]
    validate(Scene(meshes=[mesh]))
    assert mesh.vertices.dtype == np.float32 and mesh.faces.dtype == np.int32 and mesh.faces.tolist() == [[0, 1, 2]]
    again = Mesh(mesh.vertices, mesh.faces)
    assert again.vertices is mesh.vertices and again.faces is mesh.faces
