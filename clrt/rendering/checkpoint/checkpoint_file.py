"""Checkpoint file: a header and arrays, with a checksum, in two generations.

    clrt checkpoint 4\\n
    JSON in one line: {"header": …, "shapes": {name: [rows, columns …], …}}\\n
    the arrays' bytes, one after the other
    SHA-256 of all that, 32 bytes

A file is written to a temporary file next to its destination and renamed once it is on disk; the previous one remains
as FILE~. Nothing that is read is executed, and no more memory is allocated than the size of the file itself justifies.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import CheckpointError
from ...file_mode import keep_mode
from ...threads import beside
from .direct_io import write_past_cache

#: First bytes of checkpoints of any version.
FAMILY = b"clrt checkpoint "
MAGIC = FAMILY + b"4\n"
#: Maximum header length in bytes, larger than any real header.
LONGEST_HEADER = 1 << 16

Arrays = dict[str, NDArray[Any]]


def older(path: Path) -> Path:
    """Return the path of the previous generation of the checkpoint at `path`."""
    return Path(f"{path}~")


def check_replaceable(path: Path, beginning: bytes) -> None:
    """Raise CheckpointError if a file at `path` does not start with `beginning` (or a prefix of it, if shorter)."""
    try:
        with open(path, "rb") as file:
            found = file.read(len(beginning))
    except FileNotFoundError:
        return
    except OSError as error:
        raise CheckpointError(f"{path}: cannot be read ({error.strerror}); choose another file") from error
    if not beginning.startswith(found):
        raise CheckpointError(
            f"{path}: exists and is not a checkpoint, so it is not replaced; choose another file, or remove it first"
        )


def write_checkpoint(path: Path, header: Mapping[str, Any], arrays: Arrays, *, keep_older: bool = True) -> None:
    """Write a checkpoint to `path`, synced to disk on return; the existing one becomes the older generation if
    `keep_older`.

    A symbolic link stays a link, and the new file takes over the mode of the replaced one. Raises OSError if it fails:
    then no generation is lost, and no temporary file remains.
    """
    target = Path(os.path.realpath(path))
    temporary = Path(f"{target}.new")
    shapes = {name: array.shape for name, array in arrays.items()}
    line = json.dumps({"header": header, "shapes": shapes}).encode() + b"\n"
    try:
        with open(temporary, "wb", buffering=0) as file:
            pieces: list[bytes | memoryview] = [MAGIC, line, *map(_bytes, arrays.values())]
            digest = beside(lambda: _digest(pieces))  # both take long, and both release the GIL
            write_past_cache(file.fileno(), _followed_by(pieces, digest))
            os.fsync(file.fileno())
        keep_mode(target, temporary)
        if keep_older:
            with suppress(FileNotFoundError):
                os.replace(target, older(target))
        os.replace(temporary, target)
    except BaseException:
        with suppress(OSError):
            temporary.unlink()
        raise
    _sync_folder(target.parent)


def read_checkpoint(path: Path, kinds: Mapping[str, np.dtype[Any]]) -> tuple[dict[str, Any], Arrays]:
    """Return the header and the arrays named by `kinds`, with the dtypes given there.

    Raises ValueError, with the reason as the end of a sentence, if the file is not intact; OSError if it cannot be
    read.
    """
    with open(path, "rb") as file:
        size = os.fstat(file.fileno()).st_size
        magic, line = file.readline(len(MAGIC)), file.readline(LONGEST_HEADER)
        if magic != MAGIC:
            raise ValueError("is not a checkpoint that this version of clrt can read")
        header, shapes = _header(line, kinds)
        expected = len(magic) + len(line) + sum(prod(shapes[name]) * kinds[name].itemsize for name in shapes) + 32
        if size != expected:
            raise ValueError(f"is {size} bytes long and should be {expected}")
        digest, arrays = hashlib.sha256(magic + line), {}
        for name, shape in shapes.items():
            arrays[name] = np.empty(shape, kinds[name])
            file.readinto(_bytes(arrays[name]))
            digest.update(_bytes(arrays[name]))
        if file.read(33) != digest.digest():
            raise ValueError("is damaged: its checksum is wrong")
    return header, arrays


def _header(line: bytes, kinds: Mapping[str, np.dtype[Any]]) -> tuple[dict[str, Any], dict[str, list[int]]]:
    try:
        read = json.loads(line)
        header, shapes = dict(read["header"]), dict(read["shapes"])
        good = set(shapes) == set(kinds) and all(
            type(n) is int and 0 <= n < 1 << 40 and len(shape) < 5 for shape in shapes.values() for n in shape
        )
    except (ValueError, TypeError, LookupError, RecursionError):
        good = False
    if not good:
        raise ValueError("is damaged: its header is invalid")
    return header, shapes


def _digest(pieces: Iterable[bytes | memoryview]) -> bytes:
    digest = hashlib.sha256()
    for piece in pieces:
        digest.update(piece)
    return digest.digest()


def _followed_by(pieces: Iterable[bytes | memoryview], last: Callable[[], bytes]) -> Iterator[bytes | memoryview]:
    yield from pieces
    yield last()


def _bytes(array: NDArray[Any]) -> memoryview:
    return np.ascontiguousarray(array).reshape(-1).view(np.uint8).data


def _sync_folder(folder: Path) -> None:
    """Sync the directory entries to disk as well, if the system supports that."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
