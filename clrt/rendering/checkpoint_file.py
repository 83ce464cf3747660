"""The file of a checkpoint: a header and arrays, with a checksum, in two generations.

    clrt checkpoint 3\\n
    JSON in one line: {"header": …, "shapes": {name: [rows, columns …], …}}\\n
    the arrays' bytes, one after the other
    SHA-256 of all that, 32 bytes

A file is written beside its place and moved there when the disk has it; the one that was there stays as FILE~. Nothing
that is read is executed, and no memory is asked for that the file itself does not fill.
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

from ..errors import CheckpointError
from ..file_mode import keep_mode
from ..threads import beside
from .past_cache import write_past_cache

#: How those of any version begin.
FAMILY = b"clrt checkpoint "
MAGIC = FAMILY + b"3\n"
#: Bytes, more than any header has.
LONGEST_HEADER = 1 << 16

Arrays = dict[str, NDArray[Any]]


def older(path: Path) -> Path:
    """Where the generation before the one at `path` is."""
    return Path(f"{path}~")


def check_replaceable(path: Path, beginning: bytes) -> None:
    """Raise CheckpointError where a file at `path` does not begin so, as far as it goes: it is something else."""
    try:
        with open(path, "rb") as file:
            found = file.read(len(beginning))
    except FileNotFoundError:
        return
    except OSError as error:
        raise CheckpointError(f"{path}: cannot be read ({error.strerror}); name another file") from error
    if not beginning.startswith(found):
        raise CheckpointError(f"{path}: is there and is no checkpoint, so it is not replaced; name another file, or "
                              "remove it first")


def write_checkpoint(path: Path, header: Mapping[str, Any], arrays: Arrays, *, keep_older: bool = True) -> None:
    """Writes to `path`, on disk when it returns; what was there becomes the older generation unless told otherwise.

    A link stays a link, and the file that is replaced leaves its mode. OSError where it fails: then no generation is
    lost, and nothing is left beside them.
    """
    target = Path(os.path.realpath(path))
    temporary = Path(f"{target}.new")
    shapes = {name: array.shape for name, array in arrays.items()}
    line = json.dumps({"header": header, "shapes": shapes}).encode() + b"\n"
    try:
        with open(temporary, "wb", buffering=0) as file:
            pieces: list[bytes | memoryview] = [MAGIC, line, *map(_bytes, arrays.values())]
            digest = beside(lambda: _digest(pieces))    # both take their time, and neither needs Python's lock
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
    """The header, and the arrays that `kinds` names with their dtypes.

    ValueError, with the reason as the end of a sentence, unless the file is whole; OSError where it cannot be read.
    """
    with open(path, "rb") as file:
        size = os.fstat(file.fileno()).st_size
        magic, line = file.readline(len(MAGIC)), file.readline(LONGEST_HEADER)
        if magic != MAGIC:
            raise ValueError("is no checkpoint that this version of clrt can read")
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
        good = set(shapes) == set(kinds) and all(type(n) is int and 0 <= n < 1 << 40 and len(shape) < 5
                                                 for shape in shapes.values() for n in shape)
    except (ValueError, TypeError, LookupError, RecursionError):
        good = False
    if not good:
        raise ValueError("is damaged: its header makes no sense")
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
    """Has the disk keep the names, too, where the system can do that."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
