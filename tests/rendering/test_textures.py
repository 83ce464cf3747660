"""Textures: kernel look-ups against scipy's interpolation, and images that follow from their texels."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any, Literal, get_args

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from clrt.bench.kernel_probe import Probe
from clrt.device.open import Device
from clrt.rendering.compile.choices import Lanes
from clrt.rendering.renderer import Renderer
from clrt.scene.lights import DirectionalLight
from clrt.scene.materials.material_types import Diffuse, Material, MetallicRoughness
from clrt.scene.materials.textures import Channel, Picture, Texture, Wrap
from clrt.scene.model import Camera, Environment, Mesh, RenderSettings, Scene, Sphere

from ..covering import covering, others
from .ggx import bump_shadowing

Doubles = NDArray[np.float64]
FILTERS: tuple[Literal["linear", "nearest"], ...] = ("linear", "nearest")
MODES = {"repeat": "grid-wrap", "mirror": "reflect", "clamp": "nearest"}
QUAD = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
FACES = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
BLACK = (0.0, 0.0, 0.0)
UV = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)


def picture(seed: int, height: int, width: int) -> Picture:
    """Return a noise image."""
    return Picture(np.random.default_rng(seed).integers(0, 256, (height, width, 4), np.uint8))


def plain(red: int, green: int, blue: int) -> Picture:
    """Return an image of one color, as stored."""
    return Picture(np.full((2, 2, 4), (red, green, blue, 255), np.uint8))


def decoded(encoded: NDArray[np.uint8]) -> Doubles:
    """Decode sRGB by IEC 61966-2-1."""
    values = encoded / 255
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def quad(material: Material, **corners: Any) -> Mesh:
    """Return [-1, 1]² at z = 0, facing +z, with an upright texture."""
    return Mesh(**{"vertices": QUAD, "faces": FACES, "material": material, "uv": UV, **corners})


def seen(device: Device, scene: Scene, size: int = 32, spp: int = 16, **settings: Any) -> Doubles:
    """Return the image (size, size, 3) of [-1, 1]² at z = 0, from far above."""
    scene = replace(
        scene,
        camera=Camera(position=(0, 0, 1000), look_at=(0, 0, 0), fov_degrees=float(np.degrees(2 * np.arctan(1 / 1000)))),
        render=RenderSettings(size=(size, size), **settings),
    )
    for state in Renderer(scene, spp=spp, device=device.info.index).passes(spp=spp):
        pass
    return state.film.mean


@pytest.mark.parametrize("kind", get_args(Wrap))
def test_texels_are_read_as_scipy_reads_them(device: Device, kind: Wrap) -> None:
    """Bilinear and nearest, every channel, across the edges, with several images in one scene."""
    pictures = [picture(1, 5, 7), picture(2, 1, 1), picture(3, 16, 2)]
    textures = [
        Texture(picture=p, wrap=(kind, kind), filter=f, channel=c)
        for p, f, c in itertools.product(pictures, FILTERS, get_args(Channel))
    ]
    users = [MetallicRoughness(color=texture, roughness=texture) for texture in textures]
    probe = Probe(device, Scene(spheres=[Sphere(material=user) for user in users]))
    records = probe.compiled.buffers["textures"][1]
    assert len(records) == len(textures)
    uv = np.random.default_rng(4).uniform(-2.5, 2.5, (2000, 2)).astype(np.float32).astype(np.float64)
    for number, texture in enumerate(textures):
        found = probe("texture", 4, np.full(len(uv), number), uv)
        texels = texture.picture.texels
        place = (uv * texels.shape[1::-1] - 0.5).T[::-1]
        if texture.filter == "nearest":
            clear = np.abs(place - np.floor(place) - 0.5).min(axis=0) > 1e-4
            place = np.floor(place + 0.5)
        else:
            clear = np.ones(len(uv), bool)
        channels = [
            *np.moveaxis(decoded(texels[..., :3]), 2, 0),
            texels[..., get_args(Channel).index(texture.channel)] / 255,
        ]
        expected = np.stack([map_coordinates(c, place, order=1, mode=MODES[kind]) for c in channels], axis=1)
        assert np.abs(found - expected)[clear].max() < 1e-5


def test_a_picture_lies_upright_and_each_texel_fills_its_square(device: Device) -> None:
    """A diffuse surface under uniform white light shows exactly its own colors."""
    texels = picture(7, 8, 8)
    scene = Scene(
        meshes=[quad(Diffuse(color=Texture(picture=texels, filter="nearest", factor=(1, 0.5, 0.25))))],
        environment=Environment(color=(1, 1, 1)),
    )
    expected = np.kron(decoded(texels.texels[..., :3]) * (1, 0.5, 0.25), np.ones((4, 4, 1)))
    assert np.abs(seen(device, scene) - expected).max() < 1e-5


@pytest.mark.parametrize("degrees, order", [(0, "abcd"), (90, "cadb"), (180, "dcba"), (270, "bdac")])
def test_pictures_are_moved_scaled_and_turned(device: Device, degrees: float, order: str) -> None:
    """Rotating coordinates counter-clockwise rotates the image clockwise (KHR_texture_transform): a b over c d."""
    colors = {"a": 0, "b": 80, "c": 160, "d": 240}
    texels = np.full((2, 2, 4), 255, np.uint8)
    texels[..., 0] = np.reshape([colors[name] for name in "abcd"], (2, 2))
    # Half a turn about the coordinates' origin, (0, 0), ends at −u: with repeat, that is the same square.
    texture = Texture(picture=Picture(texels), rotation_degrees=degrees, scale=(2, 2), offset=(3, -4), filter="nearest")
    scene = Scene(meshes=[quad(Diffuse(color=texture))], environment=Environment(color=(1, 1, 1)))
    found = seen(device, scene, spp=4)[..., 0]
    expected = np.kron(
        np.tile(decoded(np.reshape([colors[n] for n in order], (2, 2)).astype(np.uint8)), (2, 2)), np.ones((8, 8))
    )
    assert np.abs(found - expected).max() < 1e-5


@pytest.mark.programs
def test_second_set_of_coordinates_and_numbers(device: Device) -> None:
    """One material with a color from the first UV set and a metallic texture from the second."""
    texels = np.zeros((1, 2, 4), np.uint8)
    texels[0, 1, 2] = 255
    color, metal = picture(8, 4, 4), Picture(texels)
    material = MetallicRoughness(
        color=Texture(picture=color, filter="nearest"),
        roughness=1.0,
        preset=None,
        metallic=Texture(picture=metal, channel="blue", uv_set=1, filter="nearest"),
    )
    # The textured quad is behind each of them, so that every image runs the same program.
    both = quad(material, uv1=UV[:, ::-1], vertices=(QUAD - (0, 0, 1)).astype(np.float32))
    scene, *plain_ones = [
        Scene(meshes=[quad(each, uv1=UV[:, ::-1]), both], environment=Environment(color=(1, 1, 1)))
        for each in (material, replace(material, metallic=0.0), replace(material, metallic=1.0))
    ]
    found, body, metallic = (seen(device, each) for each in (scene, *plain_ones))
    assert np.abs(body - metallic).mean() > 0.02
    assert np.array_equal(found[:16], body[:16]) and np.array_equal(found[16:], metallic[16:])


def test_vertex_colors_multiply(device: Device) -> None:
    """They are linear over each triangle, so a pixel's mean is the value at its centre."""
    colors = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    scene = Scene(
        meshes=[quad(Diffuse(color=(0.5, 0.25, 1)), colors=colors), quad(Diffuse())],
        environment=Environment(color=(1, 1, 1)),
    )
    scene.meshes[1].vertices = (QUAD - (0, 0, 1)).astype(np.float32)
    middle = (np.arange(32) + 0.5) / 32
    found = seen(device, scene, spp=64)
    assert np.abs(found[..., 0] - 0.5 * middle).max() < 2e-3
    assert np.abs(found[..., 1] - 0.25 * middle[::-1, None]).max() < 2e-3
    assert not found[..., 2].any()


#: Texture transforms: none, rotated and scaled, mirrored.
PLACED: dict[str, dict[str, Any]] = {
    "plain": {},
    "turned": {"rotation_degrees": 30.0, "scale": (2.0, 0.7)},
    "mirrored": {"rotation_degrees": -75.0, "scale": (-1.3, 0.8), "offset": (0.3, 0.1)},
}


def image_axes(texture: Texture, along_u: Doubles, along_v: Doubles, normal: Doubles) -> tuple[Doubles, Doubles]:
    """Return unit vectors to the right and up in a texture's image on a surface, from its derivatives by u and by v."""
    by_x, by_y = np.linalg.inv(texture.to_picture[:, :2]).T @ np.stack([along_u, along_v])
    right = by_x / np.linalg.norm(by_x)
    up = np.cross(normal, right)
    return right, up if up @ by_y < 0 else -up


@covering(
    "shape, mirrored, turn, placed",
    ["flat", "smooth", "own tangents"],
    [False, True],
    [0.0, 40.0, 90.0, 200.0],
    list(PLACED),
    strength=2,
)
def test_normal_maps_tilt_along_the_picture(
    device: Device, turn: float, mirrored: bool, shape: str, placed: str
) -> None:
    """Red tilts the normal to the image's right and green to its top, for any orientation on the
    surface: light from there has the cosine to the bent normal, with bump shadowing. A mesh's own
    tangents are those of the transformed image."""
    angle = np.radians(turn)
    right, top = np.array([np.cos(angle), np.sin(angle), 0]), np.array([-np.sin(angle), np.cos(angle), 0])
    right = -right if mirrored else right
    uv = np.stack([QUAD @ right, -QUAD @ top], axis=1).astype(np.float32)
    texel = np.array([200, 60, 210])
    tilt = texel / 255 * 2 - 1
    strength = 0.5
    texture = Texture(picture=plain(200, 60, 210), factor=strength, **PLACED[placed])
    if shape != "own tangents":
        right, top = image_axes(texture, right, -top, np.array([0.0, 0.0, 1.0]))
    bent = strength * tilt[0] * right + strength * tilt[1] * top + [0, 0, tilt[2]]
    towards = np.array([0.3, -0.2, 0.9])
    cosine = bent @ towards / np.linalg.norm(bent) / np.linalg.norm(towards)
    normals = np.tile(np.array([0, 0, 1], np.float32), (4, 1)) if shape != "flat" else None
    own = np.tile(np.array([*right, -1 if mirrored else 1], np.float32), (4, 1)) if shape == "own tangents" else None
    scene = Scene(
        meshes=[quad(Diffuse(color=(0.8, 0.8, 0.8), normal_map=texture), uv=uv, normals=normals, tangents=own)],
        lights=[DirectionalLight(direction=tuple(-towards), irradiance=(1, 1, 1))],
    )
    found = seen(device, scene, size=8, spp=4, max_depth=2)
    left = bump_shadowing(np.array([0.0, 0.0, 1.0]), bent, towards)
    assert found.mean() == pytest.approx(0.8 / np.pi * cosine * left, rel=1e-4)
    assert found.std() < 1e-5


@pytest.mark.parametrize("placed", PLACED)
def test_normal_maps_tilt_along_the_picture_on_spheres(device: Device, placed: str) -> None:
    """At a point of a sphere, seen by a camera with a tiny field of view."""
    theta, phi, texel = 1.1, 0.4, np.array([200, 60, 210])
    normal = np.array([np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)])
    along_u = 2 * np.pi * np.array([normal[2], 0.0, -normal[0]])
    along_v = np.pi * np.array([np.cos(theta) * np.sin(phi), -np.sin(theta), np.cos(theta) * np.cos(phi)])
    texture = Texture(picture=plain(*texel), **PLACED[placed])
    right, up = image_axes(texture, along_u, along_v, normal)
    bent = np.stack([right, up, normal], axis=1) @ (texel / 255 * 2 - 1)
    scene = Scene(
        spheres=[Sphere(material=Diffuse(normal_map=texture))],
        camera=Camera(position=tuple(3 * normal), look_at=(0.0, 0.0, 0.0), fov_degrees=0.01),
        render=RenderSettings(size=(4, 4), integrator="normals"),
    )
    *_, last = Renderer(scene, spp=4, device=device.info.index).passes(spp=4)
    np.testing.assert_allclose(last.film.mean.mean(axis=(0, 1)), bent / np.linalg.norm(bent), atol=2e-4)


@pytest.mark.programs
def test_normal_maps_on_spheres(device: Device) -> None:
    """A normal map that bends nothing leaves the image unchanged."""
    flat = Texture(picture=plain(128, 128, 255), factor=0.0)
    ball = Sphere(material=Diffuse(color=(0.7, 0.5, 0.3)))
    scene = Scene(spheres=[ball], lights=[DirectionalLight(direction=(1, -1, -1), irradiance=(3, 3, 3))])
    bent = replace(scene, spheres=[replace(ball, material=replace(ball.material, normal_map=flat))])
    a, b = (seen(device, each, max_depth=2) for each in (scene, bent))
    assert a.max() > 0.3 and np.abs(a - b).max() < 1e-5


@pytest.mark.programs
@pytest.mark.parametrize("cut", [False, True], ids=["painted", "cut out"])
@pytest.mark.parametrize("lanes", [8, *others(1)])
def test_half_a_lamp_is_a_lamp_of_half_the_size(device: Device, lanes: Lanes, cut: bool) -> None:
    """A picture that is half black, as emission or opacity: the light below is that of the other half alone, by light
    samples and without.

    The reference is rendered with one SIMD width, as its result does not depend on it.
    """
    texels = np.full((1, 2, 4), 255, np.uint8)
    texels[0, 0, :3] = 0
    half = Picture(texels)
    above = (QUAD * (1, 1, 0) + (0, 1, 1))[:, [0, 2, 1]]
    ground = Mesh((QUAD * 9)[:, [0, 2, 1]].astype(np.float32), FACES[:, ::-1].copy(), Diffuse(color=(0.8, 0.8, 0.8)))
    glow = (5.0, 5.0, 5.0)
    material = (
        Diffuse(color=BLACK, emission=glow, opacity=Texture(picture=half, filter="nearest"))
        if cut
        else Diffuse(color=BLACK, emission=Texture(picture=half, factor=5.0, filter="nearest"))
    )
    painted = Mesh(above.astype(np.float32), FACES, material, uv=UV)
    right = np.where(UV[:, :1] == 0, above * (0, 1, 1), above)
    small = Mesh(right.astype(np.float32), FACES, Diffuse(color=BLACK, emission=glow))
    pictures = []
    for lamp in (painted, small):
        scene = Scene(
            meshes=[ground, lamp],
            camera=Camera(position=(0, 0.5, 8), look_at=(0, 0.5, 0)),
            render=RenderSettings(size=(24, 24), max_depth=3),
        )
        renderer = Renderer(scene, spp=256, device=device.info.index, lanes=lanes if lamp is painted else 8)
        for state in renderer.passes(spp=256):
            pass
        pictures.append(state.film)
    found, expected = (film.mean for film in pictures)
    error = np.sqrt(sum(film.variance for film in pictures))
    z = (found - expected)[error > 0] / error[error > 0]
    assert found.max() > 0.3 and abs(float(np.mean(found) / np.mean(expected)) - 1) < 5e-3
    assert np.abs(z).max() < 6
