"""Baked light: closed forms, the lit scene from its baked textures, seams, normals, parts, errors."""

from __future__ import annotations

import logging
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray
from PIL import Image as Pillow

import clrt
from clrt.baking import bake
from clrt.baking.texel_points import PLACES
from clrt.device.open import Device
from clrt.errors import SceneError, UsageError
from clrt.rendering.compile import compile_scene
from clrt.rendering.compile.pack_scene import pack_scene
from clrt.scene.model import Scene

from ..rendering.test_sensors import BLACK, lambert

Doubles = NDArray[np.float64]
SCENES = Path(__file__).parents[2] / "scenes"
SQUARE = np.array([(0, 0), (0, 1), (1, 1), (1, 0)], np.float32)


def sheet(low: float = -1, high: float = 1, uv: NDArray[np.float32] = SQUARE) -> clrt.Mesh:
    """Return a square that faces up; u runs along x, v along z."""
    vertices = np.array([(low, 0, low), (low, 0, high), (high, 0, high), (high, 0, low)], np.float32)
    return clrt.Mesh(vertices=vertices, faces=np.array([[0, 1, 2], [0, 2, 3]], np.int32), uv=uv, name="sheet")


def places_in(size: int, low: float = -1, high: float = 1) -> Doubles:
    """Return the points (size, size, 4, 3) of a sheet at which its texels are measured."""
    x, z = np.meshgrid(np.arange(size), np.arange(size))
    at = np.stack([x, z], axis=-1)[:, :, None] + PLACES
    flat = low + (high - low) * at / size
    return np.stack([flat[..., 0], np.zeros_like(flat[..., 0]), flat[..., 1]], axis=-1)


def panel(height: float = 1.5) -> clrt.Mesh:
    """Return an area light above the sheet."""
    corners = np.array([(-0.5, height, -0.3), (0.7, height, -0.3), (0.7, height, 0.4), (-0.5, height, 0.4)], np.float32)
    light = clrt.Diffuse(color=(0, 0, 0), emission=(2, 1, 0.5))
    return clrt.Mesh(vertices=corners, faces=np.array([[0, 1, 2], [0, 2, 3]], np.int32), material=light, name="panel")


def of_panel(places: Doubles) -> Doubles:
    """Return the irradiance (…) at places of a sheet under a panel of unit radiance."""
    points = places.reshape(-1, 3)
    corners = panel().vertices.astype(np.float64)
    return lambert(points, np.broadcast_to((0.0, 1.0, 0.0), points.shape), corners).reshape(places.shape[:-1])


@pytest.mark.programs
def test_irradiance_under_a_panel_is_lamberts(device: Device) -> None:
    scene = clrt.Scene(meshes=[sheet(), panel()], environment=BLACK)
    baked = clrt.bake(scene, "sheet", size=24, spp=256, device=device.info.index)
    expected = of_panel(places_in(24)).mean(axis=2)[..., None] * (2, 1, 0.5)
    z = (baked.pixels - expected) / baked.standard_error
    assert baked.covered.all() and 0.8 < np.sqrt((z**2).mean()) < 1.25 and np.abs(z).max() < 8
    assert baked.pixels.mean() == pytest.approx(expected.mean(), rel=3e-3)


def test_standard_errors_are_those_of_repetitions(device: Device) -> None:
    """Also where the light differs within a texel, which is no error."""
    scene = clrt.Scene(meshes=[sheet(), panel()], environment=BLACK)
    runs = [clrt.bake(scene, "sheet", size=4, spp=64, seed=7 * seed, device=device.info.index) for seed in range(40)]
    spread = np.std([run.pixels for run in runs], axis=0, ddof=1)
    claimed = np.sqrt(np.mean([run.standard_error.astype(np.float64) ** 2 for run in runs], axis=0))
    assert np.sqrt(np.mean(claimed**2 / spread**2)) == pytest.approx(1, abs=0.2)


@pytest.mark.programs
def test_direct_and_indirect_light_sum_to_all(device: Device) -> None:
    scene = clrt.load(SCENES / "cornell.toml")
    floor = next(mesh for mesh in scene.meshes if mesh.name == "floor")
    floor.uv = SQUARE
    options: dict[str, Any] = {"size": 16, "spp": 32, "device": device.info.index}
    every, direct, indirect = (
        clrt.bake(scene, floor, what, **options) for what in ("irradiance", "direct", "indirect")
    )
    np.testing.assert_allclose(direct.pixels + indirect.pixels, every.pixels, rtol=1e-5, atol=1e-6)
    assert direct.pixels.mean() > indirect.pixels.mean() > 0.1 * direct.pixels.mean()
    short = clrt.bake(scene, floor, max_depth=2, **options)
    np.testing.assert_allclose(direct.pixels, short.pixels, rtol=1e-5, atol=1e-6)
    assert not clrt.bake(scene, floor, "indirect", max_depth=2, **options).pixels.any()


def test_occlusion_by_closed_forms(device: Device) -> None:
    """Next to a wall, far along it and high; an open plane; inside a sphere."""
    wall = clrt.Mesh(
        vertices=np.array([(1, 0, -1e3), (1, 0, 1e3), (1, 3, 1e3), (1, 3, -1e3)], np.float32),
        faces=np.array([[0, 1, 2], [0, 2, 3]], np.int32),
    )
    scene = clrt.Scene(meshes=[sheet(), wall], environment=BLACK)
    baked = clrt.bake(scene, "sheet", "occlusion", size=16, spp=1024, device=device.info.index)
    away = 1 - places_in(16)[..., 0]
    expected = 1 - (1 - away / np.hypot(away, 3)) / 2
    z = (baked.pixels - expected.mean(axis=2)[..., None])[..., 0] / baked.standard_error[..., 0]
    assert np.sqrt((z**2).mean()) < 1.25 and np.abs(z).max() < 8
    alone = clrt.Scene(meshes=[sheet()], environment=BLACK)
    assert (clrt.bake(alone, "sheet", "occlusion", size=8, spp=64, device=device.info.index).pixels == 1).all()
    shell = trimesh.creation.icosphere(3, 5.0)
    closed = replace(alone, meshes=[sheet(), clrt.Mesh(vertices=shell.vertices, faces=shell.faces)])
    options: dict[str, Any] = {"size": 8, "spp": 64, "device": device.info.index}
    assert not clrt.bake(closed, "sheet", "occlusion", **options).pixels.any()
    assert (clrt.bake(closed, "sheet", "occlusion", distance=3.0, **options).pixels == 1).all()


def as_atlas(mesh: clrt.Mesh, size: int, gap: int = 4) -> clrt.Mesh:
    """Return a mesh of quads, of two faces each, whose quads fill cells of an atlas with a gap of texels."""
    quads = [np.unique(pair) for pair in mesh.faces.reshape(-1, 6)]
    across = int(np.ceil(np.sqrt(len(quads))))
    vertices, faces, uv = [], [], []
    for number, pair in enumerate(mesh.faces.reshape(-1, 2, 3)):
        loop = [*pair[0], pair[1][2]]  # 0 1 2 and 0 2 3
        cell = np.array([number % across, number // across]) / across
        low, high = cell + gap / size, cell + 1 / across - gap / size
        vertices += [mesh.vertices[each] for each in loop]
        faces += [(4 * number, 4 * number + 1, 4 * number + 2), (4 * number, 4 * number + 2, 4 * number + 3)]
        uv += [low, (low[0], high[1]), high, (high[0], low[1])]
    return replace(mesh, vertices=np.array(vertices), faces=np.array(faces, np.int32), uv=np.array(uv, np.float32))


def emissive(mesh: clrt.Mesh, baked: clrt.LightMap) -> clrt.Mesh:
    """Return a black mesh that emits what its Lambertian surface reflects of its baked irradiance."""
    radiance = np.array(vars(mesh.material)["color"]) / np.pi * baked.pixels
    most = radiance.max(axis=(0, 1))
    share = radiance / most
    encoded = np.where(share <= 0.0031308, 12.92 * share, 1.055 * share ** (1 / 2.4) - 0.055)
    texels = np.dstack([np.rint(255 * encoded), np.full(share.shape[:2], 255)]).astype(np.uint8)
    emission = clrt.Texture(picture=clrt.Picture(texels), factor=tuple(most.tolist()), wrap=("clamp", "clamp"))
    return replace(mesh, material=clrt.Diffuse(color=(0, 0, 0), emission=emission))


@pytest.mark.statistics
def test_a_lit_scene_from_its_baked_textures(device: Device) -> None:
    """The Cornell box with black surfaces that emit albedo · E / π looks as it does in its own light."""
    scene, size = clrt.load(SCENES / "cornell.toml"), 128
    scene.meshes = [mesh if mesh.name == "lamp" else as_atlas(mesh, size) for mesh in scene.meshes]
    lit = clrt.render(scene, spp=1024, size=(64, 64), device=device.info.index).pixels
    lamp, *others = scene.meshes
    texels = [clrt.bake(scene, mesh, size=size, spp=256, device=device.info.index) for mesh in others]
    copy = replace(scene, meshes=[lamp, *map(emissive, others, texels)])
    seen = clrt.render(copy, spp=256, size=(64, 64), max_depth=1, device=device.info.index).pixels
    assert seen.mean() == pytest.approx(lit.mean(), rel=0.01)
    dark = lit.max(axis=2) < 2  # all but the lamp
    blocks = [image.reshape(8, 8, 8, 8, 3) * dark.reshape(8, 8, 8, 8, 1) for image in (seen, lit)]
    ours, theirs = (each.mean(axis=(1, 3)) for each in blocks)
    print("largest and mean difference of blocks", np.abs(ours - theirs).max(), np.abs(ours / theirs - 1).mean())
    assert np.abs(ours - theirs).mean() < 0.01 * theirs.mean()


def test_smooth_normals_and_the_surface_itself(device: Device) -> None:
    """In parallel light the irradiance is the cosine with the interpolated normal, and 0 below the surface."""
    bent = np.tile(np.array([0.8, 0.6, 0], np.float32), (4, 1))
    mesh = sheet()
    mesh.normals = np.array([(-0.6, 0.8, 0), (-0.6, 0.8, 0), (0.6, 0.8, 0), (0.6, 0.8, 0)], np.float32)
    towards = np.array([0.6, 0.8, 0])
    sun = clrt.DirectionalLight(direction=tuple(-towards), irradiance=(2, 2, 2))
    scene = clrt.Scene(meshes=[mesh], lights=[sun], environment=BLACK)
    baked = clrt.bake(scene, mesh, size=16, spp=16, device=device.info.index)
    x = places_in(16)[..., 0]
    normals = np.stack([0.6 * x, np.full_like(x, 0.8), np.zeros_like(x)], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1)[..., None]
    np.testing.assert_allclose(baked.pixels[..., 0], 2 * (normals @ towards).mean(axis=2), rtol=2e-3)
    mesh.normals = -mesh.normals  # the winding says where the front is
    again = clrt.bake(scene, mesh, size=16, spp=16, device=device.info.index)
    assert np.array_equal(again.pixels, baked.pixels)
    below = clrt.DirectionalLight(direction=(-0.995, 0.0998749, 0), irradiance=(2, 2, 2))  # from below the sheet
    tilted = replace(mesh, normals=bent)
    dark = replace(scene, meshes=[tilted], lights=[below])
    assert bent[0] @ np.array([0.995, -0.0998749, 0]) > 0.7
    assert not clrt.bake(dark, tilted, size=4, spp=16, device=device.info.index).pixels.any()
    sky = clrt.Scene(meshes=[tilted], environment=clrt.Environment(color=(1, 1, 1)))
    seen = clrt.bake(sky, tilted, size=4, spp=1 << 12, device=device.info.index)
    lost = (1 - 0.6) / 2  # of the hemisphere around a normal at an angle of cosine .6
    assert seen.pixels.mean() == pytest.approx(np.pi * (1 - lost), rel=2e-3)


def test_both_sides_of_a_seam_are_alike(device: Device) -> None:
    """A sheet in two charts, one of them turned: along the cut, the charts' edges have the same light."""
    vertices = np.array([(-1, 0, -1), (-1, 0, 1), (0, 0, 1), (0, 0, -1), (0, 0, -1), (0, 0, 1), (1, 0, 1), (1, 0, -1)])
    left = np.array([(1, 1), (1, 19), (9, 19), (9, 1)]) / 32
    right = np.array([(12, 30), (30, 30), (30, 22), (12, 22)]) / 32  # z runs along u, x up
    mesh = clrt.Mesh(
        vertices=vertices,
        faces=np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]], np.int32),
        uv=np.concatenate([left, right]).astype(np.float32),
    )
    scene = clrt.Scene(meshes=[mesh, panel()], environment=BLACK)
    baked = clrt.bake(scene, mesh, size=32, spp=4096, padding=2, device=device.info.index)
    one, other = baked.pixels[1:19, 8], baked.pixels[29, 12:30]
    gradient = np.abs(baked.pixels[1:19, 8] - baked.pixels[1:19, 7])
    assert (np.abs(one - other) <= gradient + 6 * baked.standard_error[1:19, 8]).all()
    assert np.array_equal(baked.pixels[1:19, 9], one) and np.array_equal(baked.pixels[30, 12:30], other)
    assert not baked.covered[1:19, 9].any() and baked.covered[1:19, 8].all()


def test_texels_that_are_covered_partly(device: Device) -> None:
    """They have the light of the chart's nearest point, here of its edge."""
    edge = 5.2 / 16
    mesh = sheet(uv=SQUARE * np.float32(edge))
    scene = clrt.Scene(meshes=[mesh, panel()], environment=BLACK)
    baked = clrt.bake(scene, mesh, size=16, spp=1 << 14, padding=1, device=device.info.index)
    assert baked.covered[:6, :6].all() and baked.covered.sum() == 36
    expected = (
        of_panel(np.array([(min(5 + x, 5.2), 0, 2 + z) for x, z in PLACES]) / (2.6, 1, 2.6) - (1, 0, 1)).mean() * 2
    )
    at_edge = baked.pixels[2, 5, 0]
    assert at_edge == pytest.approx(expected, abs=5 * baked.standard_error[2, 5, 0] + 0.005 * expected)
    assert np.array_equal(baked.pixels[:6, 6], baked.pixels[:6, 5])


@pytest.mark.parametrize("mirrored", [False, True])
def test_instances(device: Device, mirrored: bool) -> None:
    """Turned upside down, moved, stretched and mirrored, a sheet's front receives the light from where it faces."""
    flip = np.diag([-2.0 if mirrored else 2.0, -3.0, -1.0])
    placed = clrt.Instance(mesh=sheet(), to_world=np.column_stack([flip, [5, 1, 2]]), name="placed")
    up, down = (clrt.DirectionalLight(direction=(0, y, 0), irradiance=(abs(y),) * 3) for y in (3.0, -1.0))
    scene = clrt.Scene(instances=[placed, replace(placed, name="other")], lights=[up, down], environment=BLACK)
    scene.instances[1].to_world = np.column_stack([np.eye(3), [5, 20, 2]])
    for name, light in (("placed", 3.0), ("other", 1.0)):
        baked = clrt.bake(scene, name, size=4, spp=16, device=device.info.index)
        np.testing.assert_allclose(baked.pixels, light, rtol=1e-5)


def test_parts_share_scene_and_program(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts have random numbers of their own, and only the first one packs the scene."""
    scene = clrt.Scene(meshes=[sheet(), panel()], environment=BLACK)
    options: dict[str, Any] = {"size": 20, "spp": 64, "device": device.info.index}
    whole = clrt.bake(scene, "sheet", **options)
    packed: list[Scene] = []

    def packing(scene: Scene, *given: Any) -> object:
        packed.append(scene)
        return pack_scene(scene, *given)

    monkeypatch.setattr(compile_scene, "pack_scene", packing)
    monkeypatch.setattr(bake, "PART", 70)
    parts = clrt.bake(scene, "sheet", **options)
    assert len(packed) == 1
    z = (parts.pixels - whole.pixels) / np.hypot(parts.standard_error, whole.standard_error)
    assert 0.5 < np.sqrt((z**2).mean()) < 1.3 and np.abs(z).max() < 8
    even = clrt.Scene(meshes=[sheet()], environment=clrt.Environment(color=(1, 1, 1)))
    shell = trimesh.creation.icosphere(1, 3.0)
    holed = clrt.Mesh(vertices=shell.vertices, faces=shell.faces[::2])
    alike = clrt.bake(replace(even, meshes=[sheet(-1e-3, 1e-3), holed]), "sheet", **options).pixels[..., 0].ravel()
    assert abs(np.corrcoef(alike[:67], alike[67:134])[0, 1]) < 0.6  # 1 with the same random numbers
    assert alike.std() > 0


def test_noise_ends_a_bake(device: Device) -> None:
    scene = clrt.Scene(meshes=[sheet(), panel()], environment=BLACK)
    baked = clrt.bake(scene, "sheet", size=8, noise=0.02, device=device.info.index)
    assert 0.005 < baked.report["noise"] <= 0.02 and 16 <= baked.report["spp"] < 4096
    limited = clrt.bake(scene, "sheet", size=8, noise=1e-4, spp=32, device=device.info.index)
    assert limited.report["spp"] == 32
    assert limited.report["standard_error"] == pytest.approx(limited.standard_error.mean(), rel=1e-5)


def test_faces_that_overlap_are_a_warning(device: Device, caplog: pytest.LogCaptureFixture) -> None:
    mesh = sheet()
    mesh.faces = np.concatenate([mesh.faces, mesh.faces])
    mesh.uv1 = SQUARE
    with caplog.at_level(logging.WARNING):
        clrt.bake(clrt.Scene(meshes=[mesh]), mesh, "occlusion", size=8, spp=16, device=device.info.index)
    (message,) = [record.getMessage() for record in caplog.records]
    assert '"sheet" of scene: faces overlap' in message and "56 of the 64 texels" in message
    assert "Lightmap Pack, or bake into its other set with --uv-set 1" in message


def test_faces_without_area_in_the_image_are_a_warning(device: Device, caplog: pytest.LogCaptureFixture) -> None:
    """As of files whose texture coordinates are all 0."""
    mesh = sheet(uv=np.zeros((4, 2), np.float32))
    scene = clrt.Scene(meshes=[mesh], environment=clrt.Environment(color=(1, 1, 1)))
    with caplog.at_level(logging.WARNING):
        baked = clrt.bake(scene, mesh, size=8, spp=16, padding=0, device=device.info.index)
    (message,) = [record.getMessage() for record in caplog.records]
    assert "2 of its 2 faces have no area in its texture coordinates" in message
    assert baked.covered.sum() == 1 and baked.pixels[0, 0] == pytest.approx(np.pi)


def test_what_cannot_be_baked() -> None:
    bare = clrt.Mesh(vertices=sheet().vertices, faces=sheet().faces, name="bare")
    wide = sheet(uv=np.array([(0, 0), (0, 1), (1, 1.5), (1, 0)], np.float32))
    scene = clrt.Scene(meshes=[bare, wide, sheet(), replace(bare, uv1=SQUARE, name="second")], name="room")
    for mesh, message in (
        ("bare", 'mesh "bare" of room has no texture coordinates uv to bake into; unwrap it .* with its UVs$'),
        ("second", "coordinates uv .*, or bake into its other set with --uv-set 1"),
        (wide, "2 of its 2 faces have texture coordinates uv outside 0 to 1"),
        ("sheet", 'room has 2 meshes named "sheet"'),
        ("shet", 'room has no mesh "shet"; it has "bare", "sheet", "second".*did you mean'),
    ):
        with pytest.raises(SceneError, match=message):
            clrt.bake(scene, mesh, size=8)
    mistakes: tuple[tuple[dict[str, Any], str], ...] = (
        ({"what": "oclusion"}, 'what: "oclusion" is unknown; did you mean "occlusion"'),
        ({"size": 0}, "size is 0"),
        ({"padding": -1}, "padding is -1"),
        ({"noise": 0.0}, "noise is 0.0"),
        ({"distance": 1.0}, "distance limits occlusion"),
        ({"what": "occlusion", "distance": -1.0}, "distance is -1.0"),
        ({"uv_set": 2}, "uv_set is 2"),
        ({"spam": 2}, "spam"),
    )
    for options, message in mistakes:
        with pytest.raises(UsageError, match=message):
            clrt.bake(scene, "second", **{"uv_set": 1, **options})


def test_the_second_set_of_texture_coordinates(device: Device) -> None:
    """Its image is that of the first set where it is the same, whatever the first one is."""
    mesh = replace(sheet(uv=SQUARE * np.float32(40)), uv1=SQUARE)
    scene = clrt.Scene(meshes=[mesh, panel()], environment=BLACK)
    second = clrt.bake(scene, mesh, size=8, spp=16, uv_set=1, device=device.info.index)
    first = clrt.bake(replace(scene, meshes=[sheet(), panel()]), "sheet", size=8, spp=16, device=device.info.index)
    assert np.array_equal(first.pixels, second.pixels)


def test_occlusion_is_saved_as_it_is(tmp_path: Path) -> None:
    """An image of data has its values themselves in 8 bits; light is encoded as sRGB."""
    grey = np.full((2, 2, 3), 0.5, np.float32)
    for what, level in (("occlusion", 128), ("irradiance", 188)):
        baked = clrt.LightMap(grey, grey, np.ones((2, 2), bool), {"what": what})
        assert np.asarray(Pillow.open(baked.save(tmp_path / "a.png"))).ravel()[0] == level
