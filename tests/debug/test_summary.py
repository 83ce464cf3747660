"""Names, outcomes and the sentence that explains a black pixel, on scenes with known causes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from clrt.debug.names import SceneNames
from clrt.debug.summary import summary
from clrt.debug.trace import PixelPaths, trace_pixel
from clrt.debug.vertices import Vertex, vertices
from clrt.device.open import Device
from clrt.rendering.compile.choices import Choices
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.scene.geometry import instancing
from clrt.scene.geometry.transform import transform_mesh
from clrt.scene.lights import DirectionalLight, PointLight
from clrt.scene.materials.material_types import Diffuse, Mirror
from clrt.scene.model import Camera, Mesh, RenderSettings, Scene, Sphere

from ..covering import others
from ..rendering.pictures import quad
from ..rendering.test_variants import everything, planted

pytestmark = pytest.mark.programs

WHITE, BLACK = Diffuse(color=(0.8, 0.8, 0.8)), Diffuse(color=(0.0, 0.0, 0.0))
POINT = PointLight(position=(0.0, 4.0, 0.0), intensity=(5.0, 5.0, 5.0))
SETTINGS = RenderSettings(size=(8, 8), spp=16, max_depth=4)


def square(height: float, name: str, material: Diffuse | Mirror = WHITE, turned: bool = False) -> Mesh:
    """Return a horizontal square, 10 units wide, that faces up unless it is `turned`."""
    corners: list[tuple[float, float, float]] = [(-5, height, 5), (5, height, 5), (5, height, -5), (-5, height, -5)]
    return replace(quad(corners[::-1] if turned else corners, material), name=name)


def above_floor(*meshes: Mesh, material: Diffuse | Mirror = WHITE, **parts: Any) -> Scene:
    """Return a floor that fills the image, seen from a low position, with the given meshes and parts."""
    return replace(
        Scene(
            meshes=[square(0.0, "floor", material), *meshes],
            render=SETTINGS,
            camera=Camera(position=(0.0, 1.0, 2.0), look_at=(0.0, 0.0, 0.0), fov_degrees=20.0),
        ),
        **parts,
    )


def explained(device: Device, scene: Scene, pixel: tuple[int, int] = (4, 4)) -> str:
    paths = trace_pixel(scene, device, pixel)
    return summary(paths, SceneNames(scene, paths.compiled))


ROOF, VEIL = square(2.0, "roof", BLACK), square(1.5, "veil", Diffuse(color=(0.0, 0.0, 0.0), opacity=0.5))
LAMP = Diffuse(color=(0.0, 0.0, 0.0), emission=(5.0, 5.0, 5.0))
REASONS: dict[str, tuple[Scene, str]] = {
    "no light": (above_floor(), "black: nothing in this scene emits light"),
    "nothing there": (
        Scene(spheres=[Sphere(center=(0.0, 0.0, 99.0))], lights=[POINT], render=SETTINGS),
        "black: all 16 camera rays miss every object, and the scene has no environment",
    ),
    "roof": (
        above_floor(ROOF, lights=[POINT]),
        'sees mesh "floor"; light samples there: all 16 shadowed (by mesh "roof")',
    ),
    "roof behind a veil": (above_floor(ROOF, VEIL, lights=[POINT]), 'there: all 16 shadowed (by mesh "roof")'),
    "light below": (
        above_floor(lights=[replace(POINT, position=(0.0, -4.0, 0.0))]),
        "light samples there: all 16 behind the surface (light[0] (point))",
    ),
    "wound backwards": (
        above_floor(square(1.5, "lamp", LAMP)),
        'light samples there: all 16 in a direction without emission (mesh "lamp")',
    ),
    "seen from behind": (
        above_floor(material=LAMP, camera=Camera(position=(0.0, -3.0, 0.5))),
        'the camera sees mesh "floor", from behind; the emission of mesh "floor" faces away',
    ),
    "inside a ball": (
        above_floor(lights=[POINT], spheres=[Sphere(center=(0.0, 1.0, 2.0), radius=0.5, material=WHITE)]),
        'the camera sees sphere "sphere", from behind; light samples there: all 16 shadowed',
    ),
    "depth 1": (
        above_floor(lights=[POINT], render=replace(SETTINGS, max_depth=1)),
        "the depth limit of 1 shows emission alone; paths: all 16 end at the depth limit",
    ),
    "absorbed": (above_floor(material=BLACK, lights=[POINT]), "paths: all 16 are absorbed (by diffuse)"),
    "mirror": (
        above_floor(material=Mirror(), lights=[POINT]),
        "all 16 on a material that scatters nothing there (on mirror); paths: all 16 escape, but the scene ",
    ),
}


#: Cases whose programs differ from the others'.
FURTHER = ["roof behind a veil", "wound backwards", "absorbed", "mirror"]


@pytest.mark.parametrize("name", [*(name for name in REASONS if name not in FURTHER), *others(*FURTHER)])
def test_why_it_is_black(device: Device, name: str) -> None:
    scene, reason = REASONS[name]
    found = explained(device, scene)
    assert found.startswith("black: ") and reason in found, found


def test_where_the_light_comes_from(device: Device) -> None:
    """Half of the incoming light comes from each of two lights; the blocked third is reported."""
    both = [POINT, replace(POINT, position=(0.0, 4.0, 1e-3)), replace(POINT, position=(0.0, -4.0, 0.0))]
    scene = above_floor(lights=both, render=replace(SETTINGS, spp=256))
    found = explained(device, scene)
    shares = {name: float(found.split(f" % from {name}")[0].split()[-1]) for name in ("light[0]", "light[1]")}
    assert shares["light[0]"] + shares["light[1]"] == pytest.approx(100, abs=0.2)
    assert shares["light[0]"] == pytest.approx(50, abs=15) and "0 % of it indirect" in found


def listed(device: Device, scene: Scene, pixel: tuple[int, int] = (4, 4)) -> tuple[PixelPaths, list[Vertex]]:
    paths = trace_pixel(scene, device, pixel)
    names = SceneNames(scene, paths.compiled)
    return paths, [vertex for sample in range(scene.render.spp) for vertex in vertices(paths, names, sample)]


def test_a_veil_is_no_roof(device: Device) -> None:
    """A partly opaque surface transmits half of the light, and half of the paths: the sum equals the film's."""
    paths, found = listed(device, above_floor(VEIL, lights=[POINT]))
    floor = [vertex for vertex in found if vertex.object == 'mesh "floor"' and vertex.light_sample]
    assert floor and paths.value.any()
    for vertex in floor:
        assert vertex.light_sample is not None and vertex.light_sample.blocker is None
        assert vertex.light_sample.outcome == "partly shadowed"
        assert vertex.light_sample.contribution[0] == pytest.approx(0.5 * vertex.light_sample.unshadowed[0], rel=1e-5)


def test_places_are_the_scenes_own(device: Device) -> None:
    """Positions are in scene units for a scene that is scaled by 1e7, far away and traced in another frame."""
    scale, middle = 1e7, np.array([5e8, 0.0, 0.0])
    scene = above_floor(lights=[DirectionalLight(direction=(0.0, -1.0, 0.0), irradiance=(1.0, 1.0, 1.0))])
    matrix = np.diag([scale, scale, scale, 1.0])
    matrix[:3, 3] = middle
    camera = replace(scene.camera, position=(middle[0], scale, 2 * scale), look_at=(middle[0], 0.0, 0.0))
    far = replace(scene, meshes=[transform_mesh(mesh, matrix) for mesh in scene.meshes], camera=camera)
    (_, here), (paths, there) = listed(device, scene), listed(device, far)
    assert paths.compiled.frame.unit != 1
    assert len(here) == len(there)
    for near, distant in zip(here, there):
        assert near.object == distant.object and near.end == distant.end
        if near.position and distant.position and near.distance and distant.distance:
            assert (np.array(distant.position) - middle) / scale == pytest.approx(near.position, abs=1e-3)
            assert distant.distance / scale == pytest.approx(near.distance, rel=1e-4)


def test_names_of_objects_and_lights(monkeypatch: pytest.MonkeyPatch) -> None:
    """Names of all entries of the light table, with instances before it, and of objects that share a name."""
    monkeypatch.setattr(instancing, "FEW_TRIANGLES", 0)
    scene = planted(everything())
    scene.materials = {"lamp": scene.meshes[1].material}
    scene.meshes[1] = replace(scene.meshes[1], name="lamp")
    compiled = compile_scene(scene, Choices())
    names = SceneNames(scene, compiled)
    assert compiled.instances and [names.light(i) for i in range(int(compiled.counts["lights"][0]))] == [
        'mesh "lamp"',
        'sphere "sphere" (object 6)',
        "light[0] (point)",
        "light[3] (spot)",
        "light[4] (spot)",
        "light[5] (projector)",
        "light[6] (goniometric)",
        "light[1] (directional)",
        "light[2] (directional)",
        "the environment",
    ]
    assert [names.object(i) for i in (0, 1, 3, 5)] == [
        'mesh "mesh" (object 0)',
        'mesh "lamp"',
        'instance "instance" (object 3)',
        'sphere "sphere" (object 5)',
    ]
    assert [names.material(i) for i in (1, 3, 5)] == ['"lamp" (diffuse)', "metallic_roughness", "mirror"]
    assert names.infinite == "the environment and the discs of directional lights"
