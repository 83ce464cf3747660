"""Mean emission of textured triangles, by which lights are sampled: zero only where no visible texel emits."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest
from hypothesis import given, strategies as st

from clrt.rendering.compile.lights.mean_emission import mean_texels
from clrt.scene.materials.textures import Picture, Texture, Wrap

from ..oracle.textures import color_at

WRAPS = st.sampled_from(get_args(Wrap))


@given(seed=st.integers(0, 2**32 - 1), wrap=st.tuples(WRAPS, WRAPS))
def test_what_emits_has_a_mean_above_0(seed: int, wrap: tuple[Wrap, Wrap]) -> None:
    """Whatever its texture coordinates, its size and the number of bright texels; read by the float64 path tracer."""
    rng = np.random.default_rng(seed)
    texels = np.zeros((*rng.integers(1, 12, 2), 4), np.uint8)
    texels[..., :3] = 255 * (rng.random(texels.shape[:2]) < rng.choice([0.1, 0.5, 1]))[..., None]
    texture = Texture(
        picture=Picture(texels),
        wrap=wrap,
        rotation_degrees=float(rng.uniform(0, 360)),
        scale=(float(rng.uniform(-3, 3)), float(rng.uniform(-3, 3))),
        offset=(float(rng.normal()), 0.3),
    )
    corners = rng.normal(0, 2, (1, 1, 2)) + rng.normal(0, rng.choice([1e-3, 0.1, 1]), (20, 3, 2))
    inside = rng.dirichlet((1, 1, 1), 400) @ corners
    brightest = color_at(texture, inside.reshape(-1, 2)).reshape(20, 400, 3).max(axis=(1, 2))
    mean = mean_texels(texture, corners)[:, 0]
    assert ((mean > 0) | (brightest < 1e-9)).all() and (mean <= 1 + 1e-9).all()


@pytest.mark.parametrize(
    ("left", "wrap", "expected"),
    [
        (1.125, "repeat", 0),
        (1.125, "mirror", 1),
        (1.125, "clamp", 1),
        (1.625, "repeat", 1),
        (1.625, "mirror", 0),
        (-0.875, "repeat", 0),
        (-0.875, "mirror", 1),
        (-0.875, "clamp", 0),
        (-7e9, "clamp", 0),
        (7e9, "clamp", 1),
    ],
)
def test_outside_the_unit_square(left: float, wrap: Wrap, expected: float) -> None:
    """An image that is black on the left and white on the right, a quarter of it seen beyond its edges."""
    texels = np.zeros((1, 64, 4), np.uint8)
    texels[:, 32:, :3] = 255
    texture = Texture(picture=Picture(texels), wrap=(wrap, "repeat"))
    corners = np.array([[[left, 0.5], [left + 0.25, 0.5], [left + 0.125, 0.5]]])
    np.testing.assert_allclose(mean_texels(texture, corners)[0], expected, atol=1e-9)
