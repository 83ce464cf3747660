"""Back-face culling for camera rays or all rays, with exact expectations, for every integrator."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
from numpy.typing import NDArray

import clrt
from clrt.device.open import Device
from clrt.rendering.compile.choices import Choices
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.scene.geometry import instancing
from clrt.scene.lights import DirectionalLight
from clrt.scene.materials.material_types import Dielectric, Diffuse, Material, Mirror
from clrt.scene.model import Camera, Environment, Instance, Mesh, RenderSettings, Scene, Sphere
from clrt.scene.render_settings import Culling, Integrator

from ..covering import covering, others
from .pictures import box, film, quad

BLACK = (0.0, 0.0, 0.0)
WALL, LAMP = Diffuse(color=BLACK), Diffuse(color=BLACK, emission=(1.0, 2.0, 3.0))
RADIANCE = np.array([1.0, 2.0, 3.0])
CULLINGS = get_args(Culling)[::-1]


def square(height: float, material: Material, up: bool = True, half: float = 9.0) -> Mesh:
    """Return a square across the y axis, facing up or down."""
    mesh = quad([(-half, height, half), (half, height, half), (half, height, -half), (-half, height, -half)], material)
    mesh.faces = mesh.faces if up else mesh.faces[:, ::-1].copy()
    return mesh


def seen(
    device: Device,
    culling: Culling,
    *meshes: Mesh,
    height: float = 10.0,
    integrator: Integrator = "path",
    spheres: list[Sphere] | None = None,
    lights: list[DirectionalLight] | None = None,
    lanes: int = 8,
) -> NDArray[np.float64]:
    """Return the image of a camera at `height` that looks straight down."""
    camera = Camera(position=(0, height, 0), look_at=(0, 0, 0), up=(0, 0, 1), fov_degrees=5)
    render = RenderSettings(size=(8, 8), spp=4, max_depth=3, integrator=integrator, back_face_culling=culling)
    return film(
        device,
        Scene(meshes=list(meshes), spheres=spheres or [], lights=[*(lights or [])], camera=camera, render=render),
        lanes=lanes,
    ).mean


@covering("integrator, lanes, culling", ["path", "raster", "local"], [1, 8], CULLINGS)
def test_the_camera_looks_through_back_faces(
    device: Device, integrator: Integrator, lanes: int, culling: Culling
) -> None:
    """A black wall in front of an emitter, with its front or back to the camera, or double-sided."""
    for wall, culled in (
        (square(5, WALL, up=True), False),
        (square(5, WALL, up=False), culling != "none"),
        (square(5, replace(WALL, double_sided=True), up=False), False),
    ):
        found = seen(device, culling, square(0, LAMP), wall, integrator=integrator, lanes=lanes)
        np.testing.assert_array_equal(found, np.broadcast_to(RADIANCE * culled, (8, 8, 3)))


@pytest.mark.programs
@pytest.mark.parametrize("few_triangles", [0, *others(1 << 20)], ids=["instance", "mesh"])
@pytest.mark.parametrize("culling", ["all", *others("camera", "none")])
@pytest.mark.parametrize(
    "axes, keeps",
    [((-1, 1, 1), True), ((1, -1, 1), False), ((-1, -1, -1), False), ((-1, -1, 1), False), ((-1, 1, -1), True)],
)
def test_mirrored_instances(
    device: Device,
    monkeypatch: pytest.MonkeyPatch,
    axes: tuple[int, int, int],
    keeps: bool,
    culling: Culling,
    few_triangles: int,
) -> None:
    """A mirrored wall's front is the mirror image of the wall's front, for culling and for emission. The second
    instance is behind the camera; a single one would become a mesh."""
    monkeypatch.setattr(instancing, "FEW_TRIANGLES", few_triangles)
    places = [np.column_stack([np.diag(axes), [0.0, height, 0.0]]) for height in (5.0, 50.0)]
    camera = Camera(position=(0, 10, 0), look_at=(0, 0, 0), up=(0, 0, 1), fov_degrees=5)
    for material, hidden in ((WALL, True), (LAMP, True), (replace(WALL, double_sided=True), False)):
        wall = square(0, material)
        scene = Scene(
            meshes=[square(0, replace(LAMP, emission=(7.0, 7.0, 7.0)))],
            instances=[Instance(wall, place) for place in places],
            camera=camera,
            render=RenderSettings(size=(8, 8), spp=4, back_face_culling=culling),
        )
        assert compile_scene(scene, Choices()).instances == 2 * (few_triangles == 0 and material is not LAMP)
        through = hidden and not keeps and culling != "none"
        expected = [7.0] * 3 if through else RADIANCE * (material is LAMP and keeps)
        np.testing.assert_allclose(film(device, scene).mean, np.broadcast_to(expected, (8, 8, 3)), rtol=1e-6)


@pytest.mark.programs
@covering("integrator, culling", ["depth", "albedo", "normals"], CULLINGS)
def test_pictures_of_what_is_seen_first(device: Device, integrator: Integrator, culling: Culling) -> None:
    """They show the wall, or the floor behind it if the wall is culled."""
    floor, wall = square(0, Diffuse(color=(0.25, 0.5, 0.75))), square(5, Diffuse(color=(0.1, 0.1, 0.1)), up=False)
    culled = culling != "none"
    expected = {
        "depth": [10.0 if culled else 5.0],
        "normals": [0.0, 1.0, 0.0],
        "albedo": [0.25, 0.5, 0.75] if culled else [0.1],
    }[integrator]
    found = seen(device, culling, floor, wall, integrator=integrator)
    np.testing.assert_allclose(found, np.broadcast_to(expected, (8, 8, 3)), rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("culling", ["all", *others("camera", "none")])
def test_aovs_of_what_is_seen_first(device: Device, culling: Culling) -> None:
    floor, wall = square(0, Diffuse()), square(5, Diffuse(), up=False)
    scene = Scene(meshes=[floor, wall], camera=Camera(position=(0, 10, 0), look_at=(0, 0, 0), up=(0, 0, 1)))
    image = clrt.render(
        scene,
        device=device.info.index,
        size=(4, 4),
        spp=1,
        back_face_culling=culling,
        aovs="object",
        integrator="normals",
    )
    assert np.all(image.aovs["object"] == (1 if culling == "none" else 0))
    assert image.report["back_face_culling"] == culling


@pytest.mark.programs
@covering("integrator, culling", ["path", "local"], CULLINGS)
def test_shadow_rays_pass_back_faces_where_all_are_culled(
    device: Device, integrator: Integrator, culling: Culling
) -> None:
    """A wall faces the sun with its back to the floor's shadow rays. Light is E·albedo/pi, exactly."""
    sun = DirectionalLight(direction=(1, -1, 0), irradiance=(2, 2, 2))
    floor = square(0, Diffuse(color=(0.5, 0.5, 0.5)))
    for up in (True, False):
        wall = square(50, WALL, up=up)
        wall.vertices = wall.vertices - np.array([50, 0, 0], np.float32)
        lit = culling == "all" and up
        expected = 0.5 / np.pi * 2 * np.sqrt(0.5) * lit
        found = seen(device, culling, floor, wall, integrator=integrator, lights=[sun])
        assert found == pytest.approx(expected, rel=1e-5)


@pytest.mark.programs
@covering("integrator, culling", ["local", "path"], CULLINGS)
def test_mirrors_show_what_the_camera_does_not_see(device: Device, integrator: Integrator, culling: Culling) -> None:
    """A mirror shows the back of a wall in front of an emitter, unless culling applies to all rays."""
    found = seen(
        device, culling, square(0, Mirror()), square(20, WALL), square(30, LAMP, up=False), integrator=integrator
    )
    np.testing.assert_allclose(found, np.broadcast_to(RADIANCE * (culling == "all"), (8, 8, 3)), rtol=1e-6)


@pytest.mark.programs
@pytest.mark.parametrize("culling", ["camera", "all"])
def test_closed_surfaces_look_the_same(device: Device, culling: Culling) -> None:
    """Camera rays hit fronts first; light inside glass still hits the backs, and no extra code is compiled."""
    cube = box(0.9, Dielectric())
    cube.vertices, cube.faces = cube.vertices - np.array([2, 0, 0], np.float32), cube.faces[:, ::-1].copy()
    scene = Scene(
        meshes=[cube],
        spheres=[Sphere(material=Dielectric(color=(0.5, 0.9, 0.5)))],
        environment=Environment(image=np.random.default_rng(3).random((8, 16, 3)).astype(np.float32)),
        render=RenderSettings(size=(32, 24), spp=4),
    )
    culled = replace(scene, render=replace(scene.render, back_face_culling=culling))
    assert film(device, culled).pixels.tobytes() == film(device, scene).pixels.tobytes()
    assert "OPACITY" not in compile_scene(culled, Choices()).features
    plastic = replace(scene, meshes=[replace(cube, material=Diffuse())], spheres=[Sphere(radius=0.5)])
    opaque, through = (
        replace(plastic, render=replace(scene.render, integrator="depth", back_face_culling=each))
        for each in ("none", culling)
    )
    assert "OPACITY" in compile_scene(through, Choices()).features
    np.testing.assert_array_equal(film(device, through).mean, film(device, opaque).mean)
