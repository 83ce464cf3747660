"""View transforms against the published curves, in float64 and by known values."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.errors import UsageError
from clrt.output.view import VIEWS, to_display
from clrt.scene.pictures import linear_from_srgb


def shown(values: list[float], view: str = "srgb", exposure: float = 0.0) -> list[int]:
    """What grey pixels of these values become; all three channels must agree."""
    grey = np.array(values, np.float32).reshape(1, -1, 1).repeat(3, axis=2)
    display = to_display(grey, view, exposure)
    assert display.dtype == np.uint8 and display.shape == grey.shape
    assert np.all(display == display[..., :1])
    return [int(value) for value in display[0, :, 0]]


def srgb_float64(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """IEC 61966-2-1, as printed."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def test_known_values() -> None:
    assert shown([0, 0.18, 0.2158605, 0.5, 1, 2]) == [0, 118, 128, 188, 255, 255]
    assert shown([0, 0.18, 0.5, 1, 2], "raw") == [0, 46, 128, 255, 255]


def test_srgb_follows_the_closed_form_everywhere() -> None:
    linear = np.linspace(0, 1, 300_001, dtype=np.float32)
    exact = 255 * srgb_float64(linear.astype(np.float64))
    display = to_display(linear.reshape(1, -1, 1).repeat(3, axis=2))[0, :, 0]
    # Where the curve crosses a half, float32 may fall on either side: 1e-4 is 1e-6 of full scale in units of 1/255.
    clear = np.abs(exact - np.floor(exact) - 0.5) > 1e-4
    assert clear.mean() > 0.999
    assert np.array_equal(display[clear], np.floor(exact + 0.5)[clear])


def test_halves_round_up() -> None:
    assert shown([0.5 / 255, 2.5 / 255, 126.5 / 255], "raw") == [1, 3, 127]


def test_decoding_undoes_srgb_for_all_256_levels() -> None:
    levels = np.arange(256)
    linear = linear_from_srgb((levels / 255).astype(np.float32))
    assert shown(linear.tolist()) == levels.tolist()
    assert srgb_float64(linear.astype(np.float64)) * 255 == pytest.approx(levels, abs=1e-4)


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.filterwarnings("error")
def test_what_is_no_light_is_black_and_too_much_is_white(view: str) -> None:
    assert shown([math.nan, -math.inf, -1, -1e38, -0.0, 0], view) == [0] * 6
    assert shown([math.inf, 1e38, 3.4e38, 1e15, 1e6], view) == [255] * 5
    assert shown([1e38, math.inf, math.nan], view, exposure=200) == [255, 255, 0]
    assert shown([1e-45, 0.0], view, exposure=-200) == [0, 0]


@pytest.mark.parametrize("view", VIEWS)
def test_more_light_never_looks_darker(view: str) -> None:
    values = shown(np.geomspace(1e-4, 1e6, 5000).tolist(), view)
    assert np.all(np.diff(values) >= 0) and values[0] == 0 and values[-1] == 255


def test_exposure_counts_stops() -> None:
    assert shown([0.045], exposure=2) == shown([0.18]) == [118]
    assert shown([0.72], exposure=-2) == [118]
    assert shown([0.09], exposure=1) == shown([0.18 * 2**0.5], exposure=-0.5) == [118]


def test_reinhard_is_equation_4() -> None:
    """White is L = 16, so L = 1 becomes (1 + 1/256)/2; a coloured pixel keeps the ratios of its channels."""
    greys = np.array([0.18, 1, 4, 16])
    exact = srgb_float64(greys * (1 + greys / 256) / (1 + greys))
    assert shown(greys.tolist(), "reinhard") == np.floor(255 * exact + 0.5).tolist()
    assert shown([16.0], "reinhard") == [255]
    colour = np.array([[[0.4, 1.2, 2.0]]], np.float32)
    luminance = 0.2126 * 0.4 + 0.7152 * 1.2 + 0.0722 * 2
    expected = srgb_float64(np.array([0.4, 1.2, 2.0]) * (1 + luminance / 256) / (1 + luminance))
    assert to_display(colour, "reinhard")[0, 0].tolist() == np.floor(255 * expected + 0.5).tolist()


def test_unknown_view_is_a_usage_error() -> None:
    with pytest.raises(UsageError, match="no view transform 'srbg'.*did you mean srgb"):
        to_display(np.zeros((1, 1, 3), np.float32), "srbg")
