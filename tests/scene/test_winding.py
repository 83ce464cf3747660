"""Detection of emissive meshes with reversed winding."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clrt.formats.load_scene import load
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Camera, Instance, Mesh, Scene, Sphere
from clrt.scene.validation.winding import backward_emitters

LAMP = Diffuse(emission=(1.0, 1.0, 1.0))
CUBE = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32)
SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
OUTWARD = np.array([face for a, b, c, d in SIDES for face in ((a, b, c), (a, c, d))], np.int32)


def turned(mesh: Mesh) -> Mesh:
    return replace(mesh, faces=mesh.faces[:, ::-1].copy())


def panel(height: float) -> Mesh:
    """Return a panel that faces down."""
    corners = np.array([(-1, height, -1), (1, height, -1), (1, height, 1), (-1, height, 1)], np.float32)
    return Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32), LAMP, name="panel")


def cube(half: float, center: tuple[float, float, float], material: Diffuse) -> Mesh:
    """Return a cube whose faces point outwards."""
    return Mesh((half * CUBE + np.array(center)).astype(np.float32), OUTWARD, material, name="bulb")


def room(*meshes: Mesh) -> Scene:
    """Return a room 3 high with inward faces, a sphere and a camera."""
    return Scene(
        meshes=[turned(cube(1.5, (0, 1.5, 0), Diffuse())), *meshes],
        spheres=[Sphere(center=(0, 0.5, 0), radius=0.5)],
        camera=Camera(position=(0, 1.5, 1.4), look_at=(0, 1, 0)),
    )


def test_the_cube_is_wound_outwards() -> None:
    a, b, c = CUBE[OUTWARD].transpose(1, 0, 2)
    assert np.all(np.einsum("ij,ij->i", np.cross(b - a, c - a), a + b + c) > 0)


@pytest.mark.parametrize("height", [2.999, 3.0, 2.98])
def test_a_panel_at_the_ceiling(height: float) -> None:
    """With reversed winding it lights only the ceiling close to it, or nothing."""
    assert backward_emitters(room(panel(height))) == []
    assert backward_emitters(room(turned(panel(height)))) == ["panel"]
    double = replace(turned(panel(height)), material=replace(LAMP, double_sided=True))
    assert backward_emitters(room(double)) == []


def test_a_lamp_in_the_midst_lights_something_either_way() -> None:
    assert backward_emitters(room(panel(2.0), turned(panel(1.9)))) == []


def test_a_lamp_that_faces_the_camera_alone() -> None:
    scene = replace(room(turned(panel(3.0))), camera=Camera(position=(0, 9, 0), look_at=(0, 0, 0), up=(0, 0, 1)))
    assert backward_emitters(scene) == []
    for lamp, expected in ((panel(0.0), ["panel"]), (turned(panel(0.0)), [])):
        assert backward_emitters(Scene(meshes=[lamp], camera=scene.camera)) == expected


def test_a_bulb_that_lights_itself_from_inside() -> None:
    """A closed mesh wound inwards is reported, unless something is inside it, such as the scene inside a dome."""
    bulb = cube(0.1, (0.5, 2.0, 0.5), LAMP)
    assert backward_emitters(room(bulb)) == [] and backward_emitters(room(turned(bulb))) == ["bulb"]
    dome = turned(cube(9.0, (0, 0, 0), LAMP))
    assert backward_emitters(room(dome)) == []
    filament = Sphere(center=(0.5, 2.0, 0.5), radius=0.01)
    assert backward_emitters(replace(room(turned(bulb)), spheres=[filament])) == []
    open_bulb = turned(replace(bulb, faces=bulb.faces[1:]))
    assert backward_emitters(room(open_bulb)) == []


def test_instances_count_as_what_they_show() -> None:
    """Mirrored instances have the winding of the mesh: the transform keeps fronts in front."""
    up = np.column_stack([np.eye(3), [0, 3.0, 0]])
    scene = room()
    for lamp, expected in ((panel(0.0), []), (turned(panel(0.0)), ["lamp"])):
        assert backward_emitters(replace(scene, instances=[Instance(lamp, up, name="lamp")])) == expected
        painted = Instance(replace(lamp, material=Diffuse()), up, LAMP, name="lamp")
        assert backward_emitters(replace(scene, instances=[painted])) == expected
        assert backward_emitters(replace(scene, instances=[replace(painted, material=None)])) == []


@pytest.mark.parametrize("seed", range(20))
def test_bulbs_anywhere_among_things_are_found_by_their_winding(seed: int) -> None:
    """Outward bulbs are never reported; inward ones are, if nothing is inside, at any position and rotation."""
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    bulb = Mesh(
        (CUBE @ turn.T * rng.uniform(0.01, 0.3) + rng.uniform(-1, 1, 3)).astype(np.float32), OUTWARD, LAMP, name="bulb"
    )
    spheres = [Sphere(center=tuple(5 + rng.uniform(0, 5, 3)), radius=float(rng.uniform(0.1, 2))) for _ in range(4)]
    scene = Scene(meshes=[bulb], spheres=spheres, camera=Camera(position=(-5, 0, 0)))
    assert backward_emitters(scene) == []
    assert backward_emitters(replace(scene, meshes=[turned(bulb)])) == ["bulb"]


@pytest.mark.parametrize(
    "path", sorted((Path(__file__).parents[2] / "scenes").glob("*.toml")), ids=lambda path: path.stem
)
def test_no_scene_that_ships_is_warned_of(path: Path) -> None:
    assert backward_emitters(load(path)) == []
