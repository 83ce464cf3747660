"""pbrt's projection and goniometric lights: what arrives at random points, by the formulas of the book (12.2)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from clrt.bench.kernel_probe import Probe
from clrt.device.open import Device
from clrt.formats.images.image_reader import read_picture
from clrt.formats.pbrt.equal_area import square_of
from clrt.output.images import write_image, write_texels
from clrt.scene.lights import GoniometricLight
from clrt.scene.model import Scene

from .pbrt_files import UPRIGHT, problem, scene

Doubles = NDArray[np.float64]
POINTS = 300
#: A camera that does not mirror: pbrt's x is negated.
PLAIN = 'Camera "perspective"\n'


class Placed:
    """A random light: its transformation, also as directives, and points (n, 3) around it in pbrt's world."""

    def __init__(self, seed: int, file: Path, old: bool) -> None:
        self.rng = rng = np.random.default_rng(seed)
        self.mirrored, self.old, size = bool(seed & 1), old, 2 ** rng.integers(0, 4, 2)
        if seed & 2:
            write_texels(file, rng.integers(0, 256, (*size, 4), np.uint8))
        else:
            write_image(file := file.with_suffix(".exr"), rng.uniform(0, 5, (*size, 3)).astype(np.float32))
        self.name, self.pixels = file.name, read_picture(file)
        self.scale, turn = rng.uniform(0.5, 2), Rotation.random(random_state=seed).as_matrix()
        self.linear = turn @ np.diag([self.scale, self.scale, -self.scale if seed & 4 else self.scale])
        self.position = rng.normal(size=3)
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = self.linear, self.position
        self.place = f"Transform [{' '.join(map(str, matrix.T.ravel()))}]"
        forward = self.linear[:, 2] / self.scale
        aside = rng.uniform(-1, 1, (POINTS, 3)) * rng.uniform(0, 1, (POINTS, 1))
        self.points = self.position + (forward + aside) * rng.uniform(0.5, 3, (POINTS, 1))

    @property
    def local(self) -> Doubles:
        """Unit directions (n, 3) from the light to the points, in its coordinates."""
        local = (self.points - self.position) @ np.linalg.inv(self.linear).T
        return np.asarray(local / np.linalg.norm(local, axis=1, keepdims=True))

    @property
    def squares(self) -> Doubles:
        """(n, 1): the squares of the distances."""
        return np.asarray(((self.points - self.position) ** 2).sum(axis=1, keepdims=True))

    def read(self, folder: Path, light: str) -> Scene:
        """Return the scene of a light, which may be mirrored."""
        end = "\nWorldEnd" if self.old else ""
        text = f"AttributeBegin {self.place}\n{light}\nAttributeEnd{end}"
        return scene(folder, text, PLAIN if self.mirrored else UPRIGHT)

    def arriving(self, device: Device, read: Scene) -> Doubles:
        """Return the irradiance (n, 3) on surfaces that face the light of the scene."""
        places = self.points * ((-1, 1, 1) if self.mirrored else (1, 1, 1))
        normals = np.tile([0.0, 0.0, 1.0], (POINTS, 1))
        return Probe(device, read)("light_sample", 12, places, normals, seed=1)[:, 3:6]

    def nearest(self, u: Doubles, v: Doubles) -> Doubles:
        rows, columns = self.pixels.shape[:2]
        row, column = (v * rows).astype(int).clip(0, rows - 1), (u * columns).astype(int).clip(0, columns - 1)
        return np.asarray(self.pixels[row, column], np.float64)

    def linear_repeated(self, u: Doubles, v: Doubles) -> Doubles:
        rows, columns = self.pixels.shape[:2]
        x, y = u * columns - 0.5, v * rows - 0.5
        left, top = np.floor(x).astype(int), np.floor(y).astype(int)
        found = np.zeros((len(u), 3))
        for i, j in ((0, 0), (1, 0), (0, 1), (1, 1)):
            weight = (1 - np.abs(x - left - i)) * (1 - np.abs(y - top - j))
            found += weight[:, None] * self.pixels[(top + j) % rows, (left + i) % columns]
        return found


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("old", [False, True])
def test_projections(device: Device, folder: Path, seed: int, old: bool) -> None:
    """A screen of −1 to 1 along the image's shorter side at the tangent of half the angle; v4 looks up the nearest
    texel and has the top at +y, v3 interpolates and has it at −y."""
    light = Placed(seed, folder / "slide.png", old)
    fov, strength = light.rng.uniform(20, 120), light.rng.uniform(0.5, 4)
    values = f'"string {"mapname" if old else "filename"}" "{light.name}" "float fov" {fov}'
    colors = '"rgb I" [1 2 3] "rgb scale"' if old else '"float scale"'
    scales = [strength] * 3 if old else [strength]
    read = light.read(folder, f'LightSource "projection" {values} {colors} [{" ".join(map(str, scales))}]')
    x, y, z = light.local.T
    per, aspect = 1 / (z * np.tan(np.radians(fov) / 2)), light.pixels.shape[1] / len(light.pixels)
    wide, high = (aspect, 1) if aspect > 1 else (1, 1 / aspect)
    u, v = 0.5 + x * per / (2 * wide), 0.5 + (y if old else -y) * per / (2 * high)
    inside = (z > 1e-3) & (u >= 0) & (u <= 1) & (v >= 0) & (v <= 1)
    shown = light.linear_repeated(u, v) if old else light.nearest(u, v)
    expected = (
        np.where(inside[:, None], strength * np.array((1, 2, 3) if old else (1, 1, 1)) * shown, 0) / light.squares
    )
    assert np.count_nonzero(inside) > 20
    found = light.arriving(device, read)
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=2e-5 * expected.max())


@pytest.mark.parametrize("seed", range(8))
def test_goniometric_lights_of_v3(device: Device, folder: Path, seed: int) -> None:
    """The polar angle is from +y, the azimuth from +x towards +z."""
    light = Placed(seed, folder / "map.png", True)
    read = light.read(folder, f'LightSource "goniometric" "string mapname" "{light.name}" "rgb I" [3 2 1]')
    x, y, z = light.local.T
    u, v = np.arctan2(z, x) / (2 * np.pi) % 1, np.arccos(y) / np.pi
    expected = np.array([3, 2, 1]) * light.linear_repeated(u, v) / light.squares
    np.testing.assert_allclose(light.arriving(device, read), expected, rtol=2e-4, atol=2e-5 * expected.max())


@pytest.mark.parametrize("seed", range(8))
def test_goniometric_lights_of_v4(device: Device, folder: Path, seed: int, caplog: pytest.LogCaptureFixture) -> None:
    """A square of equal areas around +y, of which the mean of the channels counts; its texels' edges are blurred by
    the resampling, which is announced."""
    light = Placed(seed, folder / "map.png", False)
    size = min(light.pixels.shape[:2])
    light.pixels = light.pixels[:size, :size].mean(axis=2, keepdims=True) * np.ones(3)
    write_image(folder / "square.exr", light.pixels.astype(np.float32))
    read = light.read(
        folder, 'LightSource "goniometric" "string filename" "square.exr" "rgb I" [3 2 1] "float scale" 2'
    )
    assert "its image is resampled" in caplog.text
    square = square_of(light.local[:, [0, 2, 1]])
    expected = np.array([6, 4, 2]) * light.nearest(*square.T) / light.squares
    found = light.arriving(device, read)
    off = (np.abs(square * size - np.round(square * size)) > 0.02 * size / 2).all(axis=1)  # from the texels' edges
    assert off.sum() > 50
    np.testing.assert_allclose(found[off], expected[off], rtol=1e-4)


@pytest.mark.parametrize("kind", ["projection", "goniometric"])
def test_power(device: Device, folder: Path, kind: str) -> None:
    """The integral of the luminance over all directions is `power`, whatever the scale of the transformation."""
    rng = np.random.default_rng(4)
    write_image(folder / "map.exr", rng.uniform(0, 5, (64, 64, 3)).astype(np.float32))
    light = f'Scale 2 2 2 LightSource "{kind}" "string filename" "map.exr" "float power" 30 "float scale" 1'
    read = scene(folder, light)
    rows = 600
    theta, phi = np.pi * (np.arange(rows) + 0.5) / rows, np.pi * (np.arange(2 * rows) + 0.5) / rows
    sine = np.sin(theta)[:, None]
    cosine = np.repeat(np.cos(theta)[:, None], 2 * rows, axis=1)
    directions = np.stack([sine * np.cos(phi), sine * np.sin(phi), cosine], axis=-1).reshape(-1, 3)
    weight = np.repeat(sine.ravel(), 2 * rows) * np.pi**2 / rows**2
    normals = np.tile([0.0, 0.0, 1.0], (len(directions), 1))
    radiance = Probe(device, read)("light_sample", 12, directions, normals, seed=1)[:, 3:6]
    assert (radiance * weight[:, None]).sum(axis=0) @ (0.2127, 0.7152, 0.0722) == pytest.approx(30, rel=5e-3)


def test_mistakes_are_named(folder: Path) -> None:
    write_image(folder / "wide.exr", np.ones((2, 3, 3), np.float32))
    assert '"filename" is missing; name an image' in problem(folder, 'LightSource "projection"')
    said = problem(folder, 'LightSource "goniometric" "string filename" "wide.exr"')
    assert '"filename" is an image of 3x2 pixels; give a square one' in said
    said = problem(folder, 'Scale 1 2 1 LightSource "projection" "string filename" "wide.exr"')
    assert 'LightSource "projection": its transformation shears or stretches' in said
    said = problem(folder, 'LightSource "projection" "string filename" "wide.exr" "float fov" 180')
    assert 'LightSource "projection": "fov" is 180; write more than 0 and less than 180 degrees' in said
    said = problem(folder, 'LightSource "projection" "string filename" "none.exr"')
    assert "none.exr: no such picture file" in said


def test_v3_has_white_lights_without_an_image(folder: Path) -> None:
    (light,) = scene(folder, 'LightSource "goniometric" "rgb I" [1 2 3]\nWorldEnd').lights
    assert isinstance(light, GoniometricLight) and light.shows.typical.tolist() == [1, 1, 1]
