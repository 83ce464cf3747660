"""Write pictures: .exr (float32, linear), .hdr (Radiance RGBE, linear) and .png (8 bits through a view transform)."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import OutputError
from ..file_names import utf8_path
from ..scene.pictures import read_picture
from .files import check_target, replacing
from .layers import Pictures, drawn, files_beside, layered
from .view import check_view, to_display
from .whole import check_whole

FloatArray = NDArray[np.float32]

EXTENSIONS = (".png", ".exr", ".hdr")
#: How each is packed. A .png at level 1 over differences to the row above (libpng's filter 32) takes 0.12 s for a noisy
#: 1920x1080 picture, level 3 with the filters that the library chooses 0.22 s and 3 % less room.
ATTRIBUTES: dict[str, dict[str, str | int]] = {".exr": {"compression": "zip"},
                                               ".png": {"png:compressionLevel": 1, "png:filter": 32}}
#: The largest value that RGBE can hold: mantissa 255 of 256, exponent 127.
RGBE_MAX = 255 / 256 * 2.0**127

_log = logging.getLogger(__name__)

#: A picture that was written is read like any other.
read_image = read_picture


def metadata_of(path: Path, name: str) -> str | None:
    """What `write_image` was told by a name; None where there is no such file, or nothing of that name in it."""
    import OpenImageIO as oiio

    if not path.is_file():
        return None
    with utf8_path(path) as file:
        opened = oiio.ImageInput.open(str(file))
    return opened and opened.spec().get_string_attribute(name) or None


def check_writable(path: Path) -> None:
    """Raise OutputError unless a picture can be written at `path`; ask before rendering, not after."""
    check_target(path)
    extension = path.suffix.lower()
    if extension not in EXTENSIONS:
        meant = "".join(f"; did you mean {path.with_suffix(match)}?"
                        for match in get_close_matches(extension, EXTENSIONS, 1))
        problem = f"unknown picture format {extension}" if extension else "the name has no extension"
        raise OutputError(f"{path}: {problem}; use {', '.join(EXTENSIONS[:-1])} or {EXTENSIONS[-1]}{meant}")


def write_image(path: Path, pixels: FloatArray, *, metadata: Mapping[str, str] | None = None,
                exposure: float = 0.0, view: str = "srgb", aovs: Pictures | None = None) -> None:
    """Write (h, w, 3) float32 linear pixels in the format that the extension names, in one step (see `replacing`).

    `aovs`, if any, are layers of an .exr and files beside a .png (see `layers`); an .hdr has none.

    `exposure` (stops) and `view` apply to .png alone. An .exr keeps every bit; an .hdr is rounded to RGBE, with
    NaN and negative values as 0. `metadata` is kept in .exr and .png; names with a colon, such as "clrt:spp", meet
    none of the formats' own. Raises OutputError, and UsageError for an unknown view or an exposure that is
    not finite.
    """
    check_writable(path)
    check_view(view, exposure)
    about, aovs = metadata or {}, aovs or {}
    match path.suffix.lower():
        case ".png":
            _tell_flaws(path, pixels)
            about = {**about, "clrt:view": view, "clrt:exposure": str(exposure)}
            _write_png(path, to_display(pixels, view, exposure), about)
        case ".hdr":
            _tell_flaws(path, pixels)
            _write(path, rgbe_rounded(pixels), about)
        case _:
            samples, names = layered(pixels, aovs)
            _write(path, samples, {**about, **ATTRIBUTES[".exr"]}, names)
    for name, other in files_beside(path, aovs).items():
        _write_png(other, drawn(name, aovs[name], view, exposure), about)


def _tell_flaws(path: Path, pixels: FloatArray) -> None:
    """Warns of values that are no light, which formats other than .exr cannot hold."""
    flaws = (np.isnan(pixels), pixels < 0, np.isposinf(pixels))
    nan, negative, infinite = map(np.count_nonzero, flaws)
    if nan or negative or infinite:
        _log.warning("%s: of the picture's values %d are NaN and %d negative, written as 0, and %d infinite, written "
                     "as the brightest", path, nan, negative, infinite)


def _write_png(path: Path, samples: NDArray[np.uint8], metadata: Mapping[str, str]) -> None:
    # That the colours are sRGB is written by default; to say so takes 25 ms, in which OpenImageIO loads all colour
    # spaces that it knows.
    _write(path, samples, {**metadata, **ATTRIBUTES[".png"]})


def write_texels(path: Path, texels: NDArray[np.uint8]) -> None:
    """Write (h, w, 4) samples of a texture, alpha not multiplied in, as a .png that holds the same."""
    _write(path, texels, {"oiio:UnassociatedAlpha": 1}, ("R", "G", "B", "A"))


def rgbe_rounded(pixels: FloatArray) -> FloatArray:
    """The nearest colours that RGBE can hold: 8 bits a channel at the scale of the brightest one (Ward 1991).

    The file writer cuts off what lies below the last bit, which would darken every picture by 0.3 % on average.
    """
    bounded = np.clip(np.nan_to_num(pixels, nan=0.0, posinf=RGBE_MAX), 0, RGBE_MAX).astype(np.float64)
    # A mantissa of 255.5 rounds up to 256, which belongs to the next exponent.
    _, exponent = np.frexp(bounded.max(axis=-1, keepdims=True) * (256 / 255.5))
    quantum = np.ldexp(1.0, exponent - 8)
    rounded: NDArray[np.float64] = np.floor(bounded / quantum + 0.5) * quantum
    return rounded.astype(np.float32)


def _write(path: Path, samples: NDArray[Any], attributes: Mapping[str, str | int],
           channels: Sequence[str] = ("R", "G", "B")) -> None:
    """Write uint8 or float32 samples as they are, in one step; OutputError with the writer's reason if that fails."""
    with replacing(path) as temporary:
        _write_file(temporary, samples, attributes, channels)


def _write_file(path: Path, samples: NDArray[Any], attributes: Mapping[str, str | int],
                channels: Sequence[str]) -> None:
    import OpenImageIO as oiio

    height, width = samples.shape[:2]
    spec = oiio.ImageSpec(width, height, len(channels), samples.dtype.name if samples.dtype == np.uint8 else "float")
    spec.channelnames = tuple(channels)
    for name, value in attributes.items():
        spec.attribute(name, value)
    output = oiio.ImageOutput.create(str(path))
    done = (output is not None and output.open(str(path), spec)
            # OpenImageIO misreads strides: it gets rows that follow each other.
            and output.write_image(np.ascontiguousarray(samples)) and output.close())
    # A full disk shows in some formats only as a message after a "successful" close.
    complaint = (output or oiio).geterror()
    if complaint or not done:
        raise OSError(complaint.splitlines()[0] if complaint else "the writer gave no reason")
    check_whole(path)
