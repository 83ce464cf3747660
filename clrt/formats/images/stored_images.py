"""Images as their files store them, read by libraries in the decoder process."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..decoder_process import MOST_BYTES
from .color_channels import LUMINANCE_CHROMA, NoColorError, color_channels

Found = tuple[dict[str, NDArray[Any]], dict[str, Any]]

#: An image larger than FREE_BYTES (8192 x 8192) is rejected if it decodes to more than MOST_RATIO times its file's
#: size; deflate reaches 1032.
FREE_BYTES = 2**28
MOST_RATIO = 2000
#: Parts of an image that are looked at.
MOST_PARTS = 256


def fits(decoded: int, stored: int) -> bool:
    """Return whether an image of so many bytes may come from a file of `stored` bytes."""
    return decoded <= min(MOST_BYTES, max(FREE_BYTES, MOST_RATIO * stored))


def check_size(file: str, width: int, height: int, decoded: int) -> None:
    """Raise ValueError if an image of so many bytes may not come from this file."""
    if not fits(decoded, os.path.getsize(file)):
        raise ValueError(f"{os.path.getsize(file)} bytes cannot contain {width}x{height} pixels")


def image(file: str) -> Found:
    """Return an image's pixels, (h, w, c) uint8, uint16 or float32 as stored, with unassociated alpha: red, green and
    blue, or grey, then alpha if there is any. They fill the display window, and are black outside of the data window.

    Facts: which channels they are, as "RGB", "RGBA", "Y" or "YA"; or what is missing, as `refused`.
    """
    import OpenImageIO as oiio

    oiio.attribute("limits:imagesize_MB", MOST_BYTES >> 20)
    try:
        parts = _parts(file)
        chosen = color_channels([(spec.get_string_attribute("name"), spec.channelnames) for spec in parts])
    except NoColorError as error:
        return {}, {"refused": str(error)}
    spec = parts[chosen.part]
    if spec.deep:
        return {}, {"refused": "is a deep image; flatten it"}
    channels = chosen.colors + chosen.alpha
    dtype = _dtype(spec, channels)
    area = max(spec.width * spec.height, spec.full_width * spec.full_height)
    first, last = min(channels), max(channels) + 1
    check_size(file, spec.width, spec.height, area * (last - first) * dtype.itemsize)
    kind = getattr(oiio, "FLOAT" if dtype == np.float32 else dtype.name.upper())
    buffer = _opened(file, chosen.part)
    pixels = buffer.get_pixels(kind) if buffer.read(chosen.part, 0, first, last, True, kind) else None
    if pixels is None and "subsampling" in (complaint := _complaint(buffer)):  # as OpenImageIO 3.1 says of RY and BY
        return {}, {"refused": LUMINANCE_CHROMA}
    if pixels is None:
        raise ValueError(complaint)
    pixels = _displayed(pixels[..., [channel - first for channel in channels]], spec)
    names = ("RGB" if len(chosen.colors) == 3 else "Y") + "A" * len(chosen.alpha)
    return {"pixels": pixels.astype(np.float32) if dtype == np.uint32 else pixels}, {"channels": names}


def layers(file: str, prefix: str) -> Found:
    """Return the layers of an image whose names begin with `prefix`, (h, w, 3) float32, by the rest of their names."""
    import OpenImageIO as oiio

    buffer = _opened(file, 0)
    spec = buffer.nativespec()
    places = {name: place for place, name in enumerate(spec.channelnames)}
    names = [name.removesuffix(".R") for name in places if name.startswith(prefix) and name.endswith(".R")]
    wanted = {name: [places.get(f"{name}.{channel}", -1) for channel in "RGB"] for name in names}
    if spec.deep or any(-1 in each for each in wanted.values()):
        return {}, {"refused": "is a deep image, or has a layer without one of R, G and B"}
    check_size(file, spec.width, spec.height, spec.width * spec.height * len(places) * 4)
    pixels = buffer.get_pixels(oiio.FLOAT) if wanted else None
    if buffer.has_error:
        raise ValueError(_complaint(buffer))
    return {} if pixels is None else {name[len(prefix) :]: pixels[..., each] for name, each in wanted.items()}, {}


def _parts(file: str) -> list[Any]:
    """Return the specification of each part of an OpenEXR file; of other files, that of the first image."""
    first = _opened(file, 0)
    parts = [first.nativespec()]
    if first.has_error:
        complaint = _complaint(first)
        raise NoColorError(LUMINANCE_CHROMA) if "Subsampled" in complaint else ValueError(complaint)
    count = first.nsubimages if first.file_format_name == "openexr" else 1
    return parts + [_opened(file, number).nativespec() for number in range(1, min(count, MOST_PARTS))]


def _opened(file: str, part: int) -> Any:
    import OpenImageIO as oiio

    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    return oiio.ImageBuf(file, part, 0, config)


def _dtype(spec: Any, channels: list[int]) -> np.dtype[Any]:
    """Return the dtype to read channels as: that of the file, or float32 for all others."""
    import OpenImageIO as oiio

    kinds = {oiio.UINT8: np.uint8, oiio.UINT16: np.uint16, oiio.UINT32: np.uint32}
    found = {kinds.get(spec.channelformat(channel).basetype, np.float32) for channel in channels}
    return np.dtype(found.pop() if len(found) == 1 else np.float32)


def _displayed(pixels: NDArray[Any], spec: Any) -> NDArray[Any]:
    """Return the pixels inside the display window, black where the file has none. Raises ValueError if all are."""
    left, top = spec.x - spec.full_x, spec.y - spec.full_y
    if (left, top, spec.width, spec.height) == (0, 0, spec.full_width, spec.full_height):
        return pixels
    whole = np.zeros((spec.full_height, spec.full_width, pixels.shape[2]), pixels.dtype)
    shown = pixels[max(-top, 0) : spec.full_height - top, max(-left, 0) : spec.full_width - left]
    if top >= spec.full_height or left >= spec.full_width or shown.size == 0:
        raise ValueError("its data window is outside its display window")
    top, left = max(top, 0), max(left, 0)
    whole[top : top + shown.shape[0], left : left + shown.shape[1]] = shown
    return whole


def _complaint(buffer: Any) -> str:
    """Return OpenImageIO's error message; it quotes raw bytes of damaged headers, which may not be valid text."""
    try:
        return str(buffer.geterror()).splitlines()[0]
    except (UnicodeDecodeError, IndexError):
        return "its header is damaged"


def avif(file: str) -> Found:
    """Decode an AVIF image to 8 bits per channel; pixels and facts as those of `image`."""
    from PIL import Image, features

    if not features.check("avif"):
        return {}, {"refused": "is an AVIF image, which this version of Pillow cannot read; pip install 'pillow>=11.3'"}
    with Image.open(file) as image:
        check_size(file, image.width, image.height, 4 * image.width * image.height)
        return {"pixels": np.asarray(image.convert("RGBA"))}, {"channels": "RGBA"}


def basis(file: str) -> Found:
    """Decode a KTX 2 image of Basis Universal; pixels and facts as those of `image`."""
    import opengl_basisu

    image = opengl_basisu.open(file)
    check_size(file, image.width, image.height, 4 * image.width * image.height)
    return {"pixels": image.transcode("rgba8").data}, {"channels": "RGBA"}
