"""Lens distortion: rays and projections as OpenCV's, by closed forms, and in rendered images."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import clrt
from clrt.device.open import Device
from clrt.errors import SceneError, UsageError
from clrt.rendering.compile.choices import Choices
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.scene.cameras import Calibrated
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Camera, Mesh, RenderSettings, Scene, Sphere

from ..covering import others
from .lens_rays import Doubles, rays
from .pictures import film

SCENES = Path(__file__).parents[2] / "scenes"
SIZE = (640, 480)
#: Pixels of each camera.
PIXELS = 16
AHEAD: dict[str, Any] = {"world_to_camera": np.eye(4)}
#: Strong barrel distortion, as of a wide-angle lens.
BARREL = (-0.28, 0.07, 0.002, -0.001, -0.008)


def matrix(rng: np.random.Generator) -> Doubles:
    fx = rng.uniform(250, 1500)
    K = [[fx, 0, 320 + rng.uniform(-60, 60)], [0, fx * rng.uniform(0.9, 1.1), 240 + rng.uniform(-60, 60)], [0, 0, 1]]
    return np.array(K)


def distortion(rng: np.random.Generator) -> Doubles:
    """Return random coefficients of a perspective lens: 4, 5 or 8."""
    limits = np.array([0.3, 0.1, 0.01, 0.01, 0.05, 0.2, 0.1, 0.05])
    return np.asarray((rng.uniform(-1, 1, 8) * limits)[: rng.choice([4, 5, 8])])


def fisheye_distortion(rng: np.random.Generator) -> Doubles:
    return np.asarray(rng.uniform(-1, 1, 4) * [0.1, 0.03, 0.01, 0.003])


def unit(vectors: Doubles) -> Doubles:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def invertible(cv2: Any, places: Doubles, K: Doubles, coefficients: Doubles) -> NDArray[np.bool_]:
    """Return where the image distance from the axis increases all the way to places (n, 2) on the plane at distance 1,
    with and without the tangential part, by a tenth of the undistorted one at least: what OpenCV finds is then on the
    near side of a fold."""
    steps = np.linspace(0, 1, 41)[:, None, None] * places
    along = np.concatenate([steps, np.ones((*steps.shape[:2], 1))], axis=2).reshape(-1, 3)
    radial = np.where(np.isin(np.arange(len(coefficients)), (2, 3)), 0, coefficients)
    increasing = np.ones(len(places), np.bool_)
    for lens in (coefficients, radial):
        seen, _ = cv2.projectPoints(along, np.zeros(3), np.zeros(3), K, lens)
        seen = (seen.reshape(*steps.shape) - K[:2, 2]) / K[[0, 1], [0, 1]]
        outward = (np.diff(seen, axis=0) * unit(places)).sum(axis=-1)
        increasing &= (outward > 0.1 * np.linalg.norm(places, axis=1) / 40).all(axis=0)
    return increasing


@pytest.mark.statistics
@pytest.mark.needs("cv2")
def test_rays_are_those_of_opencv(device: Device) -> None:
    """1e5 pixels of random cameras, wherever `undistortPoints` converges to a point that is imaged there."""
    import cv2

    rng = np.random.default_rng(11)
    undistort: Any = getattr(cv2, "undistortPointsIter", cv2.undistortPoints)
    until = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 1000, 1e-12)
    cameras, pixels = [], rng.uniform((0, 0), np.subtract(SIZE, 1), (7500, PIXELS, 2))
    expected, given = np.empty((*pixels.shape[:2], 3)), np.empty(pixels.shape[:2], bool)
    for number, own in enumerate(pixels):
        K, coefficients = matrix(rng), distortion(rng)
        cameras.append(Camera.from_matrix(K, SIZE, **AHEAD, first_pixel=0, distortion=coefficients))
        found = undistort(own[:, None], K, coefficients, R=np.eye(3), P=np.eye(3), criteria=until)[:, 0]
        points = np.column_stack([found, np.ones(PIXELS)])
        back, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), K, coefficients)
        given[number] = (np.abs(back[:, 0] - own).max(axis=1) < 1e-6) & invertible(
            cv2, np.asarray(found, np.float64), K, coefficients
        )
        expected[number] = unit(points)
    directions, has_ray = rays(device, cameras, SIZE, pixels + 0.5)
    assert given.sum() >= 1e5
    assert has_ray[given].all()
    assert np.abs(directions - expected)[given].max() < 1e-5


@pytest.mark.statistics
@pytest.mark.needs("cv2")
def test_fisheye_rays_are_those_of_opencv(device: Device) -> None:
    """1e5 pixels of random cameras, as far from the axis as `fisheye.undistortPoints` goes, below a right angle."""
    import cv2

    rng = np.random.default_rng(12)
    until = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 1000, 1e-12)
    cameras, pixels = [], rng.uniform((0, 0), np.subtract(SIZE, 1), (9000, PIXELS, 2))
    expected, given = np.empty((*pixels.shape[:2], 3)), np.empty(pixels.shape[:2], bool)
    for number, own in enumerate(pixels):
        K, coefficients = matrix(rng), fisheye_distortion(rng)
        camera = Camera.from_matrix(K, SIZE, **AHEAD, first_pixel=0, projection="fisheye", distortion=coefficients)
        cameras.append(camera)
        found = cv2.fisheye.undistortPoints(own[:, None], K, coefficients, criteria=until)[:, 0]
        back = cv2.fisheye.distortPoints(found[:, None], K, coefficients)[:, 0]
        theta = np.arctan(np.linalg.norm(found, axis=1))
        slope = np.polynomial.polynomial.polyval(theta**2, [1, *coefficients * [3, 5, 7, 9]])
        given[number] = (np.abs(back - own).max(axis=1) < 1e-6) & (slope > 0.1) & (theta < 1.5)
        expected[number] = unit(np.column_stack([found, np.ones(PIXELS)]))
    directions, has_ray = rays(device, cameras, SIZE, pixels + 0.5)
    assert given.sum() >= 1e5
    assert has_ray[given].all()
    assert np.abs(directions - expected)[given].max() < 1e-5


@pytest.mark.parametrize("degrees", [120.0, 180.0, 220.0, 400.0])
def test_a_fisheye_is_equidistant(device: Device, degrees: float) -> None:
    """The distance from the center is proportional to the angle, up to 180 degrees from the axis."""
    rng = np.random.default_rng(13)
    pixels = rng.uniform((0, 0), SIZE, (1, 4096, 2))
    camera = Camera(position=(0, 0, 0), look_at=(0, 0, -1), projection="fisheye", fisheye_degrees=degrees)
    directions, has_ray = rays(device, [camera], SIZE, pixels)
    across = (pixels[0] - np.array(SIZE) / 2) / SIZE[1]
    angle = np.radians(degrees) * np.linalg.norm(across, axis=1)
    x, y = np.moveaxis(unit(across) * np.sin(angle)[:, None], 1, 0)
    np.testing.assert_array_equal(has_ray[0], angle <= np.pi)
    expected = np.stack([x, -y, -np.cos(angle)], axis=1)
    np.testing.assert_allclose(directions[0][has_ray[0]], expected[has_ray[0]], atol=1e-6)


@pytest.mark.parametrize("count", [1000, *others(4000)])
def test_wide_fisheyes_image_their_rays_at_the_pixels(device: Device, count: int) -> None:
    """Rays beyond a right angle, too: θ (1 + k1 θ² + …) is the distance on the plane, and its slope positive."""
    rng = np.random.default_rng(14)
    cameras = [
        replace(
            Camera(position=(0, 0, 0), look_at=(0, 0, 1), up=(0, -1, 0), projection="fisheye"),
            fisheye_degrees=rng.uniform(90, 300),
            distortion=tuple(fisheye_distortion(rng)),
        )
        for _ in range(count)
    ]
    pixels = rng.uniform((0, 0), SIZE, (count, 64_000 // count, 2))
    directions, has_ray = rays(device, cameras, SIZE, pixels)
    angle = np.arctan2(np.linalg.norm(directions[..., :2], axis=2), directions[..., 2])
    k = np.array([camera.distortion for camera in cameras])[:, None]
    powers = angle[..., None] ** (2 * np.arange(1, 5))
    imaged, slope = (angle * (1 + (k * powers).sum(axis=2)), 1 + (k * [3, 5, 7, 9] * powers).sum(axis=2))
    focal = SIZE[1] / np.radians([camera.fisheye_degrees for camera in cameras])
    wanted = (pixels - np.array(SIZE) / 2) / focal[:, None, None]
    found = unit(directions[..., :2]) * imaged[..., None]
    steep = has_ray & (slope > 0.1)
    assert 0.6 < steep.mean() < 0.99 and (angle[steep] > np.pi / 2).mean() > 0.1
    assert np.abs(found - wanted)[steep].max() < 1e-5
    assert (slope[has_ray] > -0.01).all()
    # Where there is none, the lens images nothing.
    farthest = np.array([camera.lens.radial(np.linspace(0, camera.lens.fold, 1000)).max() for camera in cameras])
    missing = np.linalg.norm(wanted, axis=2) / farthest[:, None]
    assert (missing[~has_ray] > 1 - 1e-5).all() and (missing[has_ray] < 1 + 1e-4).all()


def test_no_rays_beyond_the_fold(device: Device) -> None:
    """With k1 < 0 alone, r (1 + k1 r²) is largest at r² = −1/(3 k1), where it is 2/3 of r."""
    k1 = -0.3
    farthest = 2 / 3 / np.sqrt(-3 * k1)
    camera = Camera.from_matrix(
        np.array([[300, 0, 320], [0, 300, 240], [0, 0, 1]]), SIZE, **AHEAD, distortion=[k1, 0, 0, 0]
    )
    assert camera.lens.fold == pytest.approx(1 / np.sqrt(-3 * k1))
    pixels = np.random.default_rng(15).uniform((0, 0), SIZE, (1, 4096, 2))
    directions, has_ray = rays(device, [camera], SIZE, pixels)
    distance = np.linalg.norm((pixels[0] - [320, 240]) / 300, axis=1)
    assert 0.4 < has_ray.mean() < 0.5
    clear = np.abs(distance - farthest) > 1e-4
    np.testing.assert_array_equal(has_ray[0][clear], (distance < farthest)[clear])
    assert np.isfinite(directions).all()


@pytest.mark.parametrize("projection", ["perspective", "fisheye"])
def test_rays_do_not_depend_on_the_lanes(device: Device, projection: Calibrated) -> None:
    rng = np.random.default_rng(16)
    draw = fisheye_distortion if projection == "fisheye" else distortion
    cameras = [
        Camera.from_matrix(matrix(rng), SIZE, **AHEAD, projection=projection, distortion=draw(rng)) for _ in range(200)
    ]
    pixels = rng.uniform((0, 0), SIZE, (200, PIXELS, 2))
    one, eight = (rays(device, cameras, SIZE, pixels, lanes=lanes) for lanes in (1, 8))
    np.testing.assert_array_equal(one[1], eight[1])
    np.testing.assert_allclose(one[0], eight[0], atol=3e-6)


@pytest.mark.needs("cv2")
def test_points_are_projected_as_by_opencv() -> None:
    import cv2

    rng = np.random.default_rng(17)
    for number in range(500):
        K, turn, shift = matrix(rng), rng.normal(size=3), rng.normal(size=3)
        points = rng.normal(size=(100, 3))
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = cv2.Rodrigues(turn)[0], shift
        seen = points @ pose[:3, :3].T + shift
        ahead = seen[:, 2] > 0.05
        given: dict[str, Any] = {"world_to_camera": pose, "first_pixel": 0}
        if number % 2:
            coefficients, skew = fisheye_distortion(rng), rng.uniform(-0.1, 0.1)
            expected = cv2.fisheye.projectPoints(points[:, None], turn, shift, K, coefficients, alpha=skew)[0][:, 0]
            K[0, 1] = skew * K[0, 0]
            camera = Camera.from_matrix(K, SIZE, **given, projection="fisheye", distortion=coefficients)
            radius = np.arctan2(np.linalg.norm(seen[:, :2], axis=1), seen[:, 2])
        else:
            coefficients = distortion(rng)
            expected = cv2.projectPoints(points, turn, shift, K, coefficients)[0][:, 0]
            camera = Camera.from_matrix(K, SIZE, **given, distortion=coefficients)
            with np.errstate(divide="ignore"):
                radius = np.linalg.norm(seen[:, :2], axis=1) / seen[:, 2]
            assert np.isnan(camera.project(points, SIZE)[seen[:, 2] <= 0]).all()
        imaged = ahead & (radius < camera.lens.fold)
        found = camera.project(points, SIZE, first_pixel=0)
        np.testing.assert_allclose(found[imaged], expected[imaged], rtol=1e-9, atol=1e-7)
        assert np.isnan(found[ahead & ~imaged]).all()


def board(squares: int, z: float = 0.0) -> tuple[list[Mesh], Doubles]:
    """Return a checkerboard of unit squares around the z axis, facing +z, and its inner corners (n, 3)."""
    meshes, half = [], squares / 2
    for i in range(squares):
        for j in range(squares):
            x, y = i - half, j - half
            corners = np.array([[x, y, z], [x + 1, y, z], [x + 1, y + 1, z], [x, y + 1, z]], np.float32)
            white = Diffuse(emission=(1.0, 1.0, 1.0) if (i + j) % 2 else (0.05, 0.05, 0.05))
            meshes.append(Mesh(vertices=corners, faces=np.array([[0, 1, 2], [0, 2, 3]], np.int32), material=white))
    inner = np.arange(1, squares) - half
    x, y = np.meshgrid(inner, inner)
    return meshes, np.stack([x.ravel(), y.ravel(), np.full(x.size, z)], axis=1)


LENSES: dict[str, dict[str, Any]] = {
    "barrel": {"distortion": BARREL},
    "pincushion": {"distortion": (0.25, 0.1, -0.004, 0.003)},
    "rational": {"distortion": (0.9, 0.4, 0.001, -0.002, 0.03, 1.3, 0.6, 0.1)},
    "fisheye": {"projection": "fisheye", "distortion": (0.05, -0.02, 0.004, -0.001)},
}


def photograph(device: Device, lens: dict[str, Any], spp: int = 64) -> tuple[Camera, Doubles, Doubles]:
    """Return a camera before a checkerboard, the image (h, w), and the board's inner corners."""
    meshes, corners = board(10)
    eye = (0.4, -0.3, 4.0)
    K = np.array([[300.0, 0, 316], [0, 310, 246], [0, 0, 1]])
    pose = Camera(position=eye, look_at=(0.1, 0.2, 0.0)).world_to_camera
    camera = Camera.from_matrix(K, SIZE, world_to_camera=pose, **lens)
    scene = Scene(
        meshes=meshes, camera=camera, render=RenderSettings(size=SIZE, spp=spp, max_depth=1, filter="gaussian")
    )
    return camera, film(device, scene, spp, sampler="sobol").mean[..., 0], corners


@pytest.mark.needs("cv2")
@pytest.mark.parametrize("name", ["barrel", *others("pincushion", "rational", "fisheye")])
def test_a_rendered_checkerboard_has_its_corners_where_opencv_projects_them(device: Device, name: str) -> None:
    """Corners refined in the image (saddle points) lie within a tenth of a pixel of `projectPoints`."""
    import cv2

    camera, image, corners = photograph(device, LENSES[name])
    pose, K = camera.world_to_camera, camera.matrix(SIZE, 0.0)
    seen = corners @ pose[:3, :3].T + pose[:3, 3]
    coefficients, still = np.array(camera.distortion), np.zeros(3)
    if camera.projection == "fisheye":
        places = cv2.fisheye.projectPoints(seen[:, None], still, still, K, coefficients)[0][:, 0]
    else:
        places = cv2.projectPoints(seen, still, still, K, coefficients)[0][:, 0]
    places = places[((places > 12) & (places < np.array(SIZE) - 12)).all(axis=1)]
    assert len(places) >= 30
    until = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-4)
    start = np.ascontiguousarray(np.round(places)[:, None], np.float32)
    found = cv2.cornerSubPix((255 * image).astype(np.uint8), start, (5, 5), (-1, -1), until)[:, 0]
    assert np.abs(found - places).max() < 0.1


@pytest.mark.parametrize("name", ["rational", "fisheye", *others("barrel", "pincushion")])
def test_positions_project_to_their_pixels(device: Device, name: str) -> None:
    """What a pixel's center shows projects to it; depth is along the axis, or the distance for a fisheye."""
    scene = clrt.load(SCENES / "spot.toml")
    size = (80, 60)
    K = np.array([[60.0, 0, 41], [0, 62, 28], [0, 0, 1]])
    camera = Camera.from_matrix(K, size, world_to_camera=scene.camera.world_to_camera, **LENSES[name])
    layers = clrt.render_views(scene, [camera], ["position", "depth", "object"], size=size, device=device.info.index)
    hit = layers["object"][0, ..., 0] >= 0
    assert hit.mean() > 0.2
    places = camera.project(layers["position"][0], size)
    y, x = np.mgrid[: size[1], : size[0]] + 0.5
    np.testing.assert_allclose(places[hit], np.stack([x, y], axis=-1)[hit], atol=2e-3)
    seen = layers["position"][0].astype(np.float64) - camera.position
    axis = np.subtract(camera.look_at, camera.position)
    depth = np.linalg.norm(seen, axis=-1) if camera.projection == "fisheye" else seen @ axis
    np.testing.assert_allclose(layers["depth"][0, ..., 0][hit], depth[hit], rtol=1e-5)


def test_a_lens_distorts_first(device: Device) -> None:
    """Spheres in the plane of focus of a thin lens with distortion are sharp, where its pinhole has them."""
    size = (64, 48)
    K = np.array([[50.0, 0, 30], [0, 52, 25], [0, 0, 1]])
    camera = Camera.from_matrix(K, size, **AHEAD, distortion=BARREL, aperture_radius=0.3, focus_distance=9.0)
    spots = np.array([[-4.0, -3, 9], [4, 3, 9], [0.5, 2, 9], [-3, 1, 9]])
    pixels = np.floor(camera.project(spots, size)) + 0.5
    plane = (pixels - K[:2, 2]) / K[[0, 1], [0, 1]]
    for _ in range(20):  # to the centers of the pixels
        places = (camera.project(spots, size) - K[:2, 2]) / K[[0, 1], [0, 1]]
        spots[:, :2] += 9 * (plane - places)
    spheres = [
        Sphere(center=tuple(spot), radius=0.02, material=Diffuse(emission=(1.0, i, 0.0)))
        for i, spot in enumerate(spots.tolist(), start=1)
    ]
    scene = Scene(spheres=spheres, camera=camera, render=RenderSettings(size=size, spp=256, max_depth=1))
    picture = film(device, scene, 256).mean
    expected = {(int(y), int(x)) for x, y in pixels}
    assert set(map(tuple, np.argwhere(picture[..., 0]).tolist())) == expected and len(expected) == 4


@pytest.mark.programs
def test_flow_between_distorted_cameras(device: Device) -> None:
    """Flow from a distorted to a fisheye camera, both seeing one plane, is that of the corners' projections."""
    size = (64, 48)
    first = Camera(position=(0.3, 0.2, 4.0), look_at=(0, 0, 0), distortion=BARREL)
    second = Camera(position=(-0.2, 0.1, 3.0), look_at=(0.1, 0, 0), projection="fisheye", fisheye_degrees=90)
    meshes, _ = board(12)
    views = clrt.render_views(
        Scene(meshes=meshes), [first, second], ["flow", "position"], size=size, device=device.info.index
    )
    y, x = np.mgrid[: size[1], : size[0]] + 0.5
    expected = second.project(views["position"][0], size) - np.stack([x, y], axis=-1)
    np.testing.assert_allclose(views["flow"][0], expected, atol=1e-4)
    assert np.isfinite(views["flow"][0]).all() and np.abs(views["flow"][0]).max() > 2


@pytest.mark.combinations
def test_lenses_change_from_view_to_view(device: Device) -> None:
    """Each view is that of a render of its own; between lenses of one kind the program is kept."""
    scene = clrt.load(SCENES / "cornell.toml")
    plain = scene.camera
    cameras = [
        plain,
        replace(plain, distortion=BARREL),
        replace(plain, distortion=(0.2, 0.0, 0.0, 0.0)),
        replace(plain, projection="fisheye", fisheye_degrees=80.0),
        plain,
    ]
    options: dict[str, Any] = {"size": (24, 18), "spp": 2, "device": device.info.index}
    views = clrt.render_views(scene, cameras, ["rgb", "depth"], **options)
    for camera, rgb, depth in zip(cameras, views["rgb"], views["depth"]):
        image = clrt.render(replace(scene, camera=camera), aovs=["depth"], **options)
        np.testing.assert_array_equal(rgb, image.pixels)
        np.testing.assert_array_equal(depth[..., 0], image.aovs["depth"])
    compiled = compile_scene(replace(scene, camera=cameras[1]), Choices())
    kept = compiled.seen_by(cameras[2], "camera/distorted_pinhole.cl")
    assert kept.has_text_of(compiled)
    back = kept.seen_by(plain, "camera/pinhole.cl")
    assert back.source == compile_scene(scene, Choices()).source


def test_only_lenses_with_distortion_compile_it() -> None:
    for camera in (Camera(), Camera(distortion=(0.0,) * 5), Camera(aperture_radius=0.1)):
        compiled = compile_scene(Scene(spheres=[Sphere()], camera=camera), Choices())
        assert "radial" not in compiled.source and "numerator" not in compiled.source
    compiled = compile_scene(Scene(spheres=[Sphere()], camera=Camera(distortion=BARREL)), Choices())
    assert "camera/radial_lens.cl" in compiled.files


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"distortion": (0.1, 0.2)}, r"Camera\.distortion: \[0\.1, 0\.2\] has 2 entries; write 4 or 5 or 8"),
        ({"projection": "fisheye", "distortion": BARREL}, r'has 5 entries; write 4 with projection = "fisheye"'),
        ({"projection": "orthographic", "distortion": BARREL}, "distortion: .* has no effect"),
        ({"fisheye_degrees": 120.0}, "fisheye_degrees: 120.0 has no effect"),
        ({"projection": "fisheye", "aperture_radius": 0.1}, "aperture_radius: 0.1 has no effect"),
        ({"projection": "fisheye", "fisheye_degrees": 0.0}, "fisheye_degrees: 0.0 is not above 0"),
        ({"distortion": (0.1, 0.2, 0.0, float("nan"))}, r"distortion\[3\]: nan is not a finite number"),
    ],
)
def test_wrong_lenses(given: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        Camera(**given)


def test_what_lenses_lack_is_named() -> None:
    raster = RenderSettings(integrator="raster")
    with pytest.raises(SceneError, match="supports only pinhole cameras, and the camera has distortion = "):
        compile_scene(Scene(spheres=[Sphere()], camera=Camera(distortion=BARREL), render=raster), Choices())
    with pytest.raises(UsageError, match="distortion has 3 coefficients; it must have 4 or 5 or 8"):
        Camera.from_matrix(np.eye(3), SIZE, **AHEAD, distortion=[1, 2, 3])
    with pytest.raises(UsageError, match="has no matrix"):
        Camera(projection="orthographic").project((0, 0, 0), SIZE)


def test_fisheye_matrices_come_back() -> None:
    rng = np.random.default_rng(18)
    for _ in range(100):
        K = matrix(rng)
        camera = Camera.from_matrix(K, SIZE, **AHEAD, projection="fisheye", distortion=fisheye_distortion(rng))
        np.testing.assert_allclose(camera.matrix(SIZE), K, atol=1e-9)


def test_lenses_are_saved(tmp_path: Path) -> None:
    for lens in LENSES.values():
        scene = replace(clrt.load(SCENES / "cornell.toml"), camera=Camera(**lens))
        clrt.save_scene(scene, tmp_path / "lens.toml")
        assert clrt.load(tmp_path / "lens.toml").camera == scene.camera
