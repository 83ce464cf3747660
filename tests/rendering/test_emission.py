"""Estimated power of textured emissive triangles: zero only where no visible texel emits."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from clrt.rendering.compile.lights.mean_emission import mean_texels
from clrt.scene.materials.textures import Picture, Texture, Wrap

from ..oracle.textures import color_at

SIZE = 32


@pytest.mark.parametrize("wrap_v", get_args(Wrap))
@pytest.mark.parametrize("wrap_u", get_args(Wrap))
def test_what_shines_somewhere_is_not_dark(wrap_u: Wrap, wrap_v: Wrap) -> None:
    """Small triangles anywhere within three repeats of a texture with one bright corner."""
    rng = np.random.default_rng(4)
    texels = np.zeros((SIZE, SIZE, 4), np.uint8)
    texels[-SIZE // 4:, -SIZE // 4:] = 255
    texture = Texture(picture=Picture(texels), wrap=(wrap_u, wrap_v), rotation_degrees=17.0, scale=(-1.0, 1.2))
    uv = rng.uniform(-3, 3, (2000, 1, 2)) + rng.uniform(0, 0.2, (2000, 3, 2))
    inside = rng.dirichlet((1, 1, 1), 200) @ uv
    shown = color_at(texture, inside.reshape(-1, 2)).reshape(2000, 200, 3)
    mean = mean_texels(texture, uv)
    shines = shown.max(axis=1) > 0
    assert 50 < shines.any(axis=1).sum() < 1950
    assert np.all(mean[shines] > 0)
    # Triangles far from the bright corner that cross no edge are known to be dark.
    assert np.mean(mean[~shines] == 0) > 0.3


def test_a_picture_of_one_color_is_as_bright_as_that() -> None:
    texture = Texture(picture=Picture(np.full((SIZE, SIZE, 4), 255, np.uint8)), wrap=("clamp", "mirror"))
    uv = np.random.default_rng(5).uniform(-3, 3, (500, 3, 2))
    assert np.allclose(mean_texels(texture, uv), 1)
