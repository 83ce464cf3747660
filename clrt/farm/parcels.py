"""What is sent to workers: a small text of what there is, and the large arrays by what is in them.

An array is known by the SHA-256 of its type, shape and bytes. So those that several frames share, or several meshes,
travel once. Whoever unpacks a parcel gets scenes made of these arrays and opens no file; what the text may name are the
classes of clrt's scenes and numpy's numbers.
"""

from __future__ import annotations

import hashlib
import io
import pickle
from collections.abc import Mapping
from dataclasses import dataclass, is_dataclass
from functools import cached_property
from pathlib import PurePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError

#: Bytes from which on an array travels by itself.
LARGE = 1 << 14
#: In the place of where a file lies on the client, which means nothing elsewhere: it arrives as None.
HERE = "a file"
#: What a text may name: the dataclasses of some modules, and single names.
ROOMS = ("clrt.scene.", "clrt.accel.kernels", "clrt.rendering.choices", "clrt.farm.orders")
NAMES = {("numpy", "ndarray"), ("numpy", "dtype"), ("collections", "OrderedDict"), ("builtins", "complex"),
         *((f"numpy.{core}", name) for core in ("core.multiarray", "_core.multiarray")
           for name in ("_reconstruct", "scalar")),
         *((f"numpy.{core}", "_frombuffer") for core in ("core.numeric", "_core.numeric"))}

Arrays = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class Parcel:
    """The text, and the arrays that it speaks of, by their digests."""

    text: bytes
    arrays: Arrays

    @cached_property
    def key(self) -> str:
        """SHA-256 of all that is in it."""
        return hashlib.sha256(self.text).hexdigest()


def pack(value: object) -> Parcel:
    """A parcel of scenes, settings and plain values."""
    arrays: Arrays = {}
    digests: dict[int, str] = {}
    written = io.BytesIO()
    pickler = _Pickler(written, protocol=5)
    pickler.arrays, pickler.digests = arrays, digests
    pickler.dump(value)
    return Parcel(written.getvalue(), arrays)


def unpack(text: bytes, arrays: Mapping[str, NDArray[Any]]) -> Any:
    """What was packed. SceneError where the text names anything that no scene is made of, or arrays that are not
    there."""
    unpickler = _Unpickler(io.BytesIO(text))
    unpickler.arrays = arrays
    return unpickler.load()


def digest_of(array: NDArray[Any]) -> str:
    """What an array is known by."""
    digest = hashlib.sha256(f"{array.dtype.str}{array.shape}".encode())
    digest.update(np.ascontiguousarray(array).reshape(-1).view(np.uint8).data)
    return digest.hexdigest()


class _Pickler(pickle.Pickler):
    arrays: Arrays
    digests: dict[int, str]

    def persistent_id(self, value: object) -> str | None:
        if isinstance(value, PurePath):
            return HERE
        if not isinstance(value, np.ndarray) or value.nbytes < LARGE or value.dtype.hasobject:
            return None
        digest = self.digests.get(id(value)) or digest_of(value)
        self.digests[id(value)] = digest
        self.arrays[digest] = value
        return digest


class _Unpickler(pickle.Unpickler):
    arrays: Mapping[str, NDArray[Any]]

    def persistent_load(self, digest: Any) -> NDArray[Any] | None:
        if digest == HERE:
            return None
        if digest not in self.arrays:
            raise SceneError(f"what was sent lacks an array ({digest})")
        return self.arrays[digest]

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) in NAMES:
            return super().find_class(module, name)
        if module.startswith(ROOMS) and "." not in name and is_dataclass(found := super().find_class(module, name)):
            return found
        raise SceneError(f"what was sent names {module}.{name}, which no scene is made of")
