"""Mean emission of textured triangles, used for light selection: 0 only for triangles that emit nothing."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from clrt.rendering.compile.lights.mean_emission import mean_texels
from clrt.scene.materials.textures import Picture, Texture, Wrap

WRAPS: tuple[Wrap, ...] = ("repeat", "mirror", "clamp")


def wrapped(i: NDArray[np.int64], size: int, wrap: Wrap) -> NDArray[np.int64]:
    """Return the texel index for each index of an infinite row."""
    if wrap == "clamp":
        return np.clip(i, 0, size - 1)
    around = i % (2 * size)
    return i % size if wrap == "repeat" else np.where(around < size, around, 2 * size - 1 - around)


def seen(texture: Texture, uv: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return bilinear values of the red channel (0 or 1 in each texel) at texture coordinates (n, 2)."""
    texels = texture.picture.texels[..., 0] / 255.0
    height, width = texels.shape
    at = (uv @ texture.to_picture[:, :2].T + texture.to_picture[:, 2]) * (width, height) - 0.5
    first = np.floor(at).astype(np.int64)
    part = at - first
    value = np.zeros(len(uv))
    for right, down in product((0, 1), (0, 1)):
        weight = abs(1 - right - part[:, 0]) * abs(1 - down - part[:, 1])
        value += weight * texels[wrapped(first[:, 1] + down, height, texture.wrap[1]),
                                 wrapped(first[:, 0] + right, width, texture.wrap[0])]
    return value


@given(seed=st.integers(0, 2**32 - 1), wrap=st.tuples(st.sampled_from(WRAPS), st.sampled_from(WRAPS)))
def test_what_emits_has_a_mean_above_0(seed: int, wrap: tuple[Wrap, Wrap]) -> None:
    """For any texture coordinates, triangle size, and number of bright texels."""
    rng = np.random.default_rng(seed)
    texels = np.zeros((*rng.integers(1, 12, 2), 4), np.uint8)
    texels[..., :3] = 255 * (rng.random(texels.shape[:2]) < rng.choice([0.1, 0.5, 1]))[..., None]
    texture = Texture(picture=Picture(texels), wrap=wrap, rotation_degrees=float(rng.uniform(0, 360)),
                      scale=(float(rng.uniform(-3, 3)), float(rng.uniform(-3, 3))), offset=(float(rng.normal()), 0.3))
    corners = rng.normal(0, 2, (1, 1, 2)) + rng.normal(0, rng.choice([1e-3, 0.1, 1]), (20, 3, 2))
    inside = rng.dirichlet((1, 1, 1), 400)
    brightest = np.array([seen(texture, inside @ triangle).max() for triangle in corners])
    mean = mean_texels(texture, corners)[:, 0]
    assert ((mean > 0) | (brightest < 1e-9)).all() and (mean <= 1 + 1e-9).all()


@pytest.mark.parametrize(("left", "wrap", "expected"), [
    (1.125, "repeat", 0), (1.125, "mirror", 1), (1.125, "clamp", 1), (1.625, "repeat", 1), (1.625, "mirror", 0),
    (-0.875, "repeat", 0), (-0.875, "mirror", 1), (-0.875, "clamp", 0), (-7e9, "clamp", 0), (7e9, "clamp", 1)])
def test_beyond_the_picture(left: float, wrap: Wrap, expected: float) -> None:
    """A texture that is black on the left and white on the right, sampled a quarter beyond its ends."""
    texels = np.zeros((1, 64, 4), np.uint8)
    texels[:, 32:, :3] = 255
    texture = Texture(picture=Picture(texels), wrap=(wrap, "repeat"))
    corners = np.array([[[left, 0.5], [left + 0.25, 0.5], [left + 0.125, 0.5]]])
    np.testing.assert_allclose(mean_texels(texture, corners)[0], expected, atol=1e-9)
