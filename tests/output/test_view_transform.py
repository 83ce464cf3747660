"""View transforms match the published curves in float64, known values, and OpenColorIO."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import PyOpenColorIO
import pytest
from numpy.typing import NDArray

from clrt.errors import UsageError
from clrt.formats.images.image_reader import linear_from_srgb
from clrt.output.ocio import ACES, ocio_view
from clrt.output.view_transform import VIEWS, to_display, view_called

#: Views that tint gray slightly: the rows of their matrices sum to 1 only to about 1e-4.
TINTED = ("agx", "aces")
#: All views of linear light that need no user config.
ALL_VIEWS = (*VIEWS, "aces")


def shown(values: list[float], view: str = "srgb", exposure: float = 0.0) -> list[int]:
    """Return display values of gray pixels; all channels must agree, up to 1 for the tinted views."""
    grey = np.array(values, np.float32).reshape(1, -1, 1).repeat(3, axis=2)
    display = to_display(grey, view, exposure)
    assert display.dtype == np.uint8 and display.shape == grey.shape
    assert np.all(np.abs(display.astype(int) - display[..., :1]) <= (view in TINTED))
    return [int(value) for value in display[0, :, 0]]


def srgb_float64(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the sRGB transfer function of IEC 61966-2-1."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def test_known_values() -> None:
    assert shown([0, 0.18, 0.2158605, 0.5, 1, 2]) == [0, 118, 128, 188, 255, 255]
    assert shown([0, 0.18, 0.5, 1, 2], "raw") == [0, 46, 128, 255, 255]


@pytest.mark.parametrize(
    "view, signal",
    [
        ("srgb", 1.055 * 0.18 ** (1 / 2.4) - 0.055),
        ("raw", 0.18),
        ("pbr_neutral", 1.055 * 0.14 ** (1 / 2.4) - 0.055),
        ("agx", 0.5),
        ("aces", 0.349188),
    ],
)
def test_grey_card(view: str, signal: float) -> None:
    """Values: sRGB of 0.18; sRGB of 0.14, which Khronos's offset of 0.04 leaves; AgX's pivot; OpenColorIO's."""
    card = np.full((1, 1, 3), 0.18, np.float32)
    assert view_called(view)(card)[0, 0] == pytest.approx([signal] * 3, abs=5e-5)


def test_srgb_follows_the_closed_form_everywhere() -> None:
    linear = np.linspace(0, 1, 300_001, dtype=np.float32)
    exact = 255 * srgb_float64(linear.astype(np.float64))
    display = to_display(linear.reshape(1, -1, 1).repeat(3, axis=2))[0, :, 0]
    # Near a rounding boundary float32 may fall on either side: 1e-4 is within 1e-6 of full scale, in units of 1/255.
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


@pytest.mark.parametrize("view", ALL_VIEWS)
@pytest.mark.filterwarnings("error")
def test_what_is_no_light_is_black_and_too_much_is_white(view: str) -> None:
    assert shown([math.nan, -math.inf, -1, -1e38, -0.0, 0], view) == [0] * 6
    assert shown([math.inf, 1e38, 3.4e38, 1e15, 1e6], view) == [255] * 5
    assert shown([1e38, math.inf, math.nan], view, exposure=200) == [255, 255, 0]
    assert shown([1e-45, 0.0], view, exposure=-200) == [0, 0]


@pytest.mark.parametrize("view", ALL_VIEWS)
def test_more_light_never_looks_darker(view: str) -> None:
    values = shown(np.geomspace(1e-5, 1e6, 5000).tolist(), view)
    assert np.all(np.diff(values) >= 0) and values[0] == 0 and values[-1] == 255


@pytest.mark.parametrize("view", ALL_VIEWS)
@pytest.mark.filterwarnings("error")
def test_every_colour_has_a_signal(view: str) -> None:
    """Any brightness per channel gives a finite signal, also with one dark channel and others at maximum."""
    levels = np.array([0, 1e-45, 1e-20, 1e-4, 0.05, 0.18, 0.76, 1, 5, 1e4, 1e15], np.float32)
    colors = np.stack(np.meshgrid(levels, levels, levels), axis=-1).reshape(1, -1, 3)
    signal = view_called(view)(colors)
    assert np.isfinite(signal).all() and signal.shape == colors.shape and signal.dtype == np.float32


def test_exposure_counts_stops() -> None:
    assert shown([0.045], exposure=2) == shown([0.18]) == [118]
    assert shown([0.72], exposure=-2) == [118]
    assert shown([0.09], exposure=1) == shown([0.18 * 2**0.5], exposure=-0.5) == [118]


def test_reinhard_is_equation_4() -> None:
    """White is L = 16, so L = 1 becomes (1 + 1/256)/2; a colored pixel keeps the ratios of its channels."""
    greys = np.array([0.18, 1, 4, 16])
    exact = srgb_float64(greys * (1 + greys / 256) / (1 + greys))
    assert shown(greys.tolist(), "reinhard") == np.floor(255 * exact + 0.5).tolist()
    assert shown([16.0], "reinhard") == [255]
    colour = np.array([[[0.4, 1.2, 2.0]]], np.float32)
    luminance = 0.2126 * 0.4 + 0.7152 * 1.2 + 0.0722 * 2
    expected = srgb_float64(np.array([0.4, 1.2, 2.0]) * (1 + luminance / 256) / (1 + luminance))
    assert to_display(colour, "reinhard")[0, 0].tolist() == np.floor(255 * expected + 0.5).tolist()


def khronos(color: list[float]) -> list[float]:
    """Return PBRNeutralToneMapping of the specification, statement by statement, for one color."""
    start, desaturation = 0.8 - 0.04, 0.15
    x = min(color)
    offset = x - 6.25 * x * x if x < 0.08 else 0.04
    color = [c - offset for c in color]
    peak = max(color)
    if peak < start:
        return color
    d = 1.0 - start
    new_peak = 1.0 - d * d / (peak + d - start)
    color = [c * new_peak / peak for c in color]
    g = 1.0 - 1.0 / (desaturation * (peak - new_peak) + 1.0)
    return [c + g * (new_peak - c) for c in color]


def test_pbr_neutral_is_khronos_s() -> None:
    colors = np.exp2(np.random.default_rng(0).uniform(-12, 8, (1, 2000, 3))).astype(np.float32)
    expected = srgb_float64(np.array([khronos(color) for color in colors[0].tolist()]))
    np.testing.assert_allclose(view_called("pbr_neutral")(colors)[0], expected, atol=2e-6)


def test_agx_is_the_published_table() -> None:
    """Entries of AgX_Default_Contrast.spi1d in github.com/sobotka/AgX, of 4096 from 2^-12.47393 to 2^4.026069, applied
    to colors after the published matrix."""
    table = {
        300: 0.0054006,
        819: 0.024569,
        1365: 0.0810636,
        2000: 0.271826,
        2400: 0.4600463,
        2482: 0.5000888,
        2600: 0.5577078,
        3000: 0.7468467,
        3500: 0.9180099,
        4000: 0.9925869,
    }
    inset = np.array(
        [
            [0.842479062253094, 0.0784335999999992, 0.0792237451477643],
            [0.0423282422610123, 0.878468636469772, 0.0791661274605434],
            [0.0423756549057051, 0.0784336, 0.879142973793104],
        ]
    )
    entries = np.array(list(table))
    tristimuli = np.exp2(entries / 4095 * (4.026069 + 12.47393) - 12.47393)
    rows = np.stack([tristimuli, tristimuli, tristimuli], axis=1)
    rows[:, 1] *= 1.02
    colors = (rows @ np.linalg.inv(inset).T)[None]
    signal = view_called("agx")(colors.astype(np.float32))[0]
    np.testing.assert_allclose(signal[:, 0], list(table.values()), atol=2e-5)
    np.testing.assert_allclose(signal[:, 2], list(table.values()), atol=2e-5)


def test_aces_is_opencolorio_s() -> None:
    config = PyOpenColorIO.Config.CreateFromFile(ACES[0])
    display, _, view = ACES[1].partition("/")
    expected = np.exp2(np.random.default_rng(0).uniform(-10, 8, (1, 2000, 3))).astype(np.float32)
    found = view_called("aces")(expected)
    transform = PyOpenColorIO.DisplayViewTransform("Linear Rec.709 (sRGB)", display, view)
    config.getProcessor(transform).getDefaultCPUProcessor().applyRGB(expected)
    np.testing.assert_allclose(found, expected, atol=1e-5)


@pytest.fixture
def own_config(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the path of a user config, named by $OCIO, with its own views: square root and cube root."""
    config = PyOpenColorIO.Config()
    config.setVersion(2, 0)
    for name, power in (("Linear Rec.709", 1.0), ("cube root", 1 / 3), ("square root", 1 / 2)):
        space = PyOpenColorIO.ColorSpace(name=name)
        if power != 1:
            space.setTransform(
                PyOpenColorIO.ExponentTransform([power, power, power, 1]), PyOpenColorIO.COLORSPACE_DIR_FROM_REFERENCE
            )
        config.addColorSpace(space)
    for role in ("scene_linear", "default"):
        config.setRole(role, "Linear Rec.709")
    config.addDisplayView("Screen", "Plain", "square root")
    config.addDisplayView("Screen", "Filmic", "cube root")
    config.addDisplayView("Other", "Plain", "cube root")
    path = tmp_path / "config.ocio"
    path.write_text(config.serialize())
    monkeypatch.setenv("OCIO", str(path))
    return path


def test_views_of_a_config_of_ones_own(own_config: Path) -> None:
    for view, power in (("ocio", 1 / 2), ("ocio:Plain", 1 / 2), ("ocio:Filmic", 1 / 3), ("ocio:Other/Plain", 1 / 3)):
        expected = [math.floor(255 * value**power + 0.5) for value in (1 / 16, 1 / 4)]
        assert shown([0.125, 0.5], view, exposure=-1) == expected
    told = (
        "config.ocio: view 'Flimic' is unknown; Screen has Plain, Filmic, others are named DISPLAY/VIEW for "
        "Screen, Other; did you mean ocio:Filmic"
    )
    with pytest.raises(UsageError, match=told):
        view_called("ocio:Flimic")


def test_configs_that_are_none(own_config: Path) -> None:
    own_config.with_name("broken.ocio").write_text("[")
    own_config.with_name("other.ocio").write_text(own_config.read_text().replace("Linear Rec.709", "film"))
    for name, message in (
        ("broken", "is not a usable OpenColor"),
        ("missing", "is not a usable OpenColor"),
        ("other", "has no colour space called lin_rec709"),
    ):
        with pytest.raises(UsageError, match=f"{name}.ocio: {message}"):
            ocio_view(str(own_config.with_name(f"{name}.ocio")), "")


def test_unknown_view_is_a_usage_error() -> None:
    with pytest.raises(UsageError, match="view transform 'srbg' is unknown.*did you mean srgb"):
        to_display(np.zeros((1, 1, 3), np.float32), "srbg")
