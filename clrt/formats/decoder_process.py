"""Decoder process, which decoder.py starts as `python -m clrt.formats.decoder_process`.

It reads one request per line, [kind, file, options] in JSON. A reply is one line of JSON, {"error": ...} or {"arrays":
{name: [shape, dtype]}, "facts": ...}, followed by the bytes of the arrays.
"""

from __future__ import annotations

import json
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Functions that decode files of each kind: from a file and options to arrays by name and other facts.
DECODERS = {
    "image": "clrt.formats.images.stored_images:image",
    "avif": "clrt.formats.images.stored_images:avif",
    "basis": "clrt.formats.images.stored_images:basis",
    "layers": "clrt.formats.images.stored_images:layers",
    "draco": "clrt.formats.gltf.draco_mesh:decode",
    "3mf": "clrt.formats.threemf.package:decode",
    "usd": "clrt.formats.usd.stage:decode",
}
#: Kinds that take memory in proportion to their file.
MODELS = ("3mf", "usd")
#: Memory limit of this process in bytes; of a file of MODELS, FREE_MEMORY and MEMORY_RATIO times the file's size.
MOST_MEMORY = 8 * 2**30
FREE_MEMORY = 2**31
MEMORY_RATIO = 100
#: Maximum number of bytes that a file is decoded to: an image of 16384 x 8192 pixels of four floats.
MOST_BYTES = 2**31
#: Idle seconds after which the process exits.
IDLE = 2.0


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
        module, function = DECODERS[kind].split(":")
        with _memory_for(kind, file):
            arrays, facts = getattr(import_module(module), function)(file, **options)
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
def _memory_for(kind: str, file: str) -> Iterator[None]:
    """Limit further memory in proportion to a file of MODELS, where the system says how much is in use."""
    status = Path("/proc/self/statm")
    if kind not in MODELS or not status.is_file():
        yield
        return
    import resource

    used = int(status.read_text().split()[5]) * os.sysconf("SC_PAGE_SIZE")
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
