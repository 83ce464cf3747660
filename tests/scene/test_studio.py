"""The studio's light by integrals over the sphere, with other code than the kernels' and the module's own."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.output.view_transform import to_display
from clrt.scene.geometry.transform import unit
from clrt.scene.studio import CAMERA_AZIMUTH, FLOOR_COLOR, KEY, ROOM, studio


def white(normal: tuple[float, float, float]) -> float:
    """Return the radiance of white paper with this normal: midpoints of a grid in (cos θ, φ), nearest texels."""
    image = studio().image
    assert image is not None
    height, width = image.shape[:2]
    y = (np.arange(2000) + 0.5) / 1000 - 1
    phi = (np.arange(4000) + 0.5) / 4000 * 2 * np.pi
    flat = np.sqrt(1 - y * y)
    rows = np.minimum((np.arccos(y) / np.pi * height).astype(int), height - 1)
    columns = (phi / (2 * np.pi) * width).astype(int)
    n = unit(np.array(normal))
    cosine = flat[:, None] * (n[0] * np.sin(phi) - n[2] * np.cos(phi)) + n[1] * y[:, None]
    room = (image[rows][:, columns, 1] * np.maximum(cosine, 0)).mean() * 4
    key = KEY.irradiance[1] * max(0.0, float(-unit(np.array(KEY.direction)) @ n)) / np.pi
    return float(room) + key


def test_it_is_neutral_and_deterministic() -> None:
    image: NDArray[np.float32] | None = studio().image
    assert image is not None and image.dtype == np.float32 and image.shape == (64, 128, 3)
    assert (image == image[..., :1]).all() and len(set(KEY.irradiance)) == 1
    assert (image == studio().image).all() and image.min() == np.float32(ROOM)
    assert (image[32:] == np.float32(ROOM)).all()  # as bright as the floor, whose edge therefore does not show


def test_the_floor_is_as_bright_as_what_is_around_it() -> None:
    assert FLOOR_COLOR * white((0, 1, 0)) == pytest.approx(ROOM, rel=2e-3)


def test_white_paper_is_white_towards_the_key_light_and_nowhere_dark() -> None:
    """A portrait's ratio of key to fill side is between 1:1, flat, and 1:4, dramatic."""
    towards = (-KEY.direction[0], -KEY.direction[1], -KEY.direction[2])
    assert 0.95 < white(towards) < 1.1
    front = np.sin(np.radians(CAMERA_AZIMUTH)), 0.3, np.cos(np.radians(CAMERA_AZIMUTH))
    assert 0.75 < white(front) < 1
    right, left = white((front[2], 0, -front[0])), white((-front[2], 0, front[0]))
    assert right < left < 2 * right and right > 0.4
    back = white((-front[0], 0.3, -front[2]))
    assert back > white((-front[0], -0.3, -front[2]))  # the rim light is above


@pytest.mark.parametrize("base", [(0.18, 0.18, 0.18), (0.7, 0.2, 0.1), (0.05, 0.3, 0.6)])
def test_pbr_neutral_shows_base_colors(base: tuple[float, float, float]) -> None:
    """A matte plastic reflects its base color and 4 % of the room, and the view transform subtracts 4 % of 1. Where it
    faces the key light it is shown in a color within 0.05 of its own."""
    lit = np.array(base) * white((-KEY.direction[0], -KEY.direction[1], -KEY.direction[2])) * 0.96 + 0.04 * 0.45
    shown = to_display(np.full((1, 1, 3), lit, np.float32), "pbr_neutral")[0, 0] / 255
    linear = np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)  # IEC 61966-2-1
    np.testing.assert_allclose(linear, base, atol=0.05)
