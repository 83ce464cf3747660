"""Points are projected where a float64 reference projects them, for every camera."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from numpy.typing import NDArray

import clrt
from clrt.bench.kernel_probe import choices
from clrt.bench.significance import sidak
from clrt.debug.record import PathEnd
from clrt.debug.trace import trace_pixel
from clrt.device.open import Device
from clrt.device.programs import program
from clrt.rendering.accumulation.denoiser_guides import render_guides
from clrt.rendering.compile.choices import Choices
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.scene.cameras import CAMERA_TYPES, Perspective, Projection
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Camera, Environment, RenderSettings, Scene, Sphere

from ..covering import covering, others
from .pictures import film, frame, pixel_p_values, session
from .skies import lookup

Doubles = NDArray[np.float64]
KERNELS = Path(__file__).parents[2] / "kernels"
CAMERAS = {
    "plain": Camera(position=(0.0, 0.0, 5.0), look_at=(0.0, 0.0, 0.0), fov_degrees=40),
    "wide": Camera(position=(1.0, 2.0, 3.0), look_at=(4.0, 2.5, -3.0), fov_degrees=110),
    "down": Camera(position=(0.0, 8.0, 0.0), look_at=(0.0, 0.0, 0.0), up=(0.0, 0.0, -1.0), fov_degrees=20),
    "rolled": Camera(position=(-3.0, 1.0, 2.0), look_at=(0.0, 0.0, 0.0), up=(1.0, 2.0, -0.3), fov_degrees=60),
    "far": Camera(position=(1e5, 0.0, 0.0), look_at=(1e5, 0.0, -1.0), fov_degrees=40),
    "lens": Camera(position=(-3.0, 1.0, 2.0), up=(1.0, 2.0, -0.3), aperture_radius=0.5, focus_distance=20.0),
    "parallel": Camera(position=(1.0, 2.0, 3.0), look_at=(4.0, 2.5, -3.0), projection="orthographic", view_height=7.0),
    "as high as": Camera(position=(0.0, 3.0, 4.0), projection="orthographic", fov_degrees=90),
    "all around": Camera(position=(-3.0, 1.0, 2.0), up=(1.0, 2.0, -0.3), projection="equirectangular"),
}


def seen_at(camera: Camera, size: tuple[int, int], x: Doubles, y: Doubles, depth: Doubles) -> tuple[Doubles, Doubles]:
    """Return points (n, 3) that the camera sees at pixel (x, y) and a depth, and the width of a pixel there, (n,)."""
    forward, right, up, extent = frame(camera)
    width, height = size
    a, b = 2 * x / width - 1, 1 - 2 * y / height
    if camera.projection == "equirectangular":
        latitude, longitude = np.pi / 2 * b, np.pi * a
        level = np.outer(np.cos(longitude), forward) + np.outer(np.sin(longitude), right)
        directions = np.cos(latitude)[:, None] * level + np.outer(np.sin(latitude), up)
        pixel = np.pi * np.minimum(2 * np.cos(latitude) / width, 1 / height)
        return camera.position + depth[:, None] * directions, depth * pixel
    half = depth * extent
    if camera.projection == "orthographic":
        distance = np.linalg.norm(np.subtract(camera.look_at, camera.position))
        half = np.full(len(depth), camera.view_height / 2 if camera.view_height else extent * distance)
    across = np.outer(half * a * width / height, right) + np.outer(half * b, up)
    return camera.position + np.outer(depth, forward) + across, 2 * half / height


def glowing(centers: Doubles, radii: Doubles) -> list[Sphere]:
    """Return emissive spheres identified by their green to red ratio: 1, 2, ..."""
    return [
        Sphere(center=tuple(center), radius=radius, material=Diffuse(emission=(1.0, float(i + 1), 0.0)))
        for i, (center, radius) in enumerate(zip(centers.tolist(), radii.tolist()))
    ]


@covering("name, size", CAMERAS, [(40, 30), (21, 55)])
def test_spheres_lie_where_they_are_seen(device: Device, name: str, size: tuple[int, int]) -> None:
    """Eight emissive spheres, smaller than a pixel, lie at pixel centres; with a lens they are in focus."""
    camera, (width, height) = CAMERAS[name], size
    rng = np.random.default_rng(1)
    pixels = width * (height // 5) + rng.permutation(width * (3 * height // 5))[:8]  # away from the poles
    columns, rows = pixels % width, pixels // width
    depth = np.full(8, camera.focus_distance) if camera.focus_distance else rng.uniform(5, 50, 8)
    x, y = np.array([columns, rows]) + 0.5
    centers, pixel = seen_at(camera, size, x, y, depth.astype(np.float64))
    scene = Scene(
        spheres=glowing(centers, 0.15 * pixel), camera=camera, render=RenderSettings(size=size, spp=256, max_depth=1)
    )
    picture = film(device, scene).mean
    assert sorted(np.flatnonzero(picture[..., 0])) == sorted(pixels)
    np.testing.assert_allclose(picture[rows, columns, 1] / picture[rows, columns, 0], np.arange(1, 9), rtol=1e-6)


def test_right_is_cross_of_forward_and_up(device: Device) -> None:
    """Looking along −Z with +Y up, +X is on the right and +Y on top; the environment map's seam is in the middle."""
    image = np.random.default_rng(3).random((4, 8, 3)).astype(np.float32)
    for target in ((0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.3, 0.9, 0.2)):
        looking = Camera(position=(0.0, 0.0, 0.0), look_at=target, fov_degrees=1e-3)
        scene = Scene(environment=Environment(image=image), camera=looking, render=RenderSettings(size=(2, 2), spp=4))
        direction = np.array([target]) / np.linalg.norm(target)
        np.testing.assert_allclose(film(device, scene).mean, np.tile(lookup(image, direction), (2, 2, 1)), atol=1e-4)
    wide = Camera(position=(0.0, 0.0, 0.0), look_at=(0.0, 0.0, -1.0), fov_degrees=90)
    marks = [
        Sphere(center=(3.0, 0.0, -5.0), radius=0.5, material=Diffuse(emission=(1.0, 0.0, 0.0))),
        Sphere(center=(0.0, 3.0, -5.0), radius=0.5, material=Diffuse(emission=(0.0, 1.0, 0.0))),
    ]
    settings = RenderSettings(size=(9, 9), spp=16, max_depth=1)
    picture = film(device, Scene(spheres=marks, camera=wide, render=settings)).mean
    assert picture[..., 0].argmax() == 4 * 9 + 7
    assert picture[..., 1].argmax() == 1 * 9 + 4


@pytest.mark.parametrize("depth", [6.0, *others(12.0, 40.0)])
def test_a_point_out_of_focus_is_an_even_disc(device: Device, depth: float) -> None:
    """It has the radius R·|s − d|/d on the plane of focus, at s, for a lens of radius R and a point at d.

    Its second moment about its centre is half the radius squared, plus a sixth of the squared pixel side, as pixels are
    squares; its inner part has as large a share of the light as of the area.
    """
    lens = Camera(position=(0.0, 0.0, 10.0), look_at=(0.0, 0.0, 0.0), fov_degrees=10, aperture_radius=1.0)
    extent, side = frame(lens)[3], 64
    center, _ = seen_at(lens, (side, side), np.array([34.0]), np.array([29.5]), np.array([depth]))
    scene = Scene(
        spheres=glowing(center, np.array([0.002 * depth])),
        camera=lens,
        render=RenderSettings(size=(side, side), max_depth=1),
    )
    light = film(device, scene, 1 << 14, sampler="sobol").mean[..., 0]
    y, x = np.mgrid[:side, :side] + 0.5
    expected = abs(10 - depth) / depth * side / (2 * extent * 10)
    distance = np.hypot(x - 34.0, y - 29.5)
    blurred = 0.002 * side / (2 * extent)  # the sphere's own radius, in pixels
    assert light[distance > expected + blurred + 1].max() == 0
    measured = np.sqrt(2 * (np.average(distance**2, weights=light) - 1 / 6 - blurred**2 / 2))
    assert measured == pytest.approx(expected, rel=0.01)
    fine = (np.mgrid[: 16 * side, : 16 * side] + 0.5) / 16
    disc = np.hypot(fine[0] - 29.5, fine[1] - 34.0) < expected
    inner, area = distance < 0.7 * expected, disc.reshape(side, 16, side, 16).mean(axis=(1, 3))
    assert light[inner].sum() / light.sum() == pytest.approx(area[inner].sum() / area.sum(), abs=0.01)


def test_all_around_is_the_environments_own_picture(device: Device) -> None:
    """Along +Z it is the environment map as stored, except for rotation and strength, and rotates with the camera.
    Pixels are means over their area.
    """
    image = np.random.default_rng(5).random((6, 12, 3)).astype(np.float32)
    size, steps = (24, 12), 16
    v, u = np.meshgrid(
        (np.arange(12 * steps) + 0.5) / (12 * steps), (np.arange(24 * steps) + 0.5) / (24 * steps), indexing="ij"
    )
    sine, phi = np.sin(np.pi * v), 2 * np.pi * u
    w = np.stack([sine * np.sin(phi), np.cos(np.pi * v), -sine * np.cos(phi)], axis=-1).reshape(-1, 3)
    p_values = []
    for target, degrees, strength in (
        ((0.0, 0.0, 2.0), 0.0, 1.0),
        ((0.0, 0.0, 2.0), 70.0, 2.5),
        ((1.0, 0.5, -0.4), -20.0, 0.5),
    ):
        camera = Camera(position=(0.0, 0.0, 0.0), look_at=target, projection="equirectangular")
        forward, right, up, _ = frame(camera)
        seen = lookup(image, w @ np.array([-right, up, forward]), degrees) * strength
        expected = seen.reshape(12, steps, 24, steps, 3).mean(axis=(1, 3))
        scene = Scene(
            environment=Environment(image=image, strength=strength, rotation_degrees=degrees),
            camera=camera,
            render=RenderSettings(size=size, spp=1024),
        )
        p_values.append(pixel_p_values(film(device, scene), expected))
    assert np.min(p_values) > sidak(1e-3, np.size(p_values))


@pytest.mark.parametrize("filter", ["tent", "blackman_harris"])
def test_all_around_closes_at_its_ends(device: Device, filter: str) -> None:
    """Filters continue across the seam and the poles: the image stays within the environment map's range, and one that
    is constant along longitude stays so."""
    image = np.repeat(np.random.default_rng(6).random((4, 1, 3)), 8, axis=1).astype(np.float32)
    camera = Camera(position=(0.0, 0.0, 0.0), look_at=(0.0, 0.0, 1.0), projection="equirectangular")
    settings = RenderSettings(size=(4, 2), spp=4096, filter=filter)  # type: ignore[arg-type]
    picture = film(
        device, Scene(environment=Environment(image=image), camera=camera, render=settings), sampler="sobol"
    ).mean
    np.testing.assert_allclose(picture, np.broadcast_to(picture[:, :1], picture.shape), rtol=5e-3)
    assert picture.min() >= image.min() and picture.max() <= image.max()


@pytest.mark.parametrize("name", ["lens", *others("parallel", "all around")])
def test_guides_are_seen_by_the_same_rays(device: Device, name: str) -> None:
    """With emission equal to albedo, the image of emission equals the albedo guide, sample by sample."""
    rng = np.random.default_rng(2)
    x, y, depth = rng.uniform([[4], [4], [5]], [[20], [14], [12]], (3, 8))
    centers, _ = seen_at(CAMERAS[name], (24, 18), x, y, depth)
    colors = [tuple(color) for color in rng.random((8, 3)).tolist()]
    spheres = [
        Sphere(center=tuple(center), radius=2.0, material=Diffuse(color=color, emission=color))
        for center, color in zip(centers.tolist(), colors)
    ]
    running = session(
        device, Scene(spheres=spheres, camera=CAMERAS[name], render=RenderSettings(size=(24, 18), spp=16, max_depth=1))
    )
    for _ in running.render(16):
        pass
    picture = running.film().mean
    assert np.mean(picture.any(axis=2)) > 0.1
    np.testing.assert_allclose(render_guides(running, 16)["albedo"], picture, atol=1e-6)


@pytest.mark.parametrize("name", ["lens", "parallel", "as high as", "all around"])
def test_pictures_do_not_depend_on_the_unit_of_length(device: Device, name: str) -> None:
    """Images are equal bit for bit when scaled by powers of two."""
    rng = np.random.default_rng(2)
    x, y, depth = rng.uniform([[4], [4], [3]], [[20], [14], [30]], (3, 8))
    centers, _ = seen_at(CAMERAS[name], (24, 18), x, y, depth)
    pictures = []
    for unit in (1.0, 2.0**-40, 2.0**40):
        camera = CAMERAS[name]
        position, look_at = (tuple((unit * np.array(p)).tolist()) for p in (camera.position, camera.look_at))
        camera = replace(
            camera,
            position=position,
            look_at=look_at,
            aperture_radius=camera.aperture_radius * unit,
            focus_distance=camera.focus_distance and camera.focus_distance * unit,
            view_height=camera.view_height and camera.view_height * unit,
        )
        scene = Scene(
            spheres=glowing(centers * unit, np.full(8, unit)),
            camera=camera,
            render=RenderSettings(size=(24, 18), spp=4, max_depth=1),
        )
        pictures.append(film(device, scene).mean)
    assert pictures[0].any() and all(np.array_equal(picture, pictures[0]) for picture in pictures)


def test_camera_types_are_complete() -> None:
    """The scene file accepts every type; a kernel file defines ALL_AROUND if its class says so."""
    assert tuple(CAMERA_TYPES) == get_args(Projection)
    for kind in CAMERA_TYPES.values():
        text = (KERNELS / "camera" / f"{kind.kernel}.cl").read_text(encoding="utf-8")
        assert ("#define ALL_AROUND 1" in text) == kind.all_around


HALF = """#include "core/vector.cl"
static inline ireal pinhole_ray(const Launch *launch, real sx, real sy, Sampler *sampler, CameraRay *ray) {
    real3 right = broadcast(launch->right), up = broadcast(launch->up), forward = broadcast(launch->forward);
    *ray = (CameraRay){broadcast(launch->position), normalize3(mad3(right, sx, mad3(up, -sy, forward)))};
    return ALL_LANES;
}
static inline ireal ray_through(const Launch *launch, real sx, real sy, Sampler *sampler, CameraRay *ray) {
    return pinhole_ray(launch, sx, sy, sampler, ray) & (sx > 0.0f);
}
"""


@pytest.mark.programs
@pytest.mark.parametrize("paths, lanes", [("waves", 8), ("lanes", 8), ("lanes", 1)])
def test_a_camera_may_have_no_ray(
    device: Device, paths: str, lanes: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a camera with rays in its right half alone, that half is the pinhole's and the other is black, in the image,
    its AOVs, the denoiser's guides and the record of paths; samples are counted in both, rays only in one."""
    sky, red = Environment(color=(1.0, 2.0, 3.0)), Diffuse(color=(0.7, 0.2, 0.1), emission=(0.1, 0.1, 0.1))
    scene = Scene(
        spheres=[Sphere(material=red)], environment=sky, camera=Camera(), render=RenderSettings(size=(32, 16), spp=4)
    )
    options: dict[str, Any] = {
        "device": device.info.index,
        "paths": paths,
        "lanes": lanes,
        "first_hits": True,
        "aovs": "albedo,normal,position,depth,object,direct,indirect,samples",
    }

    def rendered() -> tuple[dict[str, NDArray[np.generic]], int]:
        renderer = clrt.Renderer(scene, **options)
        *_, state = renderer.passes(spp=4)
        rays = int(state.film.pixels["rays"].sum())
        return {
            "image": state.pixels,
            **renderer.aovs(state),
            **{f"guide {name}": guide for name, guide in renderer.session.guides().items()},
        }, rays

    whole, rays = rendered()
    shutil.copytree(KERNELS, tmp_path / "kernels")
    (tmp_path / "kernels" / "camera" / "half.cl").write_text(HALF)
    monkeypatch.setattr(program, "kernel_folder", lambda: tmp_path / "kernels")
    monkeypatch.setattr(Perspective, "kernel", "half")
    half, fewer = rendered()
    for name, picture in half.items():
        assert np.array_equal(picture[:, 16:], whole[name][:, 16:]), name
        nothing = {"depth": np.inf, "object": -1, "samples": 4}.get(name, 0)
        assert np.all(picture[:, :16] == nothing), name
    assert fewer == pytest.approx(rays / 2, rel=0.05) and whole["image"][:, :16].all()
    for column, black in ((2, True), (29, False)):
        traced = trace_pixel(scene, device, (column, 8), Choices(lanes=lanes))
        assert len(traced.starts) == 4 and np.all(traced.rows["end"] == PathEnd.ESCAPED)
        np.testing.assert_allclose(traced.value, 0 if black else sky.color, rtol=1e-6)


def test_a_camera_compiles_to_its_own_file(device: Device) -> None:
    """Pinholes draw no random numbers for a lens, so the image does not depend on the focus distance."""
    files = {
        name: {
            file for file in compile_scene(Scene(camera=camera), choices(device)).files if file.startswith("camera/")
        }
        for name, camera in CAMERAS.items()
    }
    kinds: dict[Projection, str] = {
        "perspective": "pinhole",
        "orthographic": "orthographic",
        "equirectangular": "equirectangular",
    }
    for name, camera in CAMERAS.items():
        assert files[name] == {f"camera/{'thin_lens' if name == 'lens' else kinds[camera.projection]}.cl"}
    wall = Scene(
        environment=Environment(image=np.random.default_rng(1).random((9, 18, 3)).astype(np.float32)),
        render=RenderSettings(size=(16, 12), spp=4),
    )
    pictures = [film(device, replace(wall, camera=Camera(focus_distance=focus))).mean for focus in (None, 2.0)]
    assert np.array_equal(pictures[0], pictures[1])
