"""AOVs written to files, read back by the OpenEXR library, and their display colors."""

from __future__ import annotations

import logging
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from numpy.typing import NDArray

import clrt
from clrt.aov_types import channel_names
from clrt.output.aov_files import drawn
from clrt.output.images import read_image, write_image
from clrt.output.view_transform import to_display
from clrt.rendering.aovs import AOVS

SCENE = """
[render]
size = [24, 16]
[environment]
color = [0.5, 0.6, 0.7]
[materials.red]
type = "diffuse"
color = [0.8, 0.1, 0.1]
[[sphere]]
material = "red"
"""


def layers(path: Path) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Return the header and channels of an .exr file."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return dict(file.header()), {name: channel.pixels for name, channel in file.channels().items()}


def run(folder: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    (folder / "ball.toml").write_text(SCENE)
    command = [sys.executable, "-m", "clrt", "render", "ball.toml", "--spp", "4", *map(str, arguments)]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True)


def test_an_exr_has_all_layers_and_what_made_them(tmp_path: Path) -> None:
    """Layers equal the Python arrays exactly, under the names that compositing software expects."""
    (tmp_path / "ball.toml").write_text(SCENE)
    image = clrt.render(tmp_path / "ball.toml", spp=4, aovs=AOVS)
    image.save(tmp_path / "all.exr")
    header, channels = layers(tmp_path / "all.exr")
    expected: dict[str, NDArray[Any]] = {channel: image.pixels[..., i] for i, channel in enumerate("RGB")}
    for name, aov in image.aovs.items():
        for i, channel in enumerate(channel_names(name)):
            expected[channel] = aov if aov.ndim == 2 else aov[..., i]
    assert set(channels) == set(expected)
    for name, values in expected.items():
        assert channels[name].dtype == np.float32
        np.testing.assert_array_equal(channels[name], values, name)
    assert set(channels["object.X"].ravel()) == {-1, 0} and np.isinf(channels["depth.Z"]).any()
    for name in (
        "scene",
        "scene_hash",
        "device",
        "version",
        "spp",
        "seconds",
        "seed",
        "max_depth",
        "integrator",
        "sampler",
        "filter",
        "adaptive",
    ):
        assert header[f"clrt:{name}"] == str(image.report[name])
    assert np.array_equal(read_image(tmp_path / "all.exr"), image.pixels)


def test_numbers_that_float32_has_not_are_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    pixels, ids = np.zeros((1, 2, 3), np.float32), np.array([[1 << 24, -1]], np.int32)
    write_image(tmp_path / "a.exr", pixels, aovs={"object": ids})
    assert not caplog.messages and layers(tmp_path / "a.exr")[1]["object.X"].tolist() == [[1 << 24, -1]]
    with caplog.at_level(logging.WARNING):
        write_image(tmp_path / "a.exr", pixels, aovs={"object": ids + 1})
    assert caplog.messages == ["object: numbers above 16777216 are rounded in an .exr; Image.aovs has the exact ones"]


def test_the_command_writes_them(tmp_path: Path) -> None:
    """They become layers of an .exr, separate files next to a .png, and are omitted for an .hdr."""
    result = run(tmp_path, "--aov", "albedo,depth", "--aov", "object", "-o", "a.exr", "-o", "b.png", "-o", "c.hdr")
    written = ["a.exr", "b.png", "b.albedo.png", "b.depth.png", "b.object.png", "c.hdr"]
    assert (result.returncode, result.stdout.split()) == (0, written), result.stderr
    assert sorted(path.name for path in tmp_path.glob("*.*")) == sorted([*written, "ball.toml"])
    _, channels = layers(tmp_path / "a.exr")
    assert set(channels) == {*"RGB", "albedo.R", "albedo.G", "albedo.B", "depth.Z", "object.X"}
    center = read_image(tmp_path / "b.albedo.png")[8, 12]
    np.testing.assert_allclose(center, (0.8, 0.1, 0.1), atol=0.005)


@pytest.mark.programs
@pytest.mark.needs("pyoidn")
def test_a_denoised_picture_has_them_and_the_raw_one_not(tmp_path: Path) -> None:
    result = run(tmp_path, "--aov", "direct", "--denoise", "-o", "a.exr")
    assert (result.returncode, result.stdout.split()) == (0, ["a.raw.exr", "a.exr"]), result.stderr
    assert set(layers(tmp_path / "a.raw.exr")[1]) == set("RGB")
    assert set(layers(tmp_path / "a.exr")[1]) == {*"RGB", "direct.R", "direct.G", "direct.B"}


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["--aov", "dept"], "AOV 'dept' is unknown; choose from albedo, .*did you mean depth"),
        (["--aov", "depth", "-o", "a.hdr"], "an .hdr file, a video .* cannot store AOVs"),
        (
            ["--aov", "depth", "-o", "a.png", "--reference", "a.depth.png"],
            "a.depth.png: is both the reference and an AOV",
        ),
        (["--aov", "depth", "-o", "a.png", "-o", "a.depth.png"], "a.depth.png: is both an image .* an AOV"),
    ],
    ids=str,
)
def test_mistakes(tmp_path: Path, arguments: list[str], message: str) -> None:
    result = run(tmp_path, *arguments)
    assert result.returncode == 2 and len(result.stderr.splitlines()) == 1
    assert re.search(message, result.stderr), result.stderr
    assert [path.name for path in tmp_path.glob("*.*")] == ["ball.toml"]


def test_how_they_are_drawn() -> None:
    """Checked by hand: signed values are centered at 0.5, near is white, misses are black, ids have distinct colors."""
    vectors = np.array([[[0, 1, -1], [0, 0, 0]]], np.float32)
    assert drawn("normal", vectors, "srgb", 0).tolist() == [[[128, 255, 0], [0, 0, 0]]]
    depth = np.array([[2, 4, np.inf]], np.float32)
    assert drawn("depth", depth, "srgb", 0)[..., 0].tolist() == [[255, 128, 0]]
    assert drawn("samples", np.array([[1, 2]], np.uint32), "srgb", 0)[..., 0].tolist() == [[128, 255]]
    light = np.array([[[0.1, 0.2, 0.4]]], np.float32)
    assert np.array_equal(drawn("indirect", light, "reinhard", 1), to_display(light, "reinhard", 1))
    assert np.array_equal(drawn("variance", light**2, "srgb", 1), to_display(light, "srgb", 1))
    corners = np.array([[[-1, 0, 5], [3, 0, 6]]], np.float32)
    assert drawn("position", corners, "srgb", 0).tolist() == [[[0, 0, 0], [255, 0, 255]]]
    ids = drawn("object", np.arange(-1, 100, dtype=np.int32)[None], "srgb", 0)[0].astype(int)
    assert ids[0].tolist() == [0, 0, 0] and len({tuple(color) for color in ids.tolist()}) == 101
    assert min(np.abs(np.diff(ids, axis=0)).max(axis=1)) > 60


def test_nothing_to_see_is_black() -> None:
    """Images without valid pixels are black and cause no numpy warning."""
    empty = np.full((2, 2), np.inf, np.float32)
    assert not drawn("depth", empty, "srgb", 0).any() and not drawn("samples", 0 * np.ones((2, 2), int), "raw", 0).any()
