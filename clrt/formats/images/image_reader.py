"""Image file reading: environment maps and images to compare as linear Rec. 709, textures as stored."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...file_names import StrPath
from ..decoder import Arrays, decode
from ..referenced_files import check_file
from .radiance_hdr import read_radiance

#: Magic bytes of images embedded in glTF, with their position, and the file suffix of that format.
EMBEDDED = {
    (0, b"\x89PNG\r\n\x1a\n"): ".png",
    (0, b"\xff\xd8\xff"): ".jpg",
    (0, b"RIFF"): ".webp",
    (4, b"ftypavif"): ".avif",
    (0, b"\xabKTX 20\xbb\r\n\x1a\n"): ".ktx2",
}
#: Decoders by suffix, for formats that OpenImageIO does not decode.
DECODERS = {".avif": "avif", ".ktx2": "basis"}


def read_picture(path: StrPath) -> NDArray[np.float32]:
    """Return an image's pixels: (h, w, 3) float32, linear, row 0 on top, NaN and Inf kept.

    Float files (.exr, .hdr) are used unchanged; integer ones (.png, .jpg and others) are decoded from sRGB. One channel
    is grey; alpha is dropped; of several layers the one that has the image is read (see `color_channels`). Raises
    SceneError naming the file if it is missing, empty, damaged, or has no color channels.
    """
    return _read_linear(Path(path))[0]


def read_layers(path: StrPath) -> tuple[NDArray[np.float32], NDArray[np.float32] | None]:
    """Return an image's pixels as `read_picture`, but premultiplied by alpha, and its alpha (h, w), None without one.
    Alpha of float files is associated, that of others is not."""
    pixels, alpha, associated = _read_linear(Path(path))
    return (pixels if alpha is None or associated else pixels * alpha[..., None]), alpha


def read_named_layers(path: StrPath, prefix: str) -> dict[str, NDArray[np.float32]]:
    """Return the layers of an image file whose names begin with `prefix`, (h, w, 3) float32 by the rest of their names,
    sorted. Raises SceneError as `read_picture`, but not if there are none."""
    path = Path(path)
    _check_stored(path)
    arrays, _ = _decoded("layers", path, str(path), prefix=prefix)
    return dict(sorted(arrays.items()))


def _read_linear(path: Path) -> tuple[NDArray[np.float32], NDArray[np.float32] | None, bool]:
    """Return linear pixels, alpha if there is one, and whether it is associated."""
    _check_stored(path)
    if (radiance := read_radiance(path)) is not None:
        return radiance, None, False
    pixels, names = _stored(path, str(path))
    colours, alpha = pixels[..., _colour_channels(names)], pixels[..., -1] if names.endswith("A") else None
    if pixels.dtype == np.float32:
        return colours, alpha, True
    most = np.float32(np.iinfo(pixels.dtype).max)
    linear = linear_from_srgb(np.asarray(colours / most, np.float32))
    return linear, None if alpha is None else np.asarray(alpha / most, np.float32), False


def read_texels(source: StrPath | bytes, name: str = "") -> NDArray[np.uint8]:
    """Return the texels of an image file of at most 16 bits per channel, or of the bytes of one (PNG, JPEG, WebP,
    AVIF, KTX 2 of Basis Universal).

    (h, w, 4) uint8 as stored, row 0 on top, unassociated alpha. `name`: the bytes' name in messages. Raises SceneError
    as `read_picture`, and for images of floats, which would lose most of their range.
    """
    if not isinstance(source, bytes):
        source = Path(source)
        _check_stored(source)
    name = name or str(source)
    pixels, names = _stored(source, name)
    if pixels.dtype == np.float32:
        raise SceneError(f"{name}: contains floats, but textures have 8 bits per channel; convert it to PNG")
    if pixels.dtype == np.uint16:
        pixels = (pixels.astype(np.uint32) + 128) // 257
    texels = np.full((*pixels.shape[:2], 4), 255, np.uint8)
    texels[..., :3] = pixels[..., _colour_channels(names)]
    if names.endswith("A"):
        texels[..., 3] = pixels[..., -1]
    return texels


def _check_stored(path: Path) -> None:
    check_file(path, "picture")
    if path.stat().st_size == 0:
        raise SceneError(f"{path}: the image file is empty; save it again")


def _stored(source: Path | bytes, name: str) -> tuple[NDArray[Any], str]:
    """Return the pixels as stored, and their channels: RGB, RGBA, Y or YA."""
    suffix = ""
    if isinstance(source, bytes):
        suffix = next((ending for (start, magic), ending in EMBEDDED.items() if source.startswith(magic, start)), "")
        if not suffix:
            raise SceneError(f"{name}: is not a PNG, JPEG, WebP, AVIF or KTX 2 image; convert it")
    if suffix == ".ktx2" and find_spec("opengl_basisu") is None:
        raise SceneError(
            f"{name}: is compressed with Basis Universal, whose decoder is not installed; "
            "pip install opengl-basisu, or export the textures as PNG or JPEG"
        )
    arrays, facts = _decoded(DECODERS.get(suffix, "image"), source, name, suffix)
    return arrays["pixels"], facts["channels"]


def _decoded(
    kind: str, source: Path | bytes, name: str, suffix: str = "", **options: Any
) -> tuple[Arrays, dict[str, Any]]:
    """Return what the decoder does. Raises SceneError that begins with `name`."""
    try:
        arrays, facts = decode(kind, source, suffix, **options)
    except SceneError as error:
        raise SceneError(f"{name}: cannot be decoded as an image: {error}") from None
    if "refused" in facts:
        raise SceneError(f"{name}: {facts['refused']}")
    return arrays, facts


def linear_from_srgb(encoded: NDArray[np.float32]) -> NDArray[np.float32]:
    """Decode sRGB (IEC 61966-2-1) values in [0, 1] to linear; same shape and dtype."""
    power = ((encoded.astype(np.float64) + 0.055) / 1.055) ** 2.4
    return np.where(encoded <= 0.04045, encoded / 12.92, power).astype(np.float32)


def srgb_from_linear(linear: NDArray[np.float32]) -> NDArray[np.float32]:
    """Encode linear values in [0, 1] to sRGB (IEC 61966-2-1); same shape and dtype."""
    power = 1.055 * linear.astype(np.float64) ** (1 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, 12.92 * linear, power).astype(np.float32)


def _colour_channels(names: str) -> list[int]:
    """Return the indices of red, green and blue among a file's channels."""
    return [0, 1, 2] if names.startswith("RGB") else [0, 0, 0]
