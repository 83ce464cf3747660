"""Alpha in files: associated in OpenEXR, unassociated after the view in others; denoised, and in videos."""

from __future__ import annotations

import logging
import subprocess
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image as Pictures, ImageSequence

from clrt.output.denoise import Denoiser, denoised
from clrt.output.image import Image
from clrt.output.image_error import compare, compare_files
from clrt.output.images import write_image
from clrt.output.row_writer import write_rows
from clrt.output.video import write_video
from clrt.output.view_transform import to_display, transparent_levels

FloatArray = NDArray[np.float32]


def layers(height: int = 32, width: int = 48) -> FloatArray:
    """Return colors, some of them bright, with every alpha from 0 to 1."""
    rng = np.random.default_rng(4)
    alpha = np.linspace(-0.2, 1.2, height * width, dtype=np.float32).clip(0, 1).reshape(height, width, 1)
    return np.concatenate([alpha * rng.uniform(0, 1.5, (height, width, 3)).astype(np.float32), alpha], axis=2)


def decoded(levels: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Return linear values of sRGB (IEC 61966-2-1)."""
    signal = levels / 255
    return np.asarray(np.where(signal <= 0.04045, signal / 12.92, ((signal + 0.055) / 1.055) ** 2.4))


def test_openexr_reads_associated_alpha(tmp_path: Path) -> None:
    """Another library finds the channels with their values, among those of AOVs."""
    import OpenEXR

    pixels, depth = layers(), np.full((32, 48), 3.0, np.float32)
    Image(pixels[..., :3], alpha=pixels[..., 3], aovs={"depth": depth}).save(tmp_path / "a.exr")
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        channels = file.channels()
        for name, values in zip("RGBA", np.moveaxis(pixels, 2, 0)):
            np.testing.assert_array_equal(channels[name].pixels, values)
        np.testing.assert_array_equal(channels["depth.Z"].pixels, depth)


@pytest.mark.parametrize("suffix", [".png", ".webp"])
@pytest.mark.parametrize("behind", [0.0, 1.0, 0.3])
def test_files_composite_to_the_same_image(tmp_path: Path, suffix: str, behind: float) -> None:
    """What the file's color and alpha are in linear light, over a color: to one level of 255 where none is clipped."""
    pixels = layers()
    write_image(tmp_path / f"a{suffix}", pixels)
    found = np.asarray(Pictures.open(tmp_path / f"a{suffix}"))
    assert found.shape == (32, 48, 4)
    alpha = found[..., 3:] / 255
    over = decoded(found[..., :3]) * alpha + (1 - alpha) * behind
    color = np.divide(
        pixels[..., :3], pixels[..., 3:], out=np.zeros((32, 48, 3), np.float32), where=pixels[..., 3:] > 0
    )
    expected = pixels[..., 3:] * color.clip(0, 1) + (1 - pixels[..., 3:]) * behind
    shown, wanted = (to_display(each.astype(np.float32), "srgb").astype(int) for each in (over, expected))
    fine = (pixels[..., 3:] > 0.3) | (pixels[..., 3:] == 0)  # coarser where few levels of alpha remain
    assert np.abs(shown - wanted)[np.broadcast_to(fine, shown.shape)].max() <= 2
    assert np.abs(over - expected).max() < 1 / 255 + 0.5 / 255


def test_sixteen_bits_and_rows(tmp_path: Path) -> None:
    import OpenImageIO as oiio

    pixels = layers()
    write_image(tmp_path / "a.tif", pixels)
    found = np.asarray(oiio.ImageBuf(str(tmp_path / "a.tif")).get_pixels(oiio.FLOAT))  # associated by the reader
    np.testing.assert_allclose(found[..., 3], pixels[..., 3], atol=1e-5)
    for suffix in (".png", ".exr", ".webp", ".jpg", ".hdr"):
        write_image(tmp_path / f"whole{suffix}", pixels)
        write_rows(tmp_path / f"rows{suffix}", (48, 32), [pixels[:16], pixels[16:]], channels=4)
        whole, rows = (
            np.asarray(oiio.ImageBuf(str(tmp_path / f"{name}{suffix}")).get_pixels(oiio.FLOAT))
            for name in ("whole", "rows")
        )
        np.testing.assert_array_equal(rows, whole)
        assert whole.shape[2] == (3 if suffix in (".jpg", ".hdr") else 4)


def test_compare_uses_associated_colors_and_alpha(tmp_path: Path) -> None:
    """A .png and an .exr of one image are the same but for 8 bits; alpha counts by itself."""
    pixels = layers().clip(0, 1)
    pixels[..., :3] = np.minimum(pixels[..., :3], pixels[..., 3:])
    other = pixels.copy()
    other[3, 4, 3] -= 0.25
    for name, image in (("a.png", pixels), ("a.exr", pixels), ("b.exr", other)):
        write_image(tmp_path / name, image)
    result = compare_files(tmp_path / "a.png", tmp_path / "a.exr")
    assert result["max_abs"] < 0.006 and result["alpha_max_abs"] < 0.0021
    one, two = (Image(each[..., :3], alpha=each[..., 3]) for each in (pixels, other))
    for found in (compare_files(tmp_path / "b.exr", tmp_path / "a.exr"), compare(two, one)):
        assert found["max_abs"] == 0 and found["alpha_max_abs"] == pytest.approx(0.25, abs=1e-6)
    assert compare(one, pixels[..., :3])["alpha_max_abs"] == 1 and "alpha_max_abs" not in compare(
        normal := pixels[..., :3], normal
    )


def test_normals_with_alpha(tmp_path: Path) -> None:
    """Of a half-covered pixel the .png shows the covering surface's normal."""
    normals = np.array([[(0.0, 0.0, 0.5), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)]], np.float32)
    image = Image(normals, {"integrator": "normals"}, alpha=np.array([[0.5, 1.0, 0.0]], np.float32))
    image.save(tmp_path / "n.png")
    found = np.asarray(Pictures.open(tmp_path / "n.png"))[0].tolist()
    assert found == [[128, 128, 255, 128], [128, 128, 255, 255], [0, 0, 0, 0]]


def test_the_window_shows_alpha() -> None:
    """What is drawn over the window's background is what a .png holds."""
    from clrt.live.settings import Settings
    from clrt.live.snapshot import Snapshot
    from clrt.scene.model import Scene
    from clrt.window.tone_mapping import DisplaySettings, tone_mapped

    pixels = layers()
    snapshot = Snapshot(scene=Scene(), settings=Settings(), pixels=pixels[..., :3], alpha=pixels[..., 3], size=(48, 32))
    shown = tone_mapped(snapshot, DisplaySettings()).rgba
    np.testing.assert_array_equal(shown, transparent_levels(pixels, "srgb", 0.0, np.uint8))
    opaque = tone_mapped(
        Snapshot(scene=Scene(), settings=Settings(), pixels=pixels[..., :3], size=(48, 32)), DisplaySettings()
    )
    assert (opaque.rgba[..., 3] == 255).all()


def test_formats_without_alpha_are_over_black(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        write_image(tmp_path / "a.hdr", layers())
    assert "a.hdr: .hdr has no alpha, so the image is written over black" in caplog.text
    write_image(tmp_path / "b.hdr", layers()[..., :3])
    assert (tmp_path / "a.hdr").read_bytes() == (tmp_path / "b.hdr").read_bytes()


@pytest.mark.needs("imageio_ffmpeg")
def test_videos(tmp_path: Path) -> None:
    """A .webm has alpha, a .gif cut-outs, an .mp4 black."""
    from imageio_ffmpeg import get_ffmpeg_exe

    levels = np.zeros((48, 64, 4), np.uint8)
    levels[:, :32] = 200, 100, 50, 255
    levels[:, 32:48] = 200, 100, 50, 100
    frames = [tmp_path / f"{i}.png" for i in range(2)]
    for i, path in enumerate(frames):
        Pictures.fromarray(np.roll(levels, 8 * i, axis=1)).save(path)
    for suffix in (".webm", ".mp4", ".gif"):
        write_video(tmp_path / f"a{suffix}", frames, 10)
    for name, decoder, expected in (
        ("a.webm", ["-c:v", "libvpx-vp9"], [(200, 100, 50, 255), (200, 100, 50, 100), (None, None, None, 0)]),
        ("a.mp4", [], [(200, 100, 50, 255), (78, 39, 20, 255), (0, 0, 0, 255)]),
    ):
        command = [get_ffmpeg_exe(), "-v", "error", *decoder, "-i", str(tmp_path / name), "-frames:v", "1"]
        raw = subprocess.run([*command, "-f", "rawvideo", "-pix_fmt", "rgba", "-"], capture_output=True, check=True)
        frame = np.frombuffer(raw.stdout, np.uint8).reshape(48, 64, 4).astype(int)
        for x, wanted in zip((16, 40, 58), expected):
            assert all(value is None or abs(frame[24, x, i] - value) < 8 for i, value in enumerate(wanted))
    shots = [np.asarray(each.convert("RGBA")) for each in ImageSequence.Iterator(Pictures.open(tmp_path / "a.gif"))]
    for i, shot in enumerate(shots):
        np.testing.assert_array_equal(shot[..., 3], np.roll(np.where(levels[..., 3] < 128, 0, 255), 8 * i, axis=1))


@pytest.mark.needs("pyoidn")
def test_alpha_is_denoised(tmp_path: Path) -> None:
    """A noisy blurred edge comes closer to its mean; what is certain stays exact, and a backdrop is not smoothed."""
    rng = np.random.default_rng(8)
    mean = np.broadcast_to(np.clip(np.linspace(-1, 2, 192), 0, 1), (128, 192)).astype(np.float32)
    alpha = (rng.random((16, 128, 192)) < mean).mean(axis=0, dtype=np.float32)
    guides = {name: np.zeros((128, 192, 3), np.float32) for name in ("albedo", "normal")}
    noisy = Image(alpha[..., None] * np.array((0.8, 0.4, 0.2), np.float32), alpha=alpha)
    smooth = denoised(noisy, Denoiser(), guides)
    assert smooth.alpha is not None and smooth.raw is not None
    errors = [np.sqrt(np.mean((each - mean) ** 2)) for each in (smooth.alpha, alpha)]
    assert errors[0] < 0.4 * errors[1]
    for value in (0, 1):
        np.testing.assert_array_equal(smooth.alpha[:, 2:56] if value == 0 else smooth.alpha[:, 140:190], value)
    np.testing.assert_array_equal(smooth.pixels[:, 2:56], 0)
    np.testing.assert_array_equal(smooth.raw, noisy.layers)
    photo = rng.random((128, 192, 3)).astype(np.float32)
    over = Image(noisy.pixels + (1 - alpha[..., None]) * photo, alpha=alpha, backdrop=photo)
    done = denoised(over, Denoiser(), guides)
    np.testing.assert_array_equal(done.pixels[:, 2:56], photo[:, 2:56])
    np.testing.assert_allclose(done.pixels, smooth.pixels + (1 - smooth.alpha[..., None]) * photo, atol=0.02)
