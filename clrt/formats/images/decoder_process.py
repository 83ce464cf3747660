"""Decoder process that scene.decoder starts as `python -m clrt.formats.images.decoder_process`.

It reads one request per line, [kind, file] in JSON. A reply is one line of JSON, {"error": ...} or {"arrays": {name:
[shape, dtype]}, "facts": ...}, followed by the bytes of the arrays.
"""

from __future__ import annotations

import json
import os
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

Found = tuple[dict[str, NDArray[Any]], dict[str, Any]]

#: Memory limit of this process in bytes, and of the largest image: 16384 x 8192 pixels of four floats.
MOST_MEMORY = 8 * 2**30
MOST_BYTES = 2**31
#: An image larger than FREE_BYTES (8192 x 8192) is rejected if it decodes to more than MOST_RATIO times its file's
#: size; deflate reaches 1032.
FREE_BYTES = 2**28
MOST_RATIO = 2000
#: Idle seconds after which the process exits.
IDLE = 2.0


def fits(decoded: int, stored: int) -> bool:
    """Return whether an image of so many bytes may come from a file of `stored` bytes."""
    return decoded <= min(MOST_BYTES, max(FREE_BYTES, MOST_RATIO * stored))


def picture(file: str) -> Found:
    """Return an image's pixels, (h, w, c) uint8, uint16 or float32 as stored, with unassociated alpha.

    Facts: the channel names, and the size of the full image, of which the pixels may be a crop.
    """
    import OpenImageIO as oiio

    oiio.attribute("limits:imagesize_MB", MOST_BYTES >> 20)
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    buffer = oiio.ImageBuf(file, 0, 0, config)
    kinds = {oiio.UINT8: (oiio.UINT8, 1), oiio.UINT16: (oiio.UINT16, 2)}
    spec = buffer.nativespec()
    kind, size = kinds.get(spec.format.basetype, (oiio.FLOAT, 4))
    count = spec.width * spec.height * spec.nchannels * size
    if not fits(count, os.path.getsize(file)):
        raise ValueError(f"{os.path.getsize(file)} bytes cannot contain {spec.width}x{spec.height} pixels")
    pixels = buffer.get_pixels(kind) if buffer.read(0, 0, True, kind) else None
    if pixels is None:
        raise ValueError(_complaint(buffer))
    return {"pixels": pixels}, {
        "channels": list(spec.channelnames),
        "whole": [spec.full_width, spec.full_height],
        "cropped": buffer.roi != buffer.roi_full,
    }


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


KINDS: dict[str, Callable[[str], Found]] = {"picture": picture, "draco": draco}


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


def _answer(replies: Any, kind: str, file: str) -> None:
    arrays: dict[str, NDArray[Any]] = {}
    facts: dict[str, Any] = {}
    try:
        arrays, facts = KINDS[kind](file)
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
