"""Images of every format are read as linear RGB, and unusable ones raise errors."""

from __future__ import annotations

import os
import signal
import struct
import time
import zlib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import imageio.v3 as imageio
import numpy as np
import OpenEXR
import OpenImageIO as oiio
import pytest
from numpy.typing import NDArray
from PIL import Image

from clrt.errors import SceneError
from clrt.formats import decoder
from clrt.formats.images.image_reader import read_picture, read_texels
from clrt.formats.images.radiance_hdr import read_radiance
from clrt.output.images import rgbe_rounded, write_image

FloatArray = NDArray[np.float32]


def noise(*shape: int) -> FloatArray:
    return np.random.default_rng(0).random(shape, dtype=np.float32)


def stored(path: Path, pixels: FloatArray, **spec_fields: object) -> None:
    """Write any channels and windows directly with OpenImageIO."""
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], "float")
    for name, value in spec_fields.items():
        setattr(spec, name, value)
    output = oiio.ImageOutput.create(str(path))
    assert output is not None
    assert output.open(str(path), spec) and output.write_image(np.ascontiguousarray(pixels)) and output.close()


@pytest.mark.parametrize(
    "name, content, message",
    [
        ("none.exr", None, "no such picture file"),
        ("empty.exr", b"", "empty"),
        ("noise.png", b"\x00\x01garbage" * 50, "cannot be decoded"),
        ("text.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 50000 +X 50000\n\x02\x02", "cannot be decoded"),
        ("raw.exr", b"v/1\x01\x02\x00\x00\x00\xff\xfe\xfd", "cannot be decoded"),
    ],
)
def test_unreadable_pictures_are_scene_errors(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], name: str, content: bytes | None, message: str
) -> None:
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(SceneError, match=message) as caught:
        read_picture(path)
    assert str(path) in str(caught.value)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("extension", ["exr", "hdr", "png"])
def test_cut_off_pictures_are_scene_errors(tmp_path: Path, extension: str) -> None:
    path = tmp_path / f"a.{extension}"
    write_image(path, noise(21, 34, 3))
    whole = path.read_bytes()
    for length in range(1, len(whole) - 16, len(whole) // 12):
        path.write_bytes(whole[:length])
        with pytest.raises(SceneError, match="cannot be decoded"):
            read_picture(path)


def test_channels_are_found_by_name(tmp_path: Path) -> None:
    layers = noise(21, 34, 5)
    stored(tmp_path / "grey.exr", layers[..., :1], channelnames=("Y",))
    assert np.array_equal(read_picture(tmp_path / "grey.exr"), layers[..., [0, 0, 0]])
    stored(tmp_path / "layers.exr", layers, channelnames=("A", "B", "G", "R", "Z"))
    assert np.array_equal(read_picture(tmp_path / "layers.exr"), layers[..., [3, 2, 1]])
    stored(tmp_path / "normals.exr", layers[..., :3], channelnames=("N.X", "N.Y", "N.Z"))
    with pytest.raises(SceneError, match=r"normals\.exr: has channels N\.X, N\.Y, N\.Z instead of R"):
        read_picture(tmp_path / "normals.exr")


def test_alpha_does_not_darken_a_png(tmp_path: Path) -> None:
    rgba = np.full((2, 2, 4), 118, np.uint8)
    rgba[..., 3] = [[0, 1], [128, 255]]
    imageio.imwrite(tmp_path / "a.png", rgba)
    assert read_picture(tmp_path / "a.png") == pytest.approx(((118 / 255 + 0.055) / 1.055) ** 2.4, rel=1e-6)


@pytest.mark.parametrize("left, top", [(3, 2), (-3, 2), (0, -4), (30, 1)])
def test_data_windows(left: int, top: int, tmp_path: Path) -> None:
    """Pixels are placed in the display window, black where there are none, and cut where they exceed it."""
    pixels = noise(7, 9, 3) + 1
    stored(tmp_path / "a.exr", pixels, x=left, y=top, full_x=0, full_y=0, full_width=12, full_height=8)
    expected = np.zeros((8, 12, 3), np.float32)
    for y, x in np.ndindex(7, 9):
        if 0 <= y + top < 8 and 0 <= x + left < 12:
            expected[y + top, x + left] = pixels[y, x]
    if expected.any():
        np.testing.assert_array_equal(read_picture(tmp_path / "a.exr"), expected)
        return
    with pytest.raises(SceneError, match="its data window is outside its display window"):
        read_picture(tmp_path / "a.exr")


def exr(path: Path, *parts: tuple[str, dict[str, NDArray[np.generic]]], kind: object = OpenEXR.scanlineimage) -> Path:
    """Write parts by name, each with channels by name, as OpenEXR's own library does."""
    header = {"type": kind, "tiles": OpenEXR.TileDescription()} if kind == OpenEXR.tiledimage else {"type": kind}
    OpenEXR.File([OpenEXR.Part({**header, "name": name}, dict(channels)) for name, channels in parts]).write(str(path))
    return path


def test_layers_and_parts_of_exr_files(tmp_path: Path) -> None:
    """The layer of the whole image is read, or the only one of colors; several others are an error that names them."""
    plain = dict(zip("RGB", noise(3, 4, 5)))
    other = {name: values + 1 for name, values in plain.items()}
    depth = {"Z": noise(4, 5)}
    pixels = np.stack(list(plain.values()), axis=-1)

    def layer(name: str, channels: dict[str, NDArray[np.float32]]) -> dict[str, NDArray[np.float32]]:
        return {f"{name}.{channel}": values for channel, values in channels.items()}

    for number, parts in enumerate(
        [
            [("main", layer("diffuse", plain))],
            [("main", {**layer("diffuse", other), **layer("View Layer.Combined", plain), "Z": depth["Z"]})],
            [("main", {**layer("diffuse", other), **plain})],
            [("depth", depth), ("diffuse", other), ("beauty", plain)],
            [("depth", depth), ("whatever", plain)],
            [("right", other), ("left", plain)],
        ]
    ):
        np.testing.assert_array_equal(read_picture(exr(tmp_path / f"{number}.exr", *parts)), pixels)
    both = exr(tmp_path / "both.exr", ("main", {**layer("diffuse", plain), **layer("specular", other)}))
    for file in (both, exr(tmp_path / "parts.exr", ("specular", other), ("diffuse", plain))):
        with pytest.raises(SceneError, match="has color layers diffuse, specular; save one of them alone"):
            read_picture(file)


def test_channel_types_of_exr_files(tmp_path: Path) -> None:
    """Integers are their values, in any channel; half floats and tiles are read like others."""
    numbers = np.arange(20, dtype=np.uint32).reshape(4, 5) * 1000
    file = exr(tmp_path / "a.exr", ("main", {name: numbers + i for i, name in enumerate("RGB")}))
    np.testing.assert_array_equal(read_picture(file), np.stack([numbers, numbers + 1, numbers + 2], axis=-1))
    half = {name: values.astype(np.float16) for name, values in zip("RGB", noise(3, 4, 5))}
    for kind in (OpenEXR.scanlineimage, OpenEXR.tiledimage):
        file = exr(tmp_path / "b.exr", ("main", {**half, "id": numbers}), kind=kind)
        np.testing.assert_array_equal(read_picture(file), np.stack(list(half.values()), axis=-1).astype(np.float32))


def test_luminance_of_exr_files(tmp_path: Path) -> None:
    """Y alone is grey, also with alpha; with chroma, subsampled or not, it is read right or refused by name."""
    grey = noise(4, 6)
    alpha = np.ones_like(grey)
    np.testing.assert_array_equal(
        read_picture(exr(tmp_path / "y.exr", ("main", {"A": alpha, "Y": grey})))[..., 2], grey
    )
    exr(tmp_path / "full.exr", ("main", {"Y": grey, "RY": grey, "BY": grey}))
    (tmp_path / "half.exr").write_bytes(subsampled(grey))
    for name in ("full.exr", "half.exr"):
        try:
            pixels = read_picture(tmp_path / name)
        except SceneError as error:
            assert f"{name}: contains luminance and chroma, the channels Y, RY and BY" in str(error)
        else:  # OpenImageIO 3.1 converts subsampled images
            np.testing.assert_allclose(pixels, np.repeat(grey[..., None], 3, axis=2), atol=1e-3)


def subsampled(grey: FloatArray) -> bytes:
    """Return an uncompressed OpenEXR file of luminance, with chroma for every fourth pixel (OpenEXR File Layout)."""
    height, width = grey.shape

    def attribute(name: str, kind: str, value: bytes) -> bytes:
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value

    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    sampling = (("BY", 2), ("RY", 2), ("Y", 1))
    channels = b"".join(name.encode() + b"\0" + struct.pack("<iB3xii", 2, 0, step, step) for name, step in sampling)
    head = (
        struct.pack("<ii", 20000630, 2)
        + attribute("channels", "chlist", channels + b"\0")
        + attribute("compression", "compression", b"\0")
        + attribute("dataWindow", "box2i", window)
        + attribute("displayWindow", "box2i", window)
        + attribute("lineOrder", "lineOrder", b"\0")
        + attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
        + attribute("screenWindowCenter", "v2f", bytes(8))
        + attribute("screenWindowWidth", "float", struct.pack("<f", 1))
        + b"\0"
    )
    rows = [bytes(4 * width if y % 2 == 0 else 0) + grey[y].tobytes() for y in range(height)]
    lines = [struct.pack("<ii", y, len(row)) + row for y, row in enumerate(rows)]
    starts = np.cumsum([len(head) + 8 * height, *map(len, lines)])[:-1]
    return head + starts.astype("<u8").tobytes() + b"".join(lines)


def test_a_folder_is_no_picture(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="is a folder"):
        read_picture(tmp_path)


def test_a_sky_is_read_as_its_library_reads_it(tmp_path: Path) -> None:
    """Run-length encoded .hdr files are read by our own code: runs, literals, zeros and all exponents."""
    rng = np.random.default_rng(1)
    pixels = np.ldexp(rng.random((9, 300, 3), np.float32), rng.integers(-100, 100, (9, 300, 1)))
    pixels[:, 20:200] = pixels[:, 20:21]
    pixels[3, 250:] = 0
    path = tmp_path / "sky.hdr"
    write_image(path, pixels)
    buffer = oiio.ImageBuf(str(path))
    found, expected = read_radiance(path), buffer.get_pixels(oiio.FLOAT)
    assert found is not None and expected is not None
    np.testing.assert_array_equal(found, rgbe_rounded(pixels))
    np.testing.assert_allclose(found, expected, rtol=2e-7)  # the library computes powers in float32
    whole = path.read_bytes()
    for wrong in (
        whole[:-1],
        whole.replace(b"+X 300", b"+X 301"),
        whole.replace(b"+X 300", b"+X 0"),
        whole.replace(b"FORMAT=", b"EXPOSURE=0\nFORMAT="),
        whole.replace(b"FORMAT=", b"COLORCORR=1 2\nFORMAT="),
        whole.replace(b"rgbe", b"cmyk"),
        whole.replace(b"\x02\x02\x01", b"\x02\x03\x01", 1),
    ):
        path.write_bytes(wrong)
        with pytest.raises(SceneError, match=r"sky\.hdr: cannot be decoded as an image: "):
            read_picture(path)


@pytest.mark.parametrize("size", ["-Y 5 +X 9", "+Y 5 +X 9", "-Y 5 -X 9", "+Y 5 -X 9"])
@pytest.mark.parametrize("axes", ["YX", "XY"])
@pytest.mark.parametrize("coded", ["rows", "pixels", "not"])
def test_orientations_of_radiance_images(size: str, axes: str, coded: str, tmp_path: Path) -> None:
    """In all eight the image is upright: the sign of an axis is the direction in which its coordinate changes."""
    pixels = np.random.default_rng(4).integers(2, 255, (5, 9, 4)).astype(np.uint8)
    pixels[..., 3] = 129
    pixels[2, 1:8] = pixels[2, 1]
    stored_pixels = pixels[:: -1 if "+Y" in size else 1, :: -1 if "-X" in size else 1]
    if axes == "XY":
        y, x = size[:4], size[5:]
        size, stored_pixels = f"{x} {y}", stored_pixels.transpose(1, 0, 2)
    body = {"rows": by_channel, "pixels": by_pixel}.get(coded, lambda each: each.tobytes())(stored_pixels)
    head = f"#?RADIANCE\nmade by hand\nFORMAT=32-bit_rle_rgbe\n\n{size}\n"
    (tmp_path / "a.hdr").write_bytes(head.encode() + body)
    np.testing.assert_array_equal(read_picture(tmp_path / "a.hdr"), pixels[..., :3] * np.float32(2**-7))


def by_channel(pixels: NDArray[np.uint8]) -> bytes:
    """Rows of runs and literals by channel; those shorter than 8 pixels are not encoded."""
    width = pixels.shape[1]
    if width < 8:
        return pixels.tobytes()
    rows = b""
    for row in pixels:
        rows += bytes((2, 2, 0, width))
        for plane in row.T.tolist():
            rows += (
                bytes((3, *plane[:3], 128 + 2, plane[3], width - 5, *plane[5:]))
                if plane[3] == plane[4]
                else bytes((width, *plane))
            )
    return rows


def by_pixel(pixels: NDArray[np.uint8]) -> bytes:
    """Runs of equal pixels, as (1, 1, 1, count)."""
    coded, last, count = b"", b"", 0
    for pixel in map(bytes, [*pixels.reshape(-1, 4), np.zeros(0, np.uint8)]):
        if pixel == last:
            count += 1
            continue
        coded += bytes((1, 1, 1, count)) * (count > 0) + pixel
        last, count = pixel, 0
    return coded


def test_long_runs_of_old_radiance_images(tmp_path: Path) -> None:
    """Consecutive run counts are the digits of a number to the base 256, the lowest first."""
    head = b"#?RADIANCE\n\n-Y 2 +X 1000\n"
    row = bytes((9, 8, 7, 136, 1, 1, 1, 231, 1, 1, 1, 3, 1, 2, 3, 136))  # 1 + 231 + 3·256 = 1000
    end = bytes((6, 6, 6, 136, 1, 1, 1, 230, 1, 1, 1, 3))
    (tmp_path / "a.hdr").write_bytes(head + row + end)
    pixels = read_picture(tmp_path / "a.hdr")
    assert (pixels[0] == [9, 8, 7]).all() and (pixels[1, 0] == [1, 2, 3]).all() and (pixels[1, 1:] == 6).all()


def test_exposures_and_xyz_of_radiance_images(tmp_path: Path) -> None:
    """Pixels are divided by all exposures and color corrections; XYZ of the white point D65 is white."""
    pixel = bytes((128, 64, 32, 129))
    head = (
        b"#?RADIANCE\r\nEXPOSURE=2\r\nFORMAT=32-bit_rle_rgbe\r\nEXPOSURE= 0.25\r\nCOLORCORR=1 2 4\r\n\r\n-Y 1 +X 1\r\n"
    )
    (tmp_path / "a.hdr").write_bytes(head + pixel)
    np.testing.assert_array_equal(read_picture(tmp_path / "a.hdr"), [[[2, 0.5, 0.125]]])
    white = bytes((122, 128, 139, 129))  # D65: 0.9505, 1, 1.0891
    (tmp_path / "b.hdr").write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n" + white)
    np.testing.assert_allclose(read_picture(tmp_path / "b.hdr"), [[[1, 1, 1]]], atol=0.02)


@pytest.mark.parametrize("mode, dtype", [("L", "u1"), ("LA", "u1"), ("RGB", "u1"), ("RGBA", "u1"), ("RGB", "u2")])
def test_textures_are_read_as_stored(mode: str, dtype: str, tmp_path: Path) -> None:
    """From files and bytes alike; alpha is kept and not premultiplied; 16 bits are rounded to 8."""
    path = tmp_path / "a.png"
    stored_pixels = np.random.default_rng(2).integers(0, 256, (5, 7, len(mode))).astype(np.uint8)
    output = oiio.ImageOutput.create(str(path))
    spec = oiio.ImageSpec(7, 5, len(mode), "uint8" if dtype == "u1" else "uint16")
    spec.attribute("oiio:UnassociatedAlpha", 1)
    assert output is not None and output.open(str(path), spec)
    output.write_image(stored_pixels if dtype == "u1" else stored_pixels.astype(np.uint16) * 257)
    output.close()
    expected = np.full((5, 7, 4), 255)
    expected[..., :3] = stored_pixels[..., :3] if len(mode) > 2 else stored_pixels[..., :1]
    if mode.endswith("A"):
        expected[..., 3] = stored_pixels[..., -1]
    np.testing.assert_array_equal(read_texels(path), expected)
    np.testing.assert_array_equal(read_texels(path.read_bytes(), "a"), expected)
    with pytest.raises(SceneError, match="image 3: is not a PNG, JPEG, WebP, AVIF or KTX 2 image"):
        read_texels(b"GIF89a" + bytes(20), "image 3")
    write_image(tmp_path / "a.exr", noise(3, 4, 3))
    with pytest.raises(SceneError, match="a.exr: contains floats, but textures have 8 bits per channel"):
        read_texels(tmp_path / "a.exr")


def test_a_small_file_may_not_claim_a_huge_picture(tmp_path: Path) -> None:
    """A PNG that declares 60 000 by 60 000 pixels with a few bytes of data costs neither memory nor time."""
    header = struct.pack(">IIBBBBB", 60000, 60000, 8, 2, 0, 0, 0)
    chunks = [(b"IHDR", header), (b"IDAT", zlib.compress(bytes(1000))), (b"IEND", b"")]
    content = b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks
    )
    (tmp_path / "a.png").write_bytes(content)
    with pytest.raises(SceneError, match="cannot be decoded as an image"):
        read_picture(tmp_path / "a.png")


def test_a_flat_picture_may_have_a_small_file(tmp_path: Path) -> None:
    """Two palette colours at one bit per pixel compress to a five-thousandth of the texels' size."""
    image = Image.new("P", (512, 512), 1)
    image.putpalette([255, 0, 0, 0, 128, 255])
    image.save(tmp_path / "a.png", bits=1)
    assert (tmp_path / "a.png").stat().st_size < 512 * 512 * 4 / 3000
    assert (read_texels(tmp_path / "a.png") == [0, 128, 255, 255]).all()


def test_a_decoder_that_hangs_or_crashes_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A pipe without a writer blocks the decoder until its time limit, once; a killed decoder is replaced."""
    write_image(tmp_path / "a.png", noise(3, 4, 3))
    expected = read_picture(tmp_path / "a.png")
    os.mkfifo(tmp_path / "pipe.png")
    assert decoder._running is not None
    decoder._running._popen.kill()
    np.testing.assert_array_equal(read_picture(tmp_path / "a.png"), expected)
    with monkeypatch.context() as patch:
        patch.setattr(decoder, "LIMIT", 0.5)
        patch.setattr(decoder, "_Process", None)  # the running process is killed, and no other one is started
        with pytest.raises(SceneError, match="the decoder took more than 0.5 s; the file is damaged"):
            decoder.decode("image", tmp_path / "pipe.png")
    with ThreadPoolExecutor(1) as beside:
        waiting = beside.submit(decoder.decode, "image", tmp_path / "pipe.png")
        while decoder._running is None or not decoder._running._popen.pid:
            time.sleep(0.01)
        os.kill(decoder._running._popen.pid, signal.SIGSEGV)
        with pytest.raises(SceneError, match="the decoder crashed with signal 11"):
            waiting.result()
    np.testing.assert_array_equal(read_picture(tmp_path / "a.png"), expected)
