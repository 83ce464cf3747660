"""Pictures of every kind read as linear RGB, and unusable ones refused."""

from __future__ import annotations

from pathlib import Path

import imageio.v3 as imageio
import numpy as np
import OpenImageIO as oiio
import pytest
from numpy.typing import NDArray

from clrt.errors import SceneError
from clrt.output.images import write_image
from clrt.scene.pictures import read_picture

FloatArray = NDArray[np.float32]


def noise(*shape: int) -> FloatArray:
    return np.random.default_rng(0).random(shape, dtype=np.float32)


def stored(path: Path, pixels: FloatArray, **spec_fields: object) -> None:
    """Write any channels and windows through the library itself."""
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], "float")
    for name, value in spec_fields.items():
        setattr(spec, name, value)
    output = oiio.ImageOutput.create(str(path))
    assert output is not None
    assert output.open(str(path), spec) and output.write_image(np.ascontiguousarray(pixels)) and output.close()


@pytest.mark.parametrize("name, content, message", [
    ("none.exr", None, "no such picture file"),
    ("empty.exr", b"", "empty"),
    ("noise.png", b"\x00\x01garbage" * 50, "cannot be decoded"),
    ("text.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 50000 +X 50000\n\x02\x02", "cannot be decoded"),
    ("raw.exr", b"v/1\x01\x02\x00\x00\x00\xff\xfe\xfd", "cannot be decoded"),
])
def test_unreadable_pictures_are_scene_errors(tmp_path: Path, capfd: pytest.CaptureFixture[str], name: str,
                                              content: bytes | None, message: str) -> None:
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
    with pytest.raises(SceneError, match=r"normals\.exr: no channels R, G, B, but N\.X, N\.Y, N\.Z"):
        read_picture(tmp_path / "normals.exr")


def test_alpha_does_not_darken_a_png(tmp_path: Path) -> None:
    rgba = np.full((2, 2, 4), 118, np.uint8)
    rgba[..., 3] = [[0, 1], [128, 255]]
    imageio.imwrite(tmp_path / "a.png", rgba)
    assert read_picture(tmp_path / "a.png") == pytest.approx(((118 / 255 + 0.055) / 1.055) ** 2.4, rel=1e-6)


def test_a_cropped_picture_is_refused(tmp_path: Path) -> None:
    stored(tmp_path / "crop.exr", noise(21, 34, 3), full_width=50, full_height=40)
    with pytest.raises(SceneError, match=r"crop\.exr: the file holds 34x21 pixels of a 50x40 picture"):
        read_picture(tmp_path / "crop.exr")


def test_a_folder_is_no_picture(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="is a folder"):
        read_picture(tmp_path)
