"""Transparent images: coverage against closed forms, and compositing against renders of what is composited."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clrt
from clrt.device.open import Device
from clrt.rendering.film.backdrop import backdrop_pixels
from clrt.rendering.film.film import Film
from clrt.rendering.renderer import Renderer
from clrt.scene.lights import DirectionalLight, Light
from clrt.scene.materials.material_types import Dielectric, Diffuse, Mirror
from clrt.scene.model import Backdrop, Camera, Environment, Mesh, RenderSettings, Scene, Sphere
from clrt.scene.render_settings import Integrator

from ..covering import others
from .pictures import Doubles, film

BLACK = (0.0, 0.0, 0.0)
LIT = Diffuse(color=BLACK, emission=(3.0, 2.0, 1.0))
ABOVE = Camera(position=(0.0, 0.0, 5.0), projection="orthographic", view_height=2.0)
SIZE = (24, 16)
SKY = (0.25, 0.5, 1.5)


def half_plane(slope: float, offset: float) -> Mesh:
    """Return what lies to the left of the line x = offset + slope·y."""
    near, far = offset - 9 * slope, offset + 9 * slope
    corners = [(-99.0, -9.0, 0.0), (near, -9.0, 0.0), (far, 9.0, 0.0), (-99.0, 9.0, 0.0)]
    return Mesh(np.array(corners, np.float32), np.array([(0, 1, 2), (0, 2, 3)], np.int32), LIT)


def shapes(**render: Any) -> Scene:
    """Return emissive shapes, whose radiance no other light changes, under a sky."""
    settings: dict[str, Any] = {"size": SIZE, "spp": 16, "transparent": True, **render}
    return Scene(
        meshes=[half_plane(0.3, -0.6)],
        spheres=[Sphere(center=(0.5, 0.1, 0.5), radius=0.4, material=LIT)],
        camera=ABOVE,
        environment=Environment(color=SKY),
        render=RenderSettings(**settings),
    )


def opaque(scene: Scene, **parts: Any) -> Scene:
    return replace(scene, render=replace(scene.render, transparent=False), **parts)


def covered(found: Film) -> Doubles:
    assert found.alpha is not None
    return found.alpha


def pixel_places(count: int) -> tuple[Doubles, Doubles]:
    """Return the coordinates (h, w, count²) of a grid of points in each pixel of ABOVE's image."""
    inner = (np.arange(count) + 0.5) / count
    x = (np.arange(SIZE[0])[:, None] + inner).ravel() / SIZE[0] * 3 - 1.5
    y = 1 - (np.arange(SIZE[1])[:, None] + inner).ravel() / SIZE[1] * 2
    x, y = np.meshgrid(x, y)
    return tuple(  # type: ignore[return-value]
        each.reshape(SIZE[1], count, SIZE[0], count).swapaxes(1, 2).reshape(SIZE[1], SIZE[0], -1) for each in (x, y)
    )


def test_coverage_is_the_covered_area(device: Device) -> None:
    """Of a half plane and a sphere, by 64 x 64 points per pixel; stratified samples err by 1/spp at an edge at most."""
    x, y = pixel_places(64)
    area = ((x < -0.6 + 0.3 * y) | (np.hypot(x - 0.5, y - 0.1) < 0.4)).mean(axis=2)
    found = covered(film(device, shapes(spp=1024), sampler="sobol"))
    assert ((area > 0.1) & (area < 0.9)).sum() > 20
    np.testing.assert_allclose(found, area, atol=6e-3)
    np.testing.assert_array_equal(found[area == 0], 0)
    np.testing.assert_array_equal(found[area == 1], 1)


def test_edge_profile_of_the_tent_filter(device: Device) -> None:
    """Across a vertical edge, coverage is the integral of the filter: a tent 2 pixels wide."""
    scene = replace(shapes(filter="tent", spp=4096), spheres=[], meshes=[half_plane(0.0, 0.03)])
    found = covered(film(device, scene, sampler="sobol"))
    t = np.clip(1.53 / 3 * SIZE[0] - (np.arange(SIZE[0]) + 0.5), -1, 1)  # from a pixel's center to the edge
    profile = np.where(t < 0, (1 + t) ** 2 / 2, 1 - (1 - t) ** 2 / 2)
    np.testing.assert_allclose(found, np.broadcast_to(profile, found.shape), atol=2e-3)


@pytest.mark.parametrize("color", [SKY, *others((BLACK,), ((1.0, 1.0, 1.0),))])
def test_compositing_equals_a_render_over_the_color(device: Device, color: tuple[float, float, float]) -> None:
    """A visible environment does not change emissive black surfaces, and is what is seen behind them."""
    scene = shapes()
    found = film(device, scene, 16, sampler="sobol")
    over = found.mean + (1 - covered(found))[..., None] * color
    render = film(device, opaque(scene, environment=Environment(color=color)), 16, sampler="sobol")
    np.testing.assert_allclose(over, render.mean, atol=1e-6)


@pytest.mark.programs
def test_a_backdrop_equals_an_environment(device: Device) -> None:
    """Mean, variance and error estimate are those of the rendered environment, however the color gets there."""
    scene = opaque(shapes())
    seen, behind = (
        Renderer(each, device=device.info.index) for each in (scene, replace(scene, backdrop=Backdrop(color=SKY)))
    )
    states = [[*renderer.passes(spp=16)][-1] for renderer in (seen, behind)]
    np.testing.assert_allclose(states[1].pixels, states[0].pixels, atol=1e-6)
    np.testing.assert_allclose(states[1].film.variance, states[0].film.variance, rtol=1e-4, atol=1e-6)
    assert states[1].noise == pytest.approx(states[0].noise, rel=1e-4)


def test_the_environment_lights_what_it_does_not_show(device: Device) -> None:
    """A white ball in a white furnace is white, a mirror shows the sky, and nothing is behind them."""
    balls = [Sphere(center=(x, 0.0, 0.0), radius=0.45, material=each) for x, each in ((-0.6, LIT), (0.6, Mirror()))]
    scene = replace(
        shapes(),
        meshes=[],
        spheres=[replace(balls[0], material=Diffuse(color=(1.0, 1.0, 1.0))), balls[1]],
    )
    found = film(device, scene, 32, sampler="sobol")
    np.testing.assert_allclose(found.mean, covered(found)[..., None] * SKY, rtol=1e-5, atol=1e-6)
    assert covered(found).max() == 1 and covered(found).min() == 0
    hidden = film(device, opaque(scene, environment=Environment(color=SKY, camera_visible=False)), 32, sampler="sobol")
    np.testing.assert_array_equal(hidden.mean, found.mean)


@pytest.mark.parametrize("integrator", ["path", *others("local")])
def test_glass_lets_the_background_through(device: Device, integrator: str) -> None:
    """Whichever way a constant environment is refracted: over its color, glass is what it is in it, thin and solid."""
    glass = [
        Sphere(center=(x, 0.0, 0.0), radius=0.7, material=Dielectric(thin=thin, color=(0.6, 0.6, 0.6)))
        for x, thin in ((-0.75, False), (0.75, True))
    ]
    scene = replace(shapes(integrator=integrator, transparent_glass=True), meshes=[], spheres=glass)
    found = film(device, scene, 64, sampler="sobol")
    over = found.mean + (1 - covered(found))[..., None] * SKY
    np.testing.assert_allclose(over, film(device, opaque(scene), 64, sampler="sobol").mean, atol=2e-5)
    middles = SIZE[1] // 2, [SIZE[0] // 4, SIZE[0] * 3 // 4]
    assert ((0.3 < covered(found)[middles]) & (covered(found)[middles] < 0.9)).all()
    solid = covered(film(device, replace(scene, render=replace(scene.render, transparent_glass=False)), 4))
    assert (solid[middles] == 1).all()


@pytest.mark.parametrize("integrator", ["normals", *others("raster", "local", "albedo")])
def test_all_integrators_have_the_same_coverage(device: Device, integrator: Integrator) -> None:
    scene = replace(shapes(), camera=Camera(position=(0.0, 1.0, 5.0)))
    path = film(device, scene, 16, sampler="sobol")
    other = film(device, replace(scene, render=replace(scene.render, integrator=integrator)), 16, sampler="sobol")
    np.testing.assert_allclose(covered(other), covered(path), atol=1e-6)


@pytest.mark.programs
def test_a_hidden_lamp_still_lights(device: Device) -> None:
    """Where a lamp was seen, the wall behind it is; everywhere else the image is the same to the last bit."""
    lamp = Sphere(center=(0.0, 0.0, 1.0), radius=0.3, material=LIT)
    wall = replace(half_plane(0.0, 99.0), material=Diffuse())
    scene = opaque(replace(shapes(), meshes=[wall], spheres=[lamp]), environment=Environment())
    hidden = replace(lamp, material=replace(LIT, camera_visible=False))
    seen, unseen = (film(device, each, 64, sampler="sobol").mean for each in (scene, replace(scene, spheres=[hidden])))
    x, y = pixel_places(8)
    inside, outside = (np.hypot(x, y).max(axis=2) < 0.3), (np.hypot(x, y).min(axis=2) > 0.31)
    np.testing.assert_allclose(seen[inside], np.broadcast_to(LIT.radiance, seen[inside].shape), rtol=1e-6)
    assert unseen[inside].max() < 0.3 and unseen[inside].min() > 0.05
    np.testing.assert_allclose(unseen[outside], seen[outside], rtol=2e-2)
    depth = replace(scene.render, integrator="depth")
    np.testing.assert_allclose(film(device, replace(scene, spheres=[hidden], render=depth), 1).mean, 5, rtol=1e-6)


@pytest.mark.parametrize("integrator", ["path", *others("local")])
def test_a_hidden_sun_still_lights(device: Device, integrator: Integrator) -> None:
    """Its disc is not behind the scene, but in a mirror, and a ball is as bright as before; another sun is visible."""
    corners = np.array([(-9, -0.5, -90), (-9, -0.5, 9), (9, -0.5, 9), (9, -0.5, -90)], np.float32)
    floor = Mesh(corners, np.array([(0, 1, 2), (0, 2, 3)], np.int32), Mirror())
    suns = [
        DirectionalLight(direction=(x, -0.12, 1.0), irradiance=(1.0, 2.0, 3.0), angle_degrees=4.0) for x in (-0.3, 0.3)
    ]
    scene = Scene(
        meshes=[floor],
        spheres=[Sphere(center=(0.0, 0.0, 0.0), radius=0.4, material=Diffuse())],
        camera=Camera(position=(0.0, 0.0, 5.0), look_at=(0.0, 0.0, 0.0)),
        render=RenderSettings(size=SIZE, integrator=integrator),
    )
    hidden = [replace(suns[0], camera_visible=False), suns[1]]
    dim = [replace(suns[0], irradiance=(1e-12,) * 3), suns[1]]
    without, seen, unseen = (
        film(device, replace(scene, lights=list[Light](lights)), 64, sampler="sobol").mean
        for lights in (dim, suns, hidden)
    )
    disc = np.abs(seen - unseen).max(axis=2) > 1
    right = np.arange(SIZE[0]) >= SIZE[0] // 2
    assert 1 < disc.sum() < 20 and unseen[disc].max() == 0 and not disc[:, ~right].any()
    above, below = np.split(unseen, 2)
    assert above[:, ~right].max() > 50 and below[:, right].max() > 50  # the other one, and this one's reflection
    assert (unseen - without)[:, 8:16].max() > 0.003  # the rim of the ball
    np.testing.assert_allclose(unseen[~disc], seen[~disc], atol=1e-5)


@pytest.mark.combinations
def test_coverage_in_checkpoints_and_on_several_devices(device: Device, tmp_path: Path) -> None:
    """Two workers, and a render resumed from a checkpoint, give the film of one, to the last bit."""
    scene = shapes()
    whole = Renderer(scene, device=device.info.index, aovs="direct")
    pair = Renderer(scene, device=[device.info.index] * 2, aovs="direct")
    for renderer in (whole, pair):
        for _ in renderer.passes():
            pass
    for stop_after in (2, 16):
        resumed = Renderer(scene, device=device.info.index, aovs="direct", checkpoint=tmp_path / "film", resume=True)
        for state in resumed.passes():
            if state.spp >= stop_after:
                break
    one, two, three = (renderer.session.film().pixels for renderer in (whole, pair, resumed))
    assert one["alpha"].max() == 16
    np.testing.assert_array_equal(one, two)
    np.testing.assert_array_equal(one, three)
    with pytest.raises(clrt.CheckpointError, match="transparent True instead of False"):
        Renderer(opaque(scene), device=device.info.index, aovs="direct", checkpoint=tmp_path / "film", resume=True)


def test_pixels_of_a_backdrop_are_means_over_their_areas() -> None:
    """Against the integral of the image, as a sum over tiny squares; it fills the frame and is cropped evenly."""
    image = np.random.default_rng(5).random((12, 20, 3)).astype(np.float32)
    np.testing.assert_array_equal(backdrop_pixels(Backdrop(image=image), (20, 12)), image)
    for width, height in ((7, 5), (40, 24), (9, 13), (33, 4)):
        scale = min(20 / width, 12 / height)
        x = 10 + scale * ((np.arange(width * 64) + 0.5) / 64 - width / 2)
        y = 6 + scale * ((np.arange(height * 64) + 0.5) / 64 - height / 2)
        fine = image.astype(np.float64)[np.floor(y).astype(int)][:, np.floor(x).astype(int)]
        expected = fine.reshape(height, 64, width, 64, 3).mean(axis=(1, 3))
        np.testing.assert_allclose(backdrop_pixels(Backdrop(image=image), (width, height)), expected, atol=0.02)
    np.testing.assert_array_equal(
        backdrop_pixels(Backdrop(color=SKY), (7, 5)), np.array(SKY, np.float32).reshape(1, 1, 3)
    )


def test_image_over_a_photo(device: Device) -> None:
    """The image of a backdrop is the transparent one composited over it, and is opaque; alpha stays available."""
    photo = np.random.default_rng(3).random((SIZE[1], SIZE[0], 3)).astype(np.float32)
    scene = shapes()
    transparent = clrt.render(scene, device=device.info.index)
    image = clrt.render(opaque(scene, backdrop=Backdrop(image=photo)), device=device.info.index)
    assert transparent.alpha is not None and image.alpha is not None
    over = transparent.pixels + (1 - transparent.alpha[..., None]) * photo
    np.testing.assert_allclose(image.pixels, over, atol=1e-6)
    assert (image.layers.shape[2], transparent.layers.shape[2]) == (3, 4)
    np.testing.assert_array_equal(image.pixels[image.alpha == 0], photo[image.alpha == 0])


@pytest.mark.needs("mitsuba")
@pytest.mark.study
def test_mitsuba_sees_the_same_coverage(device: Device) -> None:
    """Mitsuba's path integrator with hide_emitters and an alpha channel, at 4096 samples per pixel."""
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    to_world = mi.ScalarTransform4f().look_at(origin=[0, 1, 5], target=[0, 0, 0], up=[0, 1, 0])
    film_of = {"type": "hdrfilm", "width": 24, "height": 16, "pixel_format": "rgba", "rfilter": {"type": "box"}}
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "hide_emitters": True, "max_depth": 3},
            "sensor": {"type": "perspective", "fov": 30, "fov_axis": "y", "to_world": to_world, "film": film_of},
            "ball": {"type": "sphere", "center": [0.3, 0.1, 0], "radius": 0.7, "bsdf": {"type": "diffuse"}},
            "sky": {"type": "constant", "radiance": {"type": "rgb", "value": list(SKY)}},
        }
    )
    theirs = np.array(mi.render(scene, spp=4096))
    ball = Sphere(center=(0.3, 0.1, 0.0), radius=0.7, material=Diffuse(color=(0.5, 0.5, 0.5)))
    ours = clrt.render(
        Scene(
            spheres=[ball],
            environment=Environment(color=SKY),
            camera=Camera(position=(0.0, 1.0, 5.0), fov_degrees=30.0),
            render=RenderSettings(size=(24, 16), spp=1024, max_depth=3, transparent=True),
        ),
        device=device.info.index,
    )
    assert ours.alpha is not None and 0.1 < ours.alpha.mean() < 0.2
    np.testing.assert_allclose(ours.layers, theirs, atol=0.03)  # 4 standard errors of half-covered pixels
    assert np.abs(ours.layers - theirs).mean() < 2e-3
