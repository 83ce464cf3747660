"""Motion blur against closed forms, and against the mean of static images at the times in between."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import clrt
from clrt.bench.kernel_probe import Probe, choices
from clrt.bench.numerics.cases.instances import lit_plane, transforms_of_kinds
from clrt.bench.significance import mean_test, sidak
from clrt.device.open import Device
from clrt.rendering.compile.compile_scene import CompiledScene, compile_scene
from clrt.rendering.compile.geometry import pack_instances
from clrt.rendering.film.film import Film
from clrt.scene.cameras import CameraEnd
from clrt.scene.exposure import camera_at, motion_of
from clrt.scene.geometry import instancing
from clrt.scene.geometry.transform import axis_rotation, rotation, scaling, translation
from clrt.scene.materials.material_types import Diffuse, Material
from clrt.scene.model import Camera, Environment, Instance, Mesh, RenderSettings, Scene, Sphere

from ..covering import covering, others
from . import rays
from .pictures import film, quad
from .test_instance_offsets import met_again

Doubles = NDArray[np.float64]
BLACK, WHITE = Diffuse(color=(0, 0, 0)), Environment(color=(1, 1, 1))
GLOWS = Diffuse(color=(0, 0, 0), emission=(1, 1, 1))
#: Nothing but what moves at right angles to the view: 24 by 16 units, one per pixel.
SIZE = (24, 16)
ABOVE = Camera(projection="orthographic", view_height=16, shutter=(0, 1))
RADIUS, START, END, HEIGHT = 3.3, -4.2, 5.9, 0.4


def ball(material: Material, rings: int = 8, segments: int = 2048) -> Mesh:
    """Return a unit sphere whose outline along z is a polygon of 2048 corners: its area lacks 2e-6."""
    polar = np.linspace(0, np.pi, rings + 1)[1:-1]
    turns = 2 * np.pi * np.arange(segments) / segments
    sides = np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=1)
    body = np.sin(polar)[:, None, None] * sides + np.cos(polar)[:, None, None] * [0, 0, 1]
    one, other = np.arange(segments), (np.arange(segments) + 1) % segments
    faces = [np.stack([0 * one, 1 + one, 1 + other], axis=1)]
    for ring in range(rings - 2):
        above, below = 1 + ring * segments, 1 + (ring + 1) * segments
        faces += [np.stack([above + one, below + one, below + other], axis=1)]
        faces += [np.stack([above + one, below + other, above + other], axis=1)]
    last = 1 + (rings - 1) * segments
    faces += [np.stack([last + 0 * one, last - segments + other, last - segments + one], axis=1)]
    vertices = np.concatenate([[[0, 0, 1]], body.reshape(-1, 3), [[0, 0, -1]]])
    return Mesh(vertices.astype(np.float32), np.concatenate(faces).astype(np.int32), material)


def blurred_disc() -> Doubles:
    """Return the mean over each pixel and the exposure of a disc that moves to the right: along a row y it covers a
    chord of half length h, and a point x for the time that the chord's center is within h of x. Integrated over x in
    closed form, over y by 4000 points per pixel."""
    width, height = SIZE
    y = 8 - (np.arange(height * 4000) + 0.5) / 4000 - HEIGHT
    chord = np.sqrt(np.maximum(RADIUS**2 - y**2, 0))[:, None]
    edges = np.arange(width + 1) - width / 2

    def doubly(u: Doubles) -> Doubles:
        return np.maximum(u, 0) ** 2 / 2

    covered = np.zeros((len(y), width + 1))
    for sign, side, at in ((1, 1, START), (-1, 1, END), (-1, -1, START), (1, -1, END)):
        covered += sign * doubly(edges + side * chord - at)
    means = np.diff(covered, axis=1).reshape(height, 4000, width).mean(axis=1)
    return np.asarray(means / (END - START))


def placed(x: float) -> Doubles:
    return np.array([[RADIUS, 0, 0, x], [0, RADIUS, 0, HEIGHT], [0, 0, RADIUS, 0]])


def moving_ball(kind: str) -> tuple[Scene, Doubles]:
    """Return a scene, and the expected image of one channel."""
    covered = blurred_disc()
    settings = RenderSettings(size=SIZE, spp=4096, max_depth=1)
    if kind == "camera past a sphere":
        spheres = [Sphere(center=(START, HEIGHT, 0), radius=RADIUS, material=BLACK)]
        across = START - END
        camera = replace(ABOVE, end=CameraEnd(position=(across, 0, 5), look_at=(across, 0, 0)))
        return Scene(spheres=spheres, camera=camera, environment=WHITE, render=settings), 1 - covered
    dark = kind == "dark ball"
    moving = Instance(ball(BLACK if dark else GLOWS), placed(START), to_world_end=placed(END))
    sky = WHITE if dark else Environment()
    return Scene(instances=[moving], camera=ABOVE, environment=sky, render=settings), 1 - covered if dark else covered


def agrees(found: Film, expected: Doubles) -> bool:
    """Return whether the means of samples that are 0 or 1 agree: by a test where they are nearly normal, and elsewhere
    that at most 40 samples differ from the others."""
    count, mean = found.pixels["count"].astype(np.float64), found.mean[..., 0].astype(np.float64)
    variance = np.maximum(expected * (1 - expected), 0)
    normal = variance * count > 20
    p = mean_test(mean[normal], variance[normal], count[normal], expected[normal])
    return bool((p >= sidak(1e-3, p.size)).all() and (np.abs(mean - expected) * count <= 40)[~normal].all())


@pytest.mark.parametrize("kind", ["dark ball", *others("emissive ball", "camera past a sphere")])
def test_a_moving_ball_has_its_closed_form(device: Device, kind: str) -> None:
    """At constant speed, each pixel is the mean over its area and the exposure of what a disc covers."""
    scene, expected = moving_ball(kind)
    found = film(device, scene)
    assert agrees(found, expected) and not agrees(found, np.roll(expected, 1, axis=1))


def test_a_turning_camera_has_its_closed_form(device: Device) -> None:
    """A pinhole camera pans at a constant rate in an environment that is black on one side of an azimuth: a pixel is as
    bright as the fraction of the exposure in which its own azimuth is on the white side. The edge is one texel wide."""
    texels, angle, size = 4096, 0.5, (24, 16)
    image = np.zeros((8, texels, 3), np.float32)
    image[:, texels // 2 :] = 1  # from +Z on, via −X … (docs/scene-format.md)
    ahead = axis_rotation((0, 1, 0), np.degrees(angle))[:3, :3] @ [0, 0, 1]
    camera = Camera(
        position=(0, 0, 0), look_at=(0, 0, 1), fov_degrees=50, shutter=(0, 1), end=CameraEnd(look_at=tuple(ahead))
    )
    scene = Scene(camera=camera, environment=Environment(image=image), render=RenderSettings(size=size, spp=2048))
    x = ((np.arange(size[0] * 500) + 0.5) / 500 * 2 / size[0] - 1) * np.tan(np.radians(25)) * size[0] / size[1]
    s = (np.arange(1000) + 0.5) / 1000
    # The image's right is −X. A point at the fraction u = atan2(x, −z)/2π of the sky's width is a texel u·4096 − ½.
    azimuth = np.arctan(-x)[:, None] + angle * s
    u = np.mod(np.arctan2(np.sin(azimuth), -np.cos(azimuth)) / (2 * np.pi), 1)
    white = np.clip(u * texels - texels // 2 + 0.5, 0, 1).mean(axis=1).reshape(size[0], 500).mean(axis=1)
    assert 0 < white.min() + 0.1 < white.max() and np.ptp(white) > 0.5
    assert agrees(film(device, scene), np.tile(white, (size[1], 1)))


@covering("moves, opened", ["camera", "instance"], [0.5, 0.0])
def test_a_rolling_shutter_shears_an_edge(device: Device, moves: str, opened: float) -> None:
    """An edge that moves to the right at a constant speed is, in row y, where it is at y/height of the readout, and
    blurred by what it moves while the shutter is open."""
    speed, readout = 6.0, 1.0
    duration, at = readout + opened, -3.3
    edge = quad([(-30, -30, 0), (0, -30, 0), (0, 30, 0), (-30, 30, 0)], BLACK)
    start, end = (translation((at + speed * t, 0, 0))[:3] for t in (0.0, duration))
    camera = replace(ABOVE, shutter=(2.0, 2.0 + opened), rolling_shutter=readout)
    if moves == "camera":
        mesh = replace(edge, vertices=edge.vertices + np.array([at, 0, 0], np.float32))
        place = (-speed * duration, 0.0)
        camera = replace(camera, end=CameraEnd(position=(*place, 5), look_at=(*place, 0)))
        scene = Scene(meshes=[mesh], camera=camera)
    else:
        scene = Scene(instances=[Instance(edge, start, to_world_end=end)], camera=camera)
    scene = replace(scene, environment=WHITE, render=RenderSettings(size=SIZE, spp=1024, max_depth=1))
    times = np.arange(SIZE[1])[:, None] / SIZE[1] * readout + opened * (np.arange(2000) + 0.5) / 2000
    edges = at + speed * times  # (rows, times)
    left = np.arange(SIZE[0]) - SIZE[0] / 2
    white = 1 - np.clip(edges[:, None] - left[:, None], 0, 1).mean(axis=2)
    assert agrees(film(device, scene), white)


@pytest.mark.programs
@pytest.mark.parametrize("aperture", [0.1, *others(0.0)])
def test_a_distorting_lens_zooms(device: Device, aperture: float) -> None:
    """With hardly any distortion a zoom is that of the lens without distortion, in light and in data."""
    camera = Camera(position=(0, 0, 5), fov_degrees=30, shutter=(0, 1), aperture_radius=aperture)
    camera = replace(camera, end=CameraEnd(fov_degrees=90))
    ball = Sphere(radius=1, material=Diffuse(color=(0.5, 0.5, 0.5)))
    scene = Scene(spheres=[ball], environment=WHITE, render=RenderSettings(size=(32, 32), spp=64, transparent=True))
    options: dict[str, Any] = {"device": device.info.index, "aovs": ["depth", "normal"]}
    one, other = (
        clrt.render(replace(scene, camera=each), **options)
        for each in (camera, replace(camera, distortion=(1e-7, 0.0, 0.0, 0.0)))
    )
    assert one.alpha is not None and other.alpha is not None
    np.testing.assert_allclose(other.alpha, one.alpha, atol=2e-2)
    np.testing.assert_allclose(other.alpha.mean(), one.alpha.mean(), rtol=1e-4)
    depth, same = (np.asarray(each.aovs["depth"], np.float32) for each in (one, other))
    np.testing.assert_allclose(same, depth, rtol=1e-4)


def random_scene(rng: np.random.Generator, kind: str) -> tuple[list[Instance], Scene]:
    """Return moving instances, without a scene around them, and that scene."""
    vertices, faces = rays.icosphere(1)
    wavy = (vertices * (1 + 0.2 * np.sin(4 * vertices[:, [1, 2, 0]]))).astype(np.float32)
    moving = []
    for number in range(3):
        color = tuple(rng.uniform(0.2, 0.9, 3).tolist())
        emission = tuple(rng.uniform(0.5, 3, 3).tolist()) if kind == "lights" and number else (0.0, 0.0, 0.0)
        mesh = Mesh(wavy, faces, Diffuse(color=color, emission=emission, double_sided=number == 2), vertices)
        ends = []
        for _ in range(2):
            place = translation(tuple(rng.uniform(-1, 1, 3).tolist())) @ rotation(
                tuple(rng.uniform(-60, 60, 3).tolist())
            )
            size = (0.5, 0.5, 0.5) if kind == "rigid" else tuple(rng.uniform(0.2, 0.8, 3).tolist())
            mirror = scaling((-1.0, 1.0, 1.0)) if kind == "mirrored" else np.eye(4)
            ends.append((place @ scaling(size) @ mirror)[:3])
        pivot = np.column_stack([np.eye(3), rng.uniform(-1, 1, 3)]) if number == 1 else None
        moving.append(Instance(mesh, ends[0], to_world_end=ends[1], pivot=pivot))
    floor = quad([(-4, -1.6, -4), (-4, -1.6, 4), (4, -1.6, 4), (4, -1.6, -4)], Diffuse())
    sky = Environment(color=(0.2, 0.2, 0.2) if kind == "lights" else (0.8, 0.9, 1.0))
    camera = Camera(position=(1, 1.5, 5), fov_degrees=45, shutter=(0, 1))
    settings = RenderSettings(size=(24, 16), max_depth=4)
    return moving, Scene(meshes=[floor], camera=camera, environment=sky, render=settings)


@pytest.mark.statistics
@pytest.mark.parametrize("kind", ["rigid", "stretched", "mirrored", "lights"])
def test_blur_is_the_mean_of_static_images(device: Device, kind: str) -> None:
    """Of random scenes, with global illumination and shadows: the mean of images at random times, at each of which
    the instances are ordinary meshes in float64, has the expectation of the blurred one, in each block of pixels."""
    rng, steps, spp = np.random.default_rng(11), 256, 8
    moving, around = random_scene(rng, kind)
    motion = motion_of(moving)
    values = []
    for number, s in enumerate((np.arange(steps) + rng.random(steps)) / steps):
        still = [instancing.baked(Instance(each.mesh, m)) for each, m in zip(moving, motion.at(float(s)))]
        scene = replace(around, meshes=[*around.meshes, *still], render=replace(around.render, seed=number))
        values.append(film(device, scene, spp=spp).mean)
    blurred = film(device, replace(around, instances=moving), spp=steps * spp)
    found, expected = blocks(blurred.mean), blocks(np.array(values))
    # Times are stratified, so the images' mean varies less than if they were independent.
    variance = blocks(variance_of(blurred)) + expected.var(axis=0, ddof=1) / steps
    p = mean_test(found, variance, 1, expected.mean(axis=0))
    assert (p >= sidak(1e-3, p.size)).all()


def blocks(pixels: NDArray[np.floating]) -> Doubles:
    """Return sums over blocks of 4 x 4 pixels of images (…, h, w, 3)."""
    rows = np.add.reduceat(pixels.astype(np.float64), range(0, 16, 4), -3)
    return np.asarray(np.add.reduceat(rows, range(0, 24, 4), -2))


def variance_of(found: Film) -> Doubles:
    """Return the variance of the pixels' means (h, w, 3)."""
    count = found.pixels["count"].astype(np.float64)[..., None]
    squares = (found.pixels["square"].astype(np.float64) + found.pixels["square_error"]) / count
    return np.asarray(np.maximum(squares - found.mean.astype(np.float64) ** 2, 0) / (count - 1))


LAYOUTS = ("bvh8", "bvh2", "cwbvh")
BEGUN = "element = active ? element : (ureal)(0);"
SET = {BEGUN: f"{BEGUN} scene.time = (real)(TIME_NOW);"}


def at_times(device: Device, scene: Scene, times: Sequence[float], **chosen: Any) -> Probe:
    """Return a probe whose elements have the times in turn, so that SIMD lanes differ in theirs."""
    now = "(real)(0.0f)"
    for number, s in enumerate(times):
        now = f"element % {len(times)}u == {number}u ? (real)({s!r}f) : {now}"
    return Probe(device, scene, f"#define TIME_NOW {now}", SET, **chosen)


@pytest.mark.parametrize("layout", [LAYOUTS[0], *others(*LAYOUTS[1:])])
def test_rays_hit_what_is_there_at_their_time(device: Device, layout: str) -> None:
    """No ray from inside a closed surface escapes at any time; hits are those of the static mesh, up to rounding at
    edges; and all layouts find the same."""
    rng, count = np.random.default_rng(12), 4000
    vertices, faces = rays.icosphere(2)
    start = (translation((3, -2, 1)) @ rotation((20, 0, 50)) @ scaling((1, 2, 0.5)))[:3]
    end = (translation((-1, 4, 0)) @ rotation((-80, 100, 0)) @ scaling((1.5, 1, 1)))[:3]
    moving = Instance(Mesh(vertices, faces), start, to_world_end=end)
    other = Instance(Mesh(vertices, faces), translation((0, 0, -50))[:3])
    scene = Scene(instances=[moving, other], spheres=[Sphere(center=(0, 0, 90))], camera=Camera(shutter=(0, 1)))
    times = [0.0, 0.3, 0.71875, 1.0]
    matrices = np.array([motion_of([moving]).at(s)[0] for s in times])
    points, directions = 0.5 * rng.uniform(-1, 1, (count, 4, 3)) / np.sqrt(3), rng.normal(size=(count, 4, 3))
    inside = np.einsum("sij,nsj->nsi", matrices[..., :3], points) + matrices[..., 3]
    given = inside.reshape(-1, 3), directions.reshape(-1, 3)
    found = at_times(device, scene, times, layout=layout)("closest_hit", 4, *given)
    if layout != LAYOUTS[0]:
        np.testing.assert_array_equal(
            found, at_times(device, scene, times, layout=LAYOUTS[0])("closest_hit", 4, *given)
        )
    for number, matrix in enumerate(matrices):
        hits = found[number::4]
        assert (hits[:, 3] >= 0).all() and (hits[:, 3] < len(faces)).all()
        corners = (vertices @ matrix[:, :3].T + matrix[:, 3])[faces]
        t, face, margin = rays.hit_triangles(
            corners, *(each[number::4].astype(np.float32).astype(float) for each in given)
        )
        clear = margin > 1e-3
        assert clear.mean() > 0.9 and (hits[clear, 3] == face[clear]).all()
        np.testing.assert_allclose(hits[:, 0], t, rtol=1e-4)


@pytest.mark.statistics
@pytest.mark.parametrize("kind", ["turned", "stretched"])
def test_moving_planes_do_not_shadow_themselves(device: Device, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rays that leave a moving plane never hit it again, but do if the rounding of its pose is left out."""
    monkeypatch.setattr(instancing, "FEW_TRIANGLES", 0)
    scene = lit_plane(transforms_of_kinds()[kind][0])
    plane = scene.instances[0]
    turn = translation((0.3, 0.2, -0.4)) @ axis_rotation((1, 2, 3), 25)
    start, end = ((each @ np.vstack([plane.to_world, [0, 0, 0, 1]]))[:3] for each in (np.eye(4), turn))
    moving = replace(plane, to_world=start, to_world_end=end)
    for s in (0.0, 0.4, 0.9):
        still = replace(plane, to_world=motion_of([moving]).at(s)[0])
        posed = replace(scene, instances=[still, *scene.instances[1:]], camera=replace(scene.camera, shutter=(0, 1)))
        probe = at_times(device, replace(posed, instances=[moving, *scene.instances[1:]]), [s])
        assert not np.any(met_again(probe, posed))
    monkeypatch.setattr(pack_instances, "MOTION_ROUNDINGS", 0.0)
    exact = {"LEAST * largest(absolute3(p))": "ZERO", **SET}
    probe = Probe(device, replace(posed, instances=[moving, *scene.instances[1:]]), f"#define TIME_NOW {s!r}f", exact)
    assert np.any(met_again(probe, posed))


def busy_scene() -> Scene:
    """Return a scene in which the camera and instances move, one of them a light, and one is half transparent."""
    moving, scene = random_scene(np.random.default_rng(1), "lights")
    veil = replace(moving[0].mesh, material=Diffuse(opacity=0.5))
    camera = replace(scene.camera, rolling_shutter=0.5, aperture_radius=0.05, end=CameraEnd(position=(0.5, 1.2, 5)))
    return replace(scene, instances=[replace(moving[0], mesh=veil), *moving[1:]], camera=camera)


@covering("layout, lanes, paths", LAYOUTS, [8, 1], ["lanes", "waves", "queues"])
def test_lanes_layouts_and_ways_agree(device: Device, layout: str, lanes: int, paths: str) -> None:
    """Path tracing by the megakernel and both wavefronts, with any layout, gives bit-identical images; SIMD widths
    agree to float rounding."""
    lanes = {"waves": 8, "queues": 1}.get(paths, lanes)
    wanted = film(device, busy_scene(), spp=4, lanes=8, layout="bvh8", paths="lanes").mean
    found = film(device, busy_scene(), spp=4, lanes=lanes, layout=layout, paths=paths).mean
    if lanes == 8:
        np.testing.assert_array_equal(found, wanted)
    assert (np.abs(found - wanted).max(axis=2) > 1e-5).mean() <= 0.005


def text_of(scene: Scene, device: Device) -> CompiledScene:
    return compile_scene(scene, choices(device))


def test_only_scenes_with_motion_compile_it(device: Device) -> None:
    """A shutter without motion, and motion without a shutter, change neither program nor image; a camera's motion does
    not add that of instances, nor the other way round."""
    moving, scene = random_scene(np.random.default_rng(3), "rigid")
    closed = replace(scene.camera, shutter=(0, 0))
    resting = [replace(each, to_world_end=each.to_world) for each in moving]
    plain = replace(scene, instances=[Instance(each.mesh, each.to_world) for each in moving], camera=closed)
    same = [
        replace(scene, instances=resting),
        replace(scene, instances=moving, camera=closed),
        replace(plain, camera=replace(closed, end=CameraEnd(position=(9, 9, 9)))),
        replace(plain, camera=replace(scene.camera, end=CameraEnd(position=scene.camera.position))),
    ]
    program, image = text_of(plain, device), film(device, plain, spp=4).mean
    for each in same:
        assert text_of(each, device).has_text_of(program)
        np.testing.assert_array_equal(film(device, each, spp=4).mean, image)
    files = ("camera/moving.cl", "geometry/motion.cl")
    cameras = text_of(replace(plain, camera=replace(scene.camera, end=CameraEnd(position=(1, 1, 1)))), device).files
    instances = text_of(replace(scene, instances=moving), device).files
    assert [[file in found for file in files] for found in (program.files, cameras, instances)] == [
        [False, False],
        [True, False],
        [False, True],
    ]


@pytest.mark.combinations
def test_depth_and_normals_are_those_of_the_middle(device: Device) -> None:
    """AOVs of one ray are at the middle of the exposure, of the pixel's row; means are over all times; the integrator
    `depth` and the denoiser's guides render, too."""
    moving, scene = random_scene(np.random.default_rng(4), "rigid")
    camera = replace(
        scene.camera, shutter=(0, 0.5), rolling_shutter=0.5, end=CameraEnd(position=(0, 1, 6), up=(0.2, 1, 0))
    )
    scene = replace(scene, instances=moving, camera=camera)
    names = ("depth", "position", "object", "crypto_object", "normal", "albedo")
    session_names = clrt.Renderer(scene, device=device.info.index, spp=1, aovs=",".join(names))
    seen = session_names.first_hits
    row, s = 9, 0.25 + 0.5 * 9 / 16
    motion = motion_of(moving)
    still = [instancing.baked(Instance(each.mesh, m, name=each.name)) for each, m in zip(moving, motion.at(s))]
    posed = replace(scene, meshes=[*scene.meshes, *still], instances=[], camera=camera_at(camera, s))
    wanted = clrt.Renderer(posed, device=device.info.index, spp=1, aovs=",".join(names)).first_hits
    same = seen["object"][row] == wanted["object"][row]
    assert same.mean() > 0.9
    for name in ("depth", "position"):
        np.testing.assert_allclose(seen[name][row][same], wanted[name][row][same], rtol=1e-3, atol=1e-3)
    depth = replace(scene, render=replace(scene.render, integrator="depth", spp=1))
    image = film(device, depth).mean[..., 0]
    finite = np.isfinite(seen["depth"])
    np.testing.assert_allclose(image[finite], seen["depth"][finite], rtol=1e-4)
    assert np.isfinite(seen["crypto_object"]).all()


@pytest.mark.programs
def test_renderers_follow_motion(device: Device) -> None:
    """`show` and `look` give the images of new renderers when motion begins, changes and ends."""
    moving, scene = random_scene(np.random.default_rng(5), "rigid")
    faster = [replace(each, to_world_end=each.to_world_end * 1.1) for each in moving if each.to_world_end is not None]
    still = replace(scene.camera, shutter=(0, 0))
    panned = replace(scene.camera, end=CameraEnd(look_at=(1, 0, 0)))

    def begun(shown: Scene) -> clrt.Renderer:
        return clrt.Renderer(shown, device=device.info.index, spp=2)

    def image(renderer: clrt.Renderer) -> NDArray[np.float32]:
        *_, last = renderer.passes()
        return last.pixels

    scene = replace(scene, instances=moving)
    renderer, distinct = begun(scene), set()
    for instances, camera in (
        (moving, scene.camera),
        (faster, scene.camera),
        (faster, still),
        (faster, panned),
        (moving, panned),
    ):
        shown = replace(scene, instances=instances, camera=camera)
        renderer.show(shown)
        found = image(renderer)
        np.testing.assert_array_equal(found, image(begun(shown)))
        distinct.add(found.tobytes())
    renderer.look(still)
    np.testing.assert_array_equal(image(renderer), image(begun(replace(scene, camera=still))))
    assert len(distinct) == 5


def test_what_cannot_be_rendered(device: Device) -> None:
    """Each ends in one message with its remedy."""
    moving, scene = random_scene(np.random.default_rng(6), "rigid")
    scene = replace(scene, instances=moving)
    mirrored = moving[0].to_world * [[-1], [1], [1]]
    cases: dict[str, Callable[[], object]] = {
        "Camera.shutter: .* closes before it opens": lambda: replace(scene.camera, shutter=(1, 0)),
        "Camera.end.look_at: .* own position": lambda: replace(scene.camera, end=CameraEnd(look_at=(1, 1.5, 5))),
        "does not support motion blur": lambda: replace(scene, render=replace(scene.render, integrator="raster")),
        "mirror both or neither": lambda: replace(moving[0], to_world_end=mirrored),
        "to_world_end has shape": lambda: replace(moving[0], to_world_end=np.eye(3)),
        r"pivot is \[\[1.0\], \[\]\]": lambda: replace(moving[0], pivot=[[1.0], []]),  # type: ignore[arg-type]
    }
    for message, make in cases.items():
        with pytest.raises(clrt.SceneError, match=message):
            make()
    seen = Scene(camera=replace(scene.camera, end=CameraEnd(position=(0, 0, 4))))
    with pytest.raises(clrt.UsageError, match="view 0 has motion blur"):
        clrt.render_views(seen, [seen.camera], ["flow"], size=(8, 8), device=device.info.index)
