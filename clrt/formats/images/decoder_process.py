"""Decoder process that scene.decoder starts as `python -m clrt.formats.images.decoder_process`.

It reads one request per line, [kind, file, options] in JSON. A reply is one line of JSON, {"error": ...} or {"arrays":
{name: [shape, dtype]}, "facts": ...}, followed by the bytes of the arrays.
"""

from __future__ import annotations

import json
import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .color_channels import LUMINANCE_CHROMA, NoColorError, color_channels

Found = tuple[dict[str, NDArray[Any]], dict[str, Any]]

#: Memory limit of this process in bytes, and of the largest image: 16384 x 8192 pixels of four floats.
MOST_MEMORY = 8 * 2**30
MOST_BYTES = 2**31
#: An image larger than FREE_BYTES (8192 x 8192) is rejected if it decodes to more than MOST_RATIO times its file's
#: size; deflate reaches 1032.
FREE_BYTES = 2**28
MOST_RATIO = 2000
#: Memory for a file that a decoder of MODULES reads: FREE_MEMORY, and MEMORY_RATIO times the file's size.
FREE_MEMORY = 2**31
MEMORY_RATIO = 100
#: Idle seconds after which the process exits.
IDLE = 2.0
#: Parts of an image that are looked at.
MOST_PARTS = 256


def fits(decoded: int, stored: int) -> bool:
    """Return whether an image of so many bytes may come from a file of `stored` bytes."""
    return decoded <= min(MOST_BYTES, max(FREE_BYTES, MOST_RATIO * stored))


def check_size(file: str, width: int, height: int, decoded: int) -> None:
    """Raise ValueError if an image of so many bytes may not come from this file."""
    if not fits(decoded, os.path.getsize(file)):
        raise ValueError(f"{os.path.getsize(file)} bytes cannot contain {width}x{height} pixels")


def picture(file: str) -> Found:
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


def draco(file: str) -> Found:
    """Decode a Draco mesh: faces (m, 3) uint32, and each attribute (n, k) as "attribute ID"."""
    import DracoPy

    with open(file, "rb") as content:
        mesh = DracoPy.decode(content.read())
    faces = np.asarray(mesh.faces, np.uint32).reshape(-1, 3)
    return {
        "faces": faces,
        **{f"attribute {attribute['unique_id']}": np.asarray(attribute["data"]) for attribute in mesh.attributes},
    }, {}


def avif(file: str) -> Found:
    """Decode an AVIF image to 8 bits per channel; pixels and facts as those of `picture`."""
    from PIL import Image, features

    if not features.check("avif"):
        return {}, {"refused": "is an AVIF image, which this version of Pillow cannot read; pip install 'pillow>=11.3'"}
    with Image.open(file) as image:
        check_size(file, image.width, image.height, 4 * image.width * image.height)
        return {"pixels": np.asarray(image.convert("RGBA"))}, {"channels": "RGBA"}


def basis(file: str) -> Found:
    """Decode a KTX 2 image of Basis Universal; pixels and facts as those of `picture`."""
    import opengl_basisu

    image = opengl_basisu.open(file)
    check_size(file, image.width, image.height, 4 * image.width * image.height)
    return {"pixels": image.transcode("rgba8").data}, {"channels": "RGBA"}


KINDS: dict[str, Callable[..., Found]] = {"picture": picture, "draco": draco, "avif": avif, "basis": basis}
#: Modules whose function `decode` decodes further kinds of file.
MODULES = {"3mf": "clrt.formats.threemf.package", "usd": "clrt.formats.usd.stage"}


def _decoder(kind: str) -> Callable[..., Found]:
    """Return the function that decodes files of a kind."""
    function: Callable[..., Found] = KINDS.get(kind) or import_module(MODULES[kind]).decode
    return function


def main() -> None:
    """Answer requests until standard input ends. The libraries' own output is redirected to standard error."""
    with os.fdopen(os.dup(1), "wb") as replies:
        os.dup2(2, 1)
        _limit()
        while True:
            idle = threading.Timer(IDLE, os._exit, [0])
            idle.start()
            line = sys.stdin.readline()
            idle.cancel()
            if not line:
                os._exit(0)  # skips unloading the libraries, which may crash
            _answer(replies, *json.loads(line))


def _answer(replies: Any, kind: str, file: str, options: dict[str, Any]) -> None:
    arrays: dict[str, NDArray[Any]] = {}
    facts: dict[str, Any] = {}
    try:
        with _memory_for(file) if kind in MODULES else nullcontext():
            arrays, facts = _decoder(kind)(file, **options)
        reply: dict[str, Any] = {"facts": facts}
    except MemoryError:
        reply = {"error": "it needs too much memory"}
    except Exception as error:  # a damaged file may make the libraries raise anything
        reply = {"error": str(error) or type(error).__name__}
    if sum(array.nbytes for array in arrays.values()) > MOST_BYTES:
        arrays, reply = {}, {"error": f"its content exceeds {MOST_BYTES >> 30} GiB"}
    arrays = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
    reply["arrays"] = {name: [array.shape, array.dtype.str] for name, array in arrays.items()}
    replies.write(json.dumps(reply).encode() + b"\n")
    for array in arrays.values():
        replies.write(array.reshape(-1).view(np.uint8).data)
    replies.flush()


@contextmanager
def _memory_for(file: str) -> Iterator[None]:
    """Limit further memory in proportion to a file, where the system says how much there is in use."""
    try:
        used = int(Path("/proc/self/statm").read_text().split()[5]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        yield
        return
    import resource

    before = resource.getrlimit(resource.RLIMIT_DATA)
    most = used + FREE_MEMORY + MEMORY_RATIO * os.path.getsize(file)
    with suppress(ValueError):
        resource.setrlimit(resource.RLIMIT_DATA, (most, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, before)


def _limit() -> None:
    """Limit memory, if the system supports it, and disable core dumps."""
    if sys.platform != "win32":
        import resource

        for kind, most in ((resource.RLIMIT_AS, MOST_MEMORY), (resource.RLIMIT_CORE, 0)):
            hard = resource.getrlimit(kind)[1]
            with suppress(ValueError):  # some systems refuse a limit
                resource.setrlimit(kind, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))


if __name__ == "__main__":
    main()
