"""Plots show the curve, on log-log axes where powers of time are straight lines."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.errors import OutputError
from clrt.formats.images.image_reader import linear_from_srgb
from clrt.output.error_plots import check_plot, plot_errors, plot_history
from clrt.output.images import read_image

#: The first two colors of matplotlib's cycle.
BLUE, ORANGE = (0x1F, 0x77, 0xB4), (0xFF, 0x7F, 0x0E)
TIMES = [1.0, 3.0, 10.0, 30.0, 100.0]


def curve_pixels(path: Path, colour: tuple[int, int, int]) -> NDArray[np.int64]:
    """Return (n, 2) rows and columns of a curve's pixels, without the legend at the top right."""
    pixels = read_image(path)
    wanted = linear_from_srgb(np.array(colour, np.float32) / np.float32(255))
    near = np.abs(np.subtract(pixels, wanted)).max(-1) < 0.02
    height, width = near.shape
    near[: height // 3, width // 2 :] = False
    return np.argwhere(near)


@pytest.mark.parametrize(("power", "bend"), [(0.5, False), (0.9, False), (0.5, True)])
def test_powers_of_time_are_straight_lines(tmp_path: Path, power: float, bend: bool) -> None:
    """Straight up to the width of line and markers; a curve that levels off at a bias bends far more."""
    errors = [0.1 * seconds**-power + 0.02 * bend for seconds in TIMES]
    plot_errors(tmp_path / "a.png", {"scene": {"one": list(zip(TIMES, errors))}})
    rows, columns = curve_pixels(tmp_path / "a.png", BLUE).T
    assert np.ptp(columns) > 300
    residuals = rows - np.polyval(np.polyfit(columns, rows, 1), columns)
    assert rows[columns.argmax()] - rows[columns.argmin()] > 100, "errors fall to the right"
    assert np.abs(residuals).max() > 20 if bend else np.abs(residuals).max() < 8


def test_history_has_an_estimate_and_true_errors(tmp_path: Path) -> None:
    """The true error, four times the estimated one, lies above it everywhere."""
    history: list[dict[str, Any]] = [{"spp": 1, "seconds": 0.5, "noise": None, "relmse": 4.0}]
    history += [
        {"spp": 2, "seconds": seconds, "noise": 0.1 / seconds, "relmse": (0.4 / seconds) ** 2} for seconds in TIMES
    ]
    assert plot_history(tmp_path / "h.png", "ball", history) == tmp_path / "h.png"
    estimate, true = (curve_pixels(tmp_path / "h.png", colour) for colour in (BLUE, ORANGE))
    assert true[:, 1].min() < estimate[:, 1].min() - 10, "without an estimate there is still a true error"
    for column in range(estimate[:, 1].min() + 20, estimate[:, 1].max() - 20, 10):
        above, below = (pixels[pixels[:, 1] == column, 0] for pixels in (true, estimate))
        assert not above.size or above.mean() < below.mean() - 20


def test_nothing_to_draw_and_other_formats_are_fine(tmp_path: Path) -> None:
    plot_errors(tmp_path / "a.svg", {"black": {"none": [], "zero": [(1.0, 0.0)]}, "two": {"one": [(1.0, 0.1)]}})
    svg = (tmp_path / "a.svg").read_text()
    assert "<svg" in svg and not list(tmp_path.glob(".clrt-*"))
    plot_errors(tmp_path / "a.pdf", {"": {}})
    assert (tmp_path / "a.pdf").read_bytes().startswith(b"%PDF")
    with pytest.raises(OutputError, match=r"a\.txt: plots are written as \.png, \.svg or \.pdf"):
        check_plot(tmp_path / "a.txt")


@pytest.mark.parametrize("command", [["render", "a.toml"], ["bench", "converge", "a.toml"]])
def test_missing_matplotlib_is_told_first(command: list[str], tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text("no scene")
    program = f"""
import sys
sys.modules["matplotlib"] = None
from clrt.cli import main
main({[*command, "--plot", "plot.png"]!r})
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 2 and "pip install matplotlib" in done.stderr and "Traceback" not in done.stderr
