"""Image writing: .exr (float32, linear), .hdr (Radiance RGBE, linear), and the others through a view transform."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import OutputError, did_you_mean
from ..file_names import StrPath, utf8_path
from ..formats.images.image_reader import read_picture
from ..scene.fields.keywords import with_known_keywords
from .aov_files import Pictures, drawn, files_beside, layered
from .atomic_files import check_target, replacing
from .file_formats import DESCRIPTION, FORMATS, EncodedFormat, described, format_of
from .truncation import check_whole
from .view_transform import check_view, transparent_levels

FloatArray = NDArray[np.float32]

EXTENSIONS = tuple(FORMATS)
#: The largest value in RGBE: mantissa 255 of 256, exponent 127.
RGBE_MAX = 255 / 256 * 2.0**127

#: Attribute of OpenImageIO: the color of a pixel is not multiplied by its alpha.
UNASSOCIATED = "oiio:UnassociatedAlpha"
_log = logging.getLogger(__name__)


@with_known_keywords
def read_image(path: StrPath) -> FloatArray:
    """Return an image's pixels: (h, w, 3) float32, linear, row 0 on top, NaN and Inf kept.

    Float files (.exr, .hdr) are used unchanged; integer ones (.png, .jpg and others) are decoded from sRGB. One channel
    is grey; alpha is dropped; of several layers the one that has the image is read. Raises SceneError naming the file
    if it is missing, empty, damaged, or has no color channels.
    """
    return read_picture(path)


def metadata_of(path: Path, name: str) -> str | None:
    """Return an entry of `write_image`'s metadata; None if the file or the entry does not exist."""
    import OpenImageIO as oiio

    if not path.is_file():
        return None
    kind = FORMATS.get(path.suffix.lower())
    if isinstance(kind, EncodedFormat):
        return kind.metadata(path).get(name)
    with utf8_path(path) as file:
        opened = oiio.ImageInput.open(str(file))
    if not opened:
        return None
    spec = opened.spec()
    return spec.get_string_attribute(name) or described(spec.get_string_attribute(DESCRIPTION)).get(name)


def check_writable(path: Path) -> None:
    """Raise OutputError unless an image can be written at `path`; to be called before rendering."""
    check_target(path)
    extension = path.suffix.lower()
    if extension not in EXTENSIONS:
        meant = did_you_mean(extension, EXTENSIONS, path.with_suffix)
        problem = f"unknown image format {extension}" if extension else "the name has no extension"
        raise OutputError(f"{path}: {problem}; use {', '.join(EXTENSIONS[:-1])} or {EXTENSIONS[-1]}{meant}")


def write_image(
    path: StrPath,
    pixels: FloatArray,
    *,
    metadata: Mapping[str, str] | None = None,
    exposure: float = 0.0,
    view: str = "srgb",
    aovs: Pictures | None = None,
) -> None:
    """Write (h, w, 3) float32 linear pixels in the format of the extension, atomically (see `replacing`); or (h, w, 4)
    with associated alpha, of which formats without alpha hold the colors over black.

    `aovs`, if any, become layers of an .exr, and separate files for formats with a view; an .hdr omits them.

    `exposure` (stops) and `view` apply to all formats but .exr and .hdr: .png, .jpg and .webp have 8 bits per channel,
    .tif 16. An .exr is lossless; an .hdr is rounded to RGBE, with NaN and negative values as 0. `metadata` is stored in
    .exr and .png, and as JSON in the description of a .jpg and .tif; names with a colon, such as "clrt:spp", do not
    collide with the formats' own. Raises OutputError, and UsageError for an unknown view or an exposure that is not
    finite.
    """
    path = Path(path)
    check_writable(path)
    check_view(view, exposure)
    kind, about, aovs = format_of(path), metadata or {}, aovs or {}
    if pixels.shape[2] == 4 and not kind.alpha:
        _log.warning("%s: %s has no alpha, so the image is written over black", path, path.suffix.lower())
        pixels = pixels[..., :3]
    if kind.levels is not None:
        _tell_flaws(path, pixels)
        about = {**about, "clrt:view": view, "clrt:exposure": str(exposure)}
        write_levels(path, transparent_levels(pixels, view, exposure, kind.levels), about)
        for name, other in files_beside(path, aovs).items():
            write_levels(other, drawn(name, aovs[name], view, exposure), about)
    elif path.suffix.lower() == ".hdr":
        _tell_flaws(path, pixels)
        _write(path, rgbe_rounded(pixels), kind.header(about))
    else:
        samples, names = layered(pixels, aovs)
        _write(path, samples, kind.header(about), names)


def _tell_flaws(path: Path, pixels: FloatArray) -> None:
    """Log a warning about values that are not valid radiance, which formats other than .exr cannot hold."""
    flaws = (np.isnan(pixels), pixels < 0, np.isposinf(pixels))
    nan, negative, infinite = map(np.count_nonzero, flaws)
    if nan or negative or infinite:
        _log.warning(
            "%s: of the image's values, %d are NaN and %d negative, written as 0, and %d infinite, written "
            "as the largest value",
            path,
            nan,
            negative,
            infinite,
        )


def write_levels(path: Path, levels: NDArray[Any], metadata: Mapping[str, str]) -> None:
    """Write (h, w, 3) unsigned integers in a format with a view, or (h, w, 4) with unassociated alpha, atomically.
    Raises OutputError."""
    kind = format_of(path)
    if isinstance(kind, EncodedFormat):
        content = kind.encoded(path, levels, metadata)
        with replacing(path) as temporary:
            temporary.write_bytes(content)
    else:
        unassociated = {UNASSOCIATED: 1} if levels.shape[2] == 4 else {}
        _write(path, levels, kind.header(metadata) | unassociated, "RGBA"[: levels.shape[2]])


def write_texels(path: Path, texels: NDArray[np.uint8]) -> None:
    """Write (h, w, 4) samples of a texture, with unassociated alpha, as a lossless .png."""
    _write(path, texels, {UNASSOCIATED: 1}, "RGBA")


def write_channels(path: Path, samples: FloatArray, channels: Sequence[str]) -> None:
    """Write (h, w, n) float32 samples of n named channels as an .exr, atomically. Raises OutputError."""
    _write(path, samples, format_of(path).header({}), channels)


def rgbe_rounded(pixels: FloatArray) -> FloatArray:
    """Round to the nearest colors in RGBE: 8 bits per channel at the scale of the brightest one (Ward 1991).

    The file writer truncates instead, which would darken every image by 0.3 % on average.
    """
    bounded = np.clip(np.nan_to_num(pixels, nan=0.0, posinf=RGBE_MAX), 0, RGBE_MAX).astype(np.float64)
    # A mantissa of 255.5 rounds up to 256, which belongs to the next exponent.
    _, exponent = np.frexp(bounded.max(axis=-1, keepdims=True) * (256 / 255.5))
    quantum = np.ldexp(1.0, exponent - 8)
    rounded: NDArray[np.float64] = np.floor(bounded / quantum + 0.5) * quantum
    return rounded.astype(np.float32)


def _write(
    path: Path, samples: NDArray[Any], attributes: Mapping[str, str | int], channels: Sequence[str] = ("R", "G", "B")
) -> None:
    """Write uint8, uint16 or float32 samples unchanged, atomically; raises OutputError with the writer's reason."""
    with replacing(path) as temporary:
        _write_file(temporary, samples, attributes, channels)


def _write_file(
    path: Path, samples: NDArray[Any], attributes: Mapping[str, str | int], channels: Sequence[str]
) -> None:
    import OpenImageIO as oiio

    height, width = samples.shape[:2]
    # sRGB is the default; setting it explicitly takes 25 ms, in which OpenImageIO loads all its color spaces.
    spec = oiio.ImageSpec(width, height, len(channels), "float" if samples.dtype == np.float32 else samples.dtype.name)
    spec.channelnames = tuple(channels)
    if "A" in channels:
        spec.alpha_channel = channels.index("A")
    for name, value in attributes.items():
        spec.attribute(name, value)
    output = oiio.ImageOutput.create(str(path))
    done = (
        output is not None
        and output.open(str(path), spec)
        # OpenImageIO misreads strides, so it gets contiguous rows.
        and output.write_image(np.ascontiguousarray(samples))
        and output.close()
    )
    # For some formats a full disk is only reported as a message after a "successful" close.
    complaint = (output or oiio).geterror()
    if complaint or not done:
        raise OSError(complaint.splitlines()[0] if complaint else "the writer gave no reason")
    check_whole(path)
