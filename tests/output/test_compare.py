"""Image metrics agree with sums computed by hand and with closed forms of FLIP."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.errors import SceneError, UsageError
from clrt.output.image import Image
from clrt.output.image_error import compare, compare_files, relmse
from clrt.output.images import read_image, write_image

needs_flip = pytest.mark.needs("flip_evaluator")
Floats64 = NDArray[np.float64]
Color = tuple[float, float, float]


def picture(*pixels: tuple[float, float, float]) -> NDArray[np.float32]:
    return np.array([pixels], np.float32)


def test_measures_of_two_pixels() -> None:
    """Differences 1 0 2 | 0 -0.5 0 against references 1 2 0 | 0 0.5 3."""
    reference, image = picture((1, 2, 0), (0, 0.5, 3)), picture((2, 2, 2), (0, 0, 3))
    result = compare(image, reference)
    assert result["relmse"] == pytest.approx((1 / 1.01 + 4 / 0.01 + 0.25 / 0.26) / 6, rel=1e-12)
    assert result["rmse"] == pytest.approx(math.sqrt((1 + 4 + 0.25) / 6), rel=1e-12)
    assert result["max_abs"] == 2
    assert result["mean_ratio"] == pytest.approx([2 / 1, 2 / 2.5, 5 / 3], rel=1e-12)
    assert result["nonfinite"] == result["nonfinite_reference"] == 0


@needs_flip
def test_a_picture_equals_itself() -> None:
    image = np.random.default_rng(0).random((16, 16, 3), dtype=np.float32)
    assert compare(image, image) == {
        "relmse": 0,
        "rmse": 0,
        "mean_ratio": [1, 1, 1],
        "flip": 0,
        "max_abs": 0,
        "nonfinite": 0,
        "nonfinite_reference": 0,
    }


def test_a_black_reference_has_no_ratio() -> None:
    result = compare(picture((1, 1, 1)), picture((0, 0, 0)))
    assert result["mean_ratio"] == [None, None, None] and result["relmse"] == pytest.approx(100)
    assert result["flip"] is None


def test_nonfinite_values_are_counted_and_left_out() -> None:
    image = picture((math.nan, 2, 2), (math.inf, -math.inf, 4))
    reference = picture((1, 1, math.inf), (1, 1, 2))
    result = compare(image, reference)
    assert (result["nonfinite"], result["nonfinite_reference"]) == (3, 1)
    # What remains: 2 against 1 in green, 4 against 2 in blue.
    assert result["relmse"] == pytest.approx((1 / 1.01 + 4 / 4.01) / 2, rel=1e-12)
    assert result["mean_ratio"] == [None, 2, 2]
    nothing = compare(image, np.full_like(reference, np.nan))
    assert (nothing["relmse"], nothing["rmse"], nothing["max_abs"]) == (None, None, None)


@pytest.mark.filterwarnings("error")
def test_sums_are_float64() -> None:
    """1e38² exceeds float32's range; a part in 1e8 of the sum of four million pixels exceeds its precision."""
    assert compare(picture((1e38, 0, 0)), picture((0, 0, 0)))["rmse"] == pytest.approx(1e38 / math.sqrt(3), rel=1e-6)
    reference = np.ones((2048, 2048, 3), np.float32)
    image = reference.copy()
    image[7, 7] = 2
    assert relmse(image, reference) == pytest.approx(1 / 1.01 / 2048**2, rel=1e-12)


@needs_flip
def test_flip_depends_on_how_much_is_wrong() -> None:
    reference = np.random.default_rng(0).random((32, 32, 3), dtype=np.float32)
    for hdr in (False, True):
        near, far = (compare(reference * np.float32(gain), reference, hdr=hdr)["flip"] for gain in (1.05, 1.5))
        assert 0 < near < far < 1


@needs_flip
def test_ldr_flip_of_black_and_white_is_one() -> None:
    """FLIP scales the largest color difference to 1 (Andersson et al. 2020); black and white are close to it."""
    white = np.ones((64, 64, 3), np.float32)
    assert compare(0 * white, white, hdr=False)["flip"] == pytest.approx(1, abs=0.05)
    assert compare(5 * white, white, hdr=False)["flip"] == 0


def flip_of_colors(x: Floats64, r: Floats64) -> float:
    """LDR-FLIP of two uniform images of linear Rec. 709 colors in [0, 1] (Andersson et al. 2020, sections 4.1 and 4.3).

    Filters and features have no effect on them, so it is the HyAB distance in Hunt-adjusted L*a*b*, redistributed.
    """
    to_xyz = np.array(
        [
            [0.41239079926595934, 0.357584339383878, 0.1804807884018343],
            [0.21263900587151027, 0.715168678767756, 0.07219231536073371],
            [0.01933081871559182, 0.11919477979462598, 0.9505321522496607],
        ]
    )

    def hunt(linear: Floats64) -> Floats64:
        t = to_xyz @ linear / to_xyz.sum(axis=1)
        f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t / (3 * (6 / 29) ** 2) + 4 / 29)
        lightness = 116 * f[1] - 16
        return np.array([lightness, 0.01 * lightness * 500 * (f[0] - f[1]), 0.01 * lightness * 200 * (f[1] - f[2])])

    def distance(a: Floats64, b: Floats64) -> float:
        difference = hunt(a) - hunt(b)
        return float((abs(difference[0]) + math.hypot(*difference[1:])) ** 0.7)

    most = distance(np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    knee, found = 0.4 * most, distance(x, r)
    return 0.95 * found / knee if found < knee else 0.95 + 0.05 * (found - knee) / (most - knee)


def aces(x: Floats64) -> Floats64:
    """Tone mapper of HDR-FLIP (Andersson et al. 2021, section 4)."""
    return np.asarray((0.36 * 2.51 * x**2 + 0.6 * 0.03 * x) / (0.36 * 2.43 * x**2 + 0.6 * 0.59 * x + 0.14))


COLORS = [(0.2, 0.5, 0.1), (0.21, 0.5, 0.1), (0.9, 0.1, 0.4), (0.02, 0.02, 0.03), (1.0, 1.0, 1.0)]


@needs_flip
@pytest.mark.parametrize("image, reference", [(a, b) for a in COLORS for b in COLORS if a != b], ids=str)
def test_flip_of_even_pictures_has_a_closed_form(image: Color, reference: Color) -> None:
    """For HDR-FLIP there is then one exposure, which maps the reference's luminance to where aces is 0.85."""
    x, r = np.array(image), np.array(reference)
    pictures = [np.full((32, 32, 3), color, np.float32) for color in (x, r)]
    assert compare(*pictures, hdr=False)["flip"] == pytest.approx(flip_of_colors(x, r), abs=2e-4)
    shown = np.roots([0.36 * (2.51 - 0.85 * 2.43), 0.6 * (0.03 - 0.85 * 0.59), -0.85 * 0.14]).max()
    gain = shown / (r @ [0.2126, 0.7152, 0.0722])
    toned = [np.clip(aces(gain * color), 0, 1) for color in (x, r)]
    assert compare(*pictures)["flip"] == pytest.approx(flip_of_colors(*toned), abs=2e-4)


@needs_flip
@pytest.mark.parametrize(
    "first, second, hdr", [("a.png", "b.png", False), ("a.exr", "b.png", True), ("a.png", "b.hdr", True)]
)
def test_files(tmp_path: Path, first: str, second: str, hdr: bool) -> None:
    rng = np.random.default_rng(1)
    write_image(tmp_path / first, rng.random((16, 16, 3), dtype=np.float32))
    write_image(tmp_path / second, rng.random((16, 16, 3), dtype=np.float32))
    result = compare_files(tmp_path / first, tmp_path / second)
    image, reference = read_image(tmp_path / first), read_image(tmp_path / second)
    assert result == compare(image, reference, hdr=hdr)
    assert result["flip"] != compare(image, reference, hdr=not hdr)["flip"]
    assert result == compare(tmp_path / first, Image(reference, {}), hdr=hdr)


@pytest.mark.parametrize("wrong", [None, np.zeros((2, 2), np.float32), 3.0, [[0.0, 0.0, 0.0]]], ids=str)
def test_what_is_no_picture(wrong: Any) -> None:
    with pytest.raises(UsageError, match="the reference is .* give such an array, a clrt.Image or the path"):
        compare(picture((1, 1, 1)), wrong)


def test_sizes_must_agree(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="the image has 4x2 pixels, the reference 4x3;"):
        compare(np.zeros((2, 4, 3), np.float32), np.zeros((3, 4, 3), np.float32))
    write_image(tmp_path / "small.exr", np.zeros((2, 4, 3), np.float32))
    write_image(tmp_path / "large.png", np.zeros((20, 40, 3), np.float32))
    with pytest.raises(SceneError, match=r"small\.exr has 4x2 pixels, .*large\.png 40x20"):
        compare_files(tmp_path / "small.exr", tmp_path / "large.png")
