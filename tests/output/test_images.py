"""Images are written and read back exactly, and write failures leave the old file."""

from __future__ import annotations

import math
import os
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from numpy.typing import NDArray

from clrt.errors import OutputError, UsageError
from clrt.output.images import RGBE_MAX, check_writable, read_image, rgbe_rounded, write_image
from clrt.output.row_writer import write_rows
from clrt.output.view_transform import to_display

FloatArray = NDArray[np.float32]

LAYOUTS: dict[str, Callable[[FloatArray], FloatArray]] = {
    "contiguous": lambda a: a,
    "transposed": lambda a: a.transpose(1, 0, 2),
    "upside down": lambda a: a[::-1],
    "mirrored": lambda a: a[:, ::-1],
    "channels reversed": lambda a: a[..., ::-1],
    "every second": lambda a: a[1::2, ::3],
    "three of four channels": lambda a: np.concatenate([a, a[..., :1]], axis=2)[..., :3],
    "column-major": np.asfortranarray,
    "one pixel": lambda a: a[5:6, 7:8],
}


def noise(seed: int = 0) -> FloatArray:
    """Return (21, 34, 3) noise of many magnitudes and both signs."""
    rng = np.random.default_rng(seed)
    return (rng.normal(size=(21, 34, 3)) * 10.0 ** rng.uniform(-6, 6, (21, 34, 1))).astype(np.float32)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_exr_keeps_every_bit(tmp_path: Path, layout: str) -> None:
    pixels = noise()
    pixels[5, 7] = np.nan, np.inf, -np.inf
    pixels[0, :4, 0] = 1e38, -0.0, 1e-45, np.finfo(np.float32).max
    picture = LAYOUTS[layout](pixels)
    write_image(tmp_path / "a.exr", picture)
    back = read_image(tmp_path / "a.exr")
    assert back.dtype == np.float32 and back.shape == picture.shape
    assert np.array_equal(back.view(np.uint32), np.ascontiguousarray(picture).view(np.uint32))


@pytest.mark.parametrize("layout", LAYOUTS)
def test_png_holds_the_view_exactly(tmp_path: Path, layout: str) -> None:
    picture = LAYOUTS[layout](noise() % 2)
    write_image(tmp_path / "a.PNG", picture, view="reinhard", exposure=-0.5)
    assert np.array_equal(png_samples(tmp_path / "a.PNG"), to_display(picture, "reinhard", -0.5))


def test_png_is_srgb_unless_told_otherwise(tmp_path: Path) -> None:
    write_image(tmp_path / "grey.png", np.full((3, 2, 3), 0.18, np.float32))
    assert b"\0\0\0\1sRGB" in (tmp_path / "grey.png").read_bytes()
    assert png_samples(tmp_path / "grey.png").tolist() == np.full((3, 2, 3), 118).tolist()
    assert read_image(tmp_path / "grey.png") == pytest.approx(0.18, abs=0.5 / 255)


def png_samples(path: Path) -> NDArray[np.uint8]:
    """Decode an 8-bit RGB PNG by hand (RFC 2083), independently of any library that might share the writer's errors."""
    data, at, body = path.read_bytes(), 8, b""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        chunk = data[at + 8 : at + 8 + length]
        assert struct.unpack(">I", data[at + 8 + length : at + 12 + length])[0] == zlib.crc32(kind + chunk)
        if kind == b"IHDR":
            width, height, *form = struct.unpack(">IIBBBBB", chunk)
            assert form == [8, 2, 0, 0, 0]
        body += chunk if kind == b"IDAT" else b""
        at += 12 + length
    rows = np.frombuffer(zlib.decompress(body), np.uint8).reshape(height, 1 + 3 * width)
    picture = np.zeros((height + 1, width + 1, 3), np.int64)  # a border of zeros above and to the left
    for y, row in enumerate(rows, start=1):
        for x, sample in enumerate(row[1:].reshape(width, 3).astype(np.int64), start=1):
            left, up, corner = picture[y, x - 1], picture[y - 1, x], picture[y - 1, x - 1]
            estimate = left + up - corner
            distances = np.stack([abs(estimate - left), abs(estimate - up), abs(estimate - corner)])
            paeth = np.choose(distances.argmin(axis=0), [left, up, corner])
            picture[y, x] = (sample + [0 * left, left, up, (left + up) // 2, paeth][row[0]]) % 256
    return picture[1:, 1:].astype(np.uint8)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_hdr_is_the_nearest_rgbe(tmp_path: Path, layout: str) -> None:
    """A pixel whose maximum is in [2^(e-1), 2^e) is stored in steps of 2^(e-8), so the nearest value is within half a
    step, or half of the next exponent's step if the maximum rounds up to 2^e: in either case at most max/255."""
    picture = LAYOUTS[layout](abs(noise()))
    write_image(tmp_path / "a.hdr", picture)
    error = abs(read_image(tmp_path / "a.hdr").astype(np.float64) - picture)
    largest = picture.max(axis=-1, keepdims=True).astype(np.float64)
    assert np.all(error <= largest / 255)
    ordinary = largest < 255.5 / 256 * 2.0 ** np.frexp(largest)[1]
    assert np.all((error <= 2.0 ** (np.frexp(largest)[1] - 9))[ordinary[..., 0]])


def test_hdr_does_not_darken(tmp_path: Path) -> None:
    """Rounding errors are symmetric: the mean over 30 000 values in [0.5, 1) in steps of 1/256 is within 5 sigma."""
    picture = np.random.default_rng(4).uniform(0.5, 0.99, (100, 100, 3)).astype(np.float32)
    write_image(tmp_path / "a.hdr", picture)
    mean_error = np.mean(read_image(tmp_path / "a.hdr").astype(np.float64) - picture)
    assert abs(mean_error) < 5 / 256 / np.sqrt(12 * picture.size)


def test_hdr_of_what_rgbe_lacks(tmp_path: Path) -> None:
    picture = np.array([[[np.nan, 1, -1], [np.inf, 1, 1], [3e38, 0, 0], [0, 0, 0], [1e-38, 0, 0]]], np.float32)
    write_image(tmp_path / "a.hdr", picture)
    expected = [[0, 1, 0], [RGBE_MAX, 0, 0], [RGBE_MAX, 0, 0], [0, 0, 0], [0, 0, 0]]
    assert read_image(tmp_path / "a.hdr").tolist() == [expected]


def test_rgbe_rounding_is_stable() -> None:
    once = rgbe_rounded(abs(noise()))
    assert np.array_equal(rgbe_rounded(once), once)


def test_hdr_file_is_radiance(tmp_path: Path) -> None:
    write_image(tmp_path / "a.hdr", noise())
    assert (tmp_path / "a.hdr").read_bytes().startswith(b"#?RADIANCE\n")


@pytest.mark.parametrize("extension", ["exr", "png"])
def test_metadata_survives(tmp_path: Path, extension: str) -> None:
    metadata = {"clrt:scene": "scenes/café.toml", "clrt:spp": "64", "clrt:device": 'pthread-Xeon "E5"'}
    write_image(tmp_path / f"a.{extension}", noise(), metadata=metadata)
    spec = oiio.ImageBuf(str(tmp_path / f"a.{extension}")).spec()
    assert {name: spec.getattribute(name) for name in metadata} == metadata


def test_exr_is_compressed_float(tmp_path: Path) -> None:
    write_image(tmp_path / "a.exr", np.zeros((64, 64, 3), np.float32))
    spec = oiio.ImageBuf(str(tmp_path / "a.exr")).nativespec()
    assert (str(spec.format), spec.getattribute("compression"), spec.channelnames) == ("float", "zip", ("R", "G", "B"))
    assert (tmp_path / "a.exr").stat().st_size < 4096


@pytest.mark.parametrize(
    "name, message",
    [
        ("picture.pgn", r"picture\.pgn: unknown image format \.pgn; use .*did you mean .*picture\.png\?"),
        ("picture.xyz", r"unknown image format \.xyz; use \.png, .*, \.tiff or \.webp$"),
        ("picture", r"the name has no extension; use"),
        ("missing/deeper/a.png", r"the folder .*missing/deeper does not exist; create it first"),
        ("folder.png", r"folder\.png: is a folder; choose a file in it"),
        ("/proc/picture.png", r"/proc/picture\.png: no file can be written in the folder /proc \("),
        ("file.png/a.png", r"the folder .*file\.png does not exist"),
    ],
)
def test_unwritable_paths_are_refused_before_and_while_writing(tmp_path: Path, name: str, message: str) -> None:
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "file.png").write_text("")
    for refused in (check_writable, lambda path: write_image(path, noise())):
        with pytest.raises(OutputError, match=message):
            refused(tmp_path / name)
    assert sorted(os.listdir(tmp_path)) == ["file.png", "folder.png"]


def test_checking_leaves_nothing_behind(tmp_path: Path) -> None:
    (tmp_path / "old.png").write_text("old")
    for name in ("new.exr", "old.png", "NEW.HDR"):
        check_writable(tmp_path / name)
    assert os.listdir(tmp_path) == ["old.png"] and (tmp_path / "old.png").read_text() == "old"


def test_unknown_views_and_exposures_write_nothing(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="view transform .* is unknown"):
        write_image(tmp_path / "a.png", noise(), view="film")
    for exposure in (math.nan, math.inf, -math.inf):
        with pytest.raises(UsageError, match="exposure is .*; it must be a finite number"):
            write_image(tmp_path / "a.png", noise(), exposure=exposure)
    assert not os.listdir(tmp_path)


FULL_DISK = """
import resource, signal, sys
from pathlib import Path
import numpy as np
from clrt.errors import OutputError
from clrt.output.images import write_image
pixels = np.random.default_rng(0).random((200, 200, 3), dtype=np.float32)
write_image(Path(sys.argv[1]), pixels[:2, :2])  # loads the library before files become short
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
try:
    write_image(Path(sys.argv[2]), pixels)
except OutputError as error:
    print(error)
"""


@pytest.mark.parametrize("extension", ["exr", "hdr", "png"])
def test_a_failing_write_leaves_the_old_picture(tmp_path: Path, extension: str) -> None:
    """Files are limited to 20 kB, as on a full disk; the image needs more in every format."""
    path = tmp_path / f"a.{extension}"
    path.write_text("the old picture")
    (tmp_path / "elsewhere").mkdir()
    result = subprocess.run(
        [sys.executable, "-c", FULL_DISK, tmp_path / "elsewhere" / f"warm.{extension}", path],
        capture_output=True,
        text=True,
        check=True,
    )
    assert result.stdout.startswith(f"{path}: cannot be written (") and "choose another path" in result.stdout
    assert result.stderr == ""
    assert path.read_text() == "the old picture"
    assert sorted(os.listdir(tmp_path)) == sorted([path.name, "elsewhere"])


@pytest.mark.parametrize("extension", ["exr", "hdr", "png"])
def test_a_picture_without_all_its_rows_replaces_nothing(tmp_path: Path, extension: str) -> None:
    path = tmp_path / f"a.{extension}"
    path.write_text("the old picture")
    with pytest.raises(OutputError, match="cannot be written"):
        write_rows(path, (4, 32), [np.zeros((16, 4, 3), np.float32)])
    assert path.read_text() == "the old picture" and os.listdir(tmp_path) == [path.name]


def test_a_picture_gets_the_usual_permissions(tmp_path: Path) -> None:
    write_image(tmp_path / "a.png", noise())
    (tmp_path / "plain").write_text("")
    assert (tmp_path / "a.png").stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "real.exr").write_text("old")
    (tmp_path / "link.exr").symlink_to(tmp_path / "real.exr")
    write_image(tmp_path / "link.exr", noise())
    assert (tmp_path / "link.exr").is_symlink()
    assert np.array_equal(read_image(tmp_path / "real.exr"), noise())


@pytest.mark.parametrize("name, told", [("a.png", True), ("a.hdr", True), ("a.exr", False)])
def test_values_that_are_no_light_are_counted(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, name: str, told: bool
) -> None:
    """They are replaced and counted in .png and .hdr files; an .exr keeps them."""
    flawed = np.array([[[math.nan, math.nan, -1], [-math.inf, math.inf, 0.5], [0, -0.0, 3e38]]], np.float32)
    write_image(tmp_path / name, flawed)
    message = (
        f"{tmp_path / name}: of the image's values, 2 are NaN and 2 negative, written as 0, and 1 infinite, "
        "written as the largest value"
    )
    assert caplog.messages == [message] * told
    write_image(tmp_path / name, np.ones((1, 1, 3), np.float32))
    assert len(caplog.messages) == told
