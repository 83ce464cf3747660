"""Images of differences, and the remark on clipped files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.errors import OutputError, SceneError
from clrt.output.difference_image import clipping, write_difference
from clrt.output.images import read_image, write_image

RNG = np.random.default_rng(3)
R: NDArray[np.float32] = RNG.uniform(0.1, 2.0, (24, 32, 3)).astype(np.float32)


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    """Return an image and its reference: one block differs by a tenth, another by a hundredth of the reference."""
    x = R.copy()
    x[:8, :8] *= 1.1
    x[8:16, 8:16] *= 1.01
    for name, pixels in (("x.exr", x), ("r.exr", R)):
        write_image(tmp_path / name, pixels)
    return tmp_path / "x.exr", tmp_path / "r.exr"


def test_an_exr_holds_the_signed_difference(files: tuple[Path, Path], tmp_path: Path) -> None:
    write_difference(tmp_path / "d.exr", *files[::-1])
    np.testing.assert_array_equal(read_image(tmp_path / "d.exr"), R - read_image(files[0]))


@pytest.mark.parametrize("suffix", [".png", ".tif", ".webp"])
def test_levels_are_relative_errors(files: tuple[Path, Path], tmp_path: Path, suffix: str) -> None:
    """√(mean((x − r)²/(r² + 0.01))) of each pixel, in float64, over the error that is white."""
    white = write_difference(tmp_path / f"d{suffix}", *files)
    x, r = (read_image(file).astype(np.float64) for file in files)
    expected = np.sqrt(((x - r) ** 2 / (r**2 + 0.01)).mean(axis=2))
    assert white == pytest.approx(np.quantile(expected, 0.99)) and 0.05 < white < 0.1
    import OpenImageIO as oiio

    found = oiio.ImageInput.open(str(tmp_path / f"d{suffix}"))
    assert found is not None
    levels = np.asarray(found.read_image("float"))
    assert np.abs(levels - (expected / white).clip(0, 1)[..., None]).max() < 0.51 / 255


def test_what_is_not_finite_is_red(tmp_path: Path) -> None:
    broken = R.copy()
    broken[3, 4, 1] = np.nan
    broken[5, 6] = np.inf
    write_image(tmp_path / "x.exr", broken)
    write_image(tmp_path / "r.exr", R)
    write_difference(tmp_path / "d.png", tmp_path / "x.exr", tmp_path / "r.exr")
    shown = read_image(tmp_path / "d.png")
    red = (shown == [1, 0, 0]).all(axis=2)
    assert np.argwhere(red).tolist() == [[3, 4], [5, 6]] and not shown[~red].any()


def test_mistakes(files: tuple[Path, Path], tmp_path: Path) -> None:
    write_image(tmp_path / "small.exr", R[:8])
    with pytest.raises(SceneError, match="sizes differ"):
        write_difference(tmp_path / "d.png", files[0], tmp_path / "small.exr")
    with pytest.raises(OutputError, match="unknown image format"):
        write_difference(tmp_path / "d.xyz", *files)
    assert not (tmp_path / "d.png").exists()


def test_clipped_files_are_named(files: tuple[Path, Path], tmp_path: Path) -> None:
    """R has values up to 2, so a .png of it is clipped; one of R / 4 is not, and two .exr files never are."""
    write_image(tmp_path / "x.png", R)
    write_image(tmp_path / "dark.png", R / np.float32(4))
    write_image(tmp_path / "dark.exr", R / np.float32(4))
    remark = clipping(tmp_path / "x.png", files[1])
    assert remark is not None and "x.png" in remark and f"{R.max():.3g}" in remark
    assert clipping(files[1], tmp_path / "x.png") == remark
    assert clipping(*files) is None and clipping(tmp_path / "dark.png", tmp_path / "dark.exr") is None
