"""Image formats with a view transform: their levels, metadata and AOVs, in whole images and in blocks of rows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image as PillowImage

from clrt.output.file_formats import FORMATS, is_shown
from clrt.output.image import Image
from clrt.output.images import metadata_of, write_image
from clrt.output.row_writer import write_rows
from clrt.output.view_transform import to_display

SHOWN = [suffix for suffix in FORMATS if is_shown(Path(f"a{suffix}"))]


def picture(height: int = 48, width: int = 64) -> NDArray[np.float32]:
    """Return a smooth image with a range beyond [0, 1]."""
    y, x = np.mgrid[:height, :width].astype(np.float32)
    return np.stack([x / width, y / height, 1.2 * (x + y) / (width + height)], axis=2) ** np.float32(2.0)


def read(path: Path) -> NDArray[np.float64]:
    """Return the levels by Pillow, as fractions; of 16 bits, which it lacks, as they were written."""
    if path.suffix in (".tif", ".tiff"):
        return sixteen_bits(path) / 65535
    with PillowImage.open(path) as opened:
        assert opened.size == (64, 48)
        return np.asarray(opened.convert("RGB"), np.float64) / 255


def sixteen_bits(path: Path) -> NDArray[np.float64]:
    import OpenImageIO as oiio

    found = oiio.ImageInput.open(str(path))
    assert found is not None and found.spec().format == oiio.UINT16
    return np.asarray(found.read_image("uint16"), np.float64)


@pytest.mark.parametrize("suffix", SHOWN)
def test_levels_are_those_of_the_view(tmp_path: Path, suffix: str) -> None:
    """To half a level of 8 bits, exactly for lossless formats; a .jpg of a smooth image to three."""
    path, pixels = tmp_path / f"a{suffix}", picture()
    write_image(path, pixels, view="agx", exposure=0.5)
    error = np.abs(255 * read(path) - to_display(pixels, "agx", 0.5))
    assert error.max() <= (3.01 if suffix.startswith(".j") else 0.51)
    assert metadata_of(path, "clrt:view") == "agx"


@pytest.mark.parametrize("suffix", SHOWN)
def test_rows_give_the_same_file(tmp_path: Path, suffix: str) -> None:
    pixels, whole, rows = picture(), tmp_path / f"whole{suffix}", tmp_path / f"rows{suffix}"
    write_image(whole, pixels)
    write_rows(rows, (64, 48), iter([pixels[:16], pixels[16:32], pixels[32:]]))
    np.testing.assert_array_equal(read(whole), read(rows))


@pytest.mark.parametrize("suffix", SHOWN)
def test_aovs_have_their_own_files(tmp_path: Path, suffix: str) -> None:
    image = Image(picture(), {"spp": 64}, aovs={"albedo": picture()})
    image.save(tmp_path / f"a{suffix}")
    assert {path.name for path in tmp_path.iterdir()} == {f"a{suffix}", f"a.albedo{suffix}"}
    assert metadata_of(tmp_path / f"a{suffix}", "clrt:spp") == "64"


def test_sixteen_bits_are_finer(tmp_path: Path) -> None:
    """A ramp too fine for 8 bits has as many levels as pixels."""
    ramp = np.linspace(0.2, 0.21, 64, dtype=np.float32)[None, :, None].repeat(3, axis=2)
    write_image(tmp_path / "a.tif", ramp, view="raw")
    found = sixteen_bits(tmp_path / "a.tif")[0, :, 0]
    np.testing.assert_array_equal(found, np.floor(65535 * ramp[0, :, 0].astype(np.float64) + 0.5))
    assert len(np.unique(found)) == 64
