"""Bump maps of Mitsuba: slopes against closed forms, and images beside Mitsuba's."""

from __future__ import annotations

import logging
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from clrt.api import render
from clrt.formats.load_scene import load
from clrt.formats.mitsuba.bumps import gradient, sizes_over
from clrt.formats.mitsuba.primitives import rectangle, sphere
from clrt.output.images import write_image
from clrt.scene.geometry.transform import transform_mesh
from clrt.scene.materials.textures import WHITE, Picture, Texture
from clrt.scene.model import Mesh

from ..covering import others
from .test_mitsuba_xml import problem

BUMP = """<bsdf type="bumpmap"><float name="scale" value="{scale}"/><texture type="bitmap">
    <boolean name="raw" value="true"/><string name="filename" value="heights.png"/>
    <transform name="to_uv">{to_uv}</transform></texture><bsdf type="diffuse"/></bsdf>"""


def waves(folder: Path) -> None:
    """Write heights of ½ + ½·sin(2π·(x + y))·sin(2π·x), smooth where the image repeats."""
    x, y = np.meshgrid((np.arange(64) + 0.5) / 64, (np.arange(64) + 0.5) / 64)
    heights = (1 + np.sin(2 * np.pi * (x + y)) * np.sin(2 * np.pi * x)) / 2
    write_image(folder / "heights.png", np.repeat(decoded(heights)[..., None], 3, axis=2).astype(np.float32))


def decoded(values: np.ndarray) -> np.ndarray:
    """Return the light that sRGB encodes as these values, which a file of heights stores."""
    return np.where(values > 0.04045, ((values + 0.055) / 1.055) ** 2.4, values / 12.92)


def test_gradients_of_a_plane() -> None:
    """3·x + 5·y per image: within the image exact; at a clamped edge 0 across it."""
    rows, columns = 4, 6
    y, x = np.mgrid[:rows, :columns]
    right, down = gradient(3 * x / columns + 5 * y / rows, ("clamp", "clamp"), 2)
    assert right.shape == (2 * rows, 2 * columns)
    np.testing.assert_allclose(right[:, 1:-1], 3)
    np.testing.assert_allclose(down[1:-1], 5)
    assert not right[:, [0, -1]].any() and not down[[0, -1]].any()
    across, _ = gradient(3 * x / columns + 0.0 * y, ("repeat", "clamp"), 2)
    np.testing.assert_allclose(across[:, [0, -1]], 3 - 3 * columns)  # back from the last texel to the first


@pytest.mark.parametrize("seed", range(5))
def test_the_size_of_the_image_on_a_parallelogram(seed: int) -> None:
    """A rectangle under any affine map: ∇h by the pseudo-inverse of its edges, in the frame along the image's right."""
    rng = np.random.default_rng(seed)
    matrix = np.eye(4)
    matrix[:3, :3] = rng.normal(size=(3, 3))
    texture = Texture(picture=WHITE, scale=(1.5, -0.7), rotation_degrees=float(rng.uniform(-180, 180)))
    size, even, _ = sizes_over(transform_mesh(rectangle(), matrix), texture)
    assert even
    to_surface = np.column_stack([2 * matrix[:3, 0], 2 * matrix[:3, 1]]) @ np.linalg.inv(texture.to_picture[:, :2])
    slope = rng.normal(size=2)  # of a height over the image, to the right and down
    uphill = np.linalg.pinv(to_surface).T @ slope
    along = to_surface[:, 0] / np.linalg.norm(to_surface[:, 0])
    up = -(to_surface[:, 1] - along * (along @ to_surface[:, 1]))
    up /= np.linalg.norm(up)
    assert slope[0] / size.width == pytest.approx(uphill @ along)
    assert (-slope[1] - size.lean * slope[0] / size.width) / size.height == pytest.approx(uphill @ up)


def test_sizes_by_texel_on_a_globe() -> None:
    """Of a unit sphere of 256 x 128 cells, whose parallels at v are 2π·sin(πv) long, to their change across a cell."""
    found = sizes_over(sphere(), Texture(picture=Picture(np.zeros((64, 128, 4), np.uint8))))
    assert not found.even and found.texels is not None
    width, height, _ = found.texels
    v = (np.arange(len(width)) + 0.5) / len(width)
    inner = slice(len(v) // 8, -len(v) // 8)
    parallels = np.tile(2 * np.pi * np.sin(np.pi * v)[:, None], width.shape[1])
    np.testing.assert_allclose(width[inner], parallels[inner], atol=2 * np.pi**2 / 128)
    np.testing.assert_allclose(height[inner], np.pi, rtol=0.01)


@pytest.mark.programs
def test_an_image_that_is_repeated_in_different_sizes(folder: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Refused, or replaced by the median, with a warning; so are texture coordinates of no area."""
    flat = Mesh(np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32), uv=np.zeros((3, 2), np.float32))
    found = sizes_over(flat, Texture(picture=WHITE))
    assert not found.even and found.texels is None
    flat.uv = np.array([[0, 0], [0.7, 0.1], [np.float32(0.7) + np.float32(1e-7), 0.1]], np.float32)
    assert np.isfinite(sizes_over(flat, Texture(picture=WHITE)).median).all()
    waves(folder)
    bump = BUMP.format(scale=0.1, to_uv='<scale value="3"/>')
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 3 0 0\nv 0 3 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
    (folder / "a.obj").write_text(f"{corners}f 1/1 2/2 3/3\nf 1/1 4/2 5/3\n")
    shape = f'<shape type="obj"><string name="filename" value="a.obj"/>{bump}</shape>'
    said = problem(folder, shape)
    assert "repeated on a shape in different sizes" in said and "--approximate" in said
    with caplog.at_level(logging.WARNING):
        (mesh,) = load(folder / "scene.xml", approximate=True).meshes
    assert mesh.material.normal_map is not None and "median" in caplog.text


@pytest.mark.parametrize(
    ("bump", "words"),
    [
        ('<bsdf type="bumpmap"><bsdf type="diffuse"/></bsdf>', ["contains 0 textures", "write one"]),
        (
            BUMP.format(scale=1, to_uv="").replace("<boolean", '<string name="wrap_mode" value="mirror"/><boolean'),
            ["mirrored"],
        ),
    ],
)
def test_mistakes(folder: Path, bump: str, words: list[str]) -> None:
    waves(folder)
    said = problem(folder, f'<shape type="rectangle">{bump}</shape>')
    assert all(word in said for word in words), said


def test_two_shapes_share_a_normal_map_if_they_can(folder: Path) -> None:
    waves(folder)
    bump = BUMP.format(scale=0.1, to_uv="").replace("<bsdf", '<bsdf id="b"', 1)
    places = [
        "",
        '<transform name="to_world"><translate z="1"/></transform>',
        '<transform name="to_world"><scale x="2"/></transform>',
    ]
    shapes = "".join(f'<shape type="rectangle"><ref id="b"/>{place}</shape>' for place in places)
    (folder / "a.xml").write_text(f'<scene version="3.0.0">{bump}{shapes}</scene>')
    maps = [mesh.material.normal_map for mesh in load(folder / "a.xml").meshes]
    assert maps[0] and maps[1] and maps[2]
    assert maps[0].picture is maps[1].picture and maps[0].picture is not maps[2].picture


@pytest.mark.needs("mitsuba")
@pytest.mark.parametrize(
    ("to_uv", "to_world"),
    [
        ('<scale x="2" y="-1"/>', '<rotate y="1" angle="30"/><rotate x="1" angle="-20"/>'),
        *others(("", '<scale x="2"/>'), ('<rotate z="1" angle="30"/><scale value="1.2"/>', "")),
    ],
)
def test_images_are_mitsubas(folder: Path, to_uv: str, to_world: str) -> None:
    """A rectangle under a directional light: without noise but that of where samples lie within pixels."""
    mitsuba = import_module("mitsuba")
    mitsuba.set_variant("scalar_rgb")
    waves(folder)
    bump = BUMP.format(scale=0.3, to_uv=to_uv)
    (folder / "a.xml").write_text(
        f"""<scene version="3.0.0"><integrator type="direct"/><sensor type="orthographic"><transform name="to_world">
        <scale x="0.8" y="0.8"/><lookat origin="0,0,5" target="0,0,0" up="0,1,0"/></transform><film type="hdrfilm">
        <integer name="width" value="48"/><integer name="height" value="48"/><rfilter type="box"/></film></sensor>
        <emitter type="directional"><vector name="direction" value="-1,-0.5,-1.5"/></emitter>
        <shape type="rectangle"><transform name="to_world">{to_world}</transform>{bump}</shape></scene>"""
    )
    theirs = np.array(mitsuba.render(mitsuba.load_file(str(folder / "a.xml")), spp=256))[..., 0]
    ours = render(load(folder / "a.xml"), spp=256).pixels[..., 0]
    assert theirs[4:-4, 4:-4].std() > 0.02 * theirs.mean()
    off = np.abs(ours - theirs)[4:-4, 4:-4] / theirs.mean()
    assert np.corrcoef(ours[4:-4, 4:-4].ravel(), theirs[4:-4, 4:-4].ravel())[0, 1] > 0.995
    # Half a step of 8 bits of the slopes and heights is .4 %; the samples' places add as much.
    assert off.max() < 0.02 and off.mean() < 0.003
    assert ours[4:-4, 4:-4].mean() == pytest.approx(theirs[4:-4, 4:-4].mean(), rel=1e-3)
