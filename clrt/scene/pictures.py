"""Read a picture file as linear Rec. 709: environment maps, and pictures to compare."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError


def read_picture(path: Path) -> NDArray[np.float32]:
    """The picture's pixels: (h, w, 3) float32, linear, row 0 on top, NaN and Inf kept.

    Float files (.exr, .hdr) are taken as they are; integer ones (.png, .jpg and others) are decoded from sRGB.
    One channel is grey; alpha is left out. Raises SceneError naming the file if it is missing, empty, damaged, cropped
    (a data window that differs from the display window), or has no colour channels.
    """
    buffer, pixels = _decoded(path, "float")
    spec = buffer.spec()
    if buffer.roi != buffer.roi_full:
        raise SceneError(f"{path}: the file holds {spec.width}x{spec.height} pixels of a "
                         f"{spec.full_width}x{spec.full_height} picture; save it uncropped")
    colours: NDArray[np.float32] = pixels[..., _colour_channels(path, spec.channelnames)]
    return colours if _holds_floats(buffer) else linear_from_srgb(colours)


def read_texels(path: Path) -> NDArray[np.uint8]:
    """The texels of a picture of at most 16 bits a channel: (h, w, 4) uint8 as stored, row 0 on top, alpha apart.

    Raises SceneError as `read_picture`, and for pictures of floats, which would lose most of what they hold.
    """
    buffer, pixels = _decoded(path, "uint8")
    if _holds_floats(buffer):
        raise SceneError(f"{path}: holds floats, but textures have 8 bits a channel; convert it to PNG")
    names = buffer.spec().channelnames
    texels: NDArray[np.uint8] = np.full((*pixels.shape[:2], 4), 255, np.uint8)
    texels[..., :3] = pixels[..., _colour_channels(path, names)]
    for channel, name in enumerate(names):
        if name.upper() == "A":
            texels[..., 3] = pixels[..., channel]
    return texels


def _decoded(path: Path, dtype: str) -> tuple[Any, NDArray[Any]]:
    """OpenImageIO's buffer of a file, and its (h, w, channels) of `dtype`."""
    import OpenImageIO as oiio

    if not path.is_file():
        raise SceneError(f"{path}: {'is a folder, not a picture' if path.is_dir() else 'no such picture file'}")
    if path.stat().st_size == 0:
        raise SceneError(f"{path}: the picture file is empty; write it again")
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    buffer = oiio.ImageBuf(str(path), 0, 0, config)
    kind = oiio.TypeDesc(dtype)
    pixels = buffer.get_pixels(kind) if buffer.read(0, 0, True, kind) else None
    if pixels is None:
        raise SceneError(f"{path}: cannot be decoded as a picture: {_complaint(buffer)}")
    return buffer, pixels


def _holds_floats(buffer: Any) -> bool:
    import OpenImageIO as oiio

    return buffer.nativespec().format.basetype in (oiio.HALF, oiio.FLOAT, oiio.DOUBLE)


def linear_from_srgb(encoded: NDArray[np.float32]) -> NDArray[np.float32]:
    """Undo the sRGB curve (IEC 61966-2-1) of values in [0, 1]; same shape and dtype."""
    power = ((encoded.astype(np.float64) + 0.055) / 1.055) ** 2.4
    return np.where(encoded <= 0.04045, encoded / 12.92, power).astype(np.float32)


def _colour_channels(path: Path, names: tuple[str, ...]) -> list[int]:
    """Where red, green and blue are among a file's channels."""
    upper = [name.upper() for name in names]
    if len(names) <= 2:  # grey, or grey and alpha
        return [0, 0, 0]
    if not {"R", "G", "B"} <= set(upper):
        raise SceneError(f"{path}: no channels R, G, B, but {', '.join(names)}; save its colour layer alone")
    return [upper.index(channel) for channel in "RGB"]


def _complaint(buffer: Any) -> str:
    """OpenImageIO's message about a file; it quotes raw bytes of damaged headers, which are not always text."""
    try:
        return str(buffer.geterror()).splitlines()[0]
    except (UnicodeDecodeError, IndexError):
        return "its header is damaged"
