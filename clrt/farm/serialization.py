"""Serialisation for workers: a small pickle, and the large arrays by content hash.

An array is identified by the SHA-256 of its type, shape and bytes, so arrays that several frames or meshes share are
sent once. Unpacking creates scenes from these arrays and opens no file; the pickle may name only the classes of clrt's
scenes and numpy's numbers.
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
from ..scene.animation import ModelAnimation

#: Size in bytes from which on an array is sent separately.
LARGE = 1 << 14
#: Placeholder for the client's file paths and models' animations, which have no meaning elsewhere: they arrive as None.
HERE = "a file"
#: Classes that a pickle may name: the dataclasses of these modules, and single names.
ROOMS = ("clrt.scene.", "clrt.accel.methods", "clrt.rendering.compile.choices", "clrt.farm.orders")
NAMES = {
    ("numpy", "ndarray"),
    ("numpy", "dtype"),
    ("collections", "OrderedDict"),
    ("builtins", "complex"),
    *(("datetime", name) for name in ("datetime", "timezone", "timedelta")),
    *(
        (f"numpy.{core}", name)
        for core in ("core.multiarray", "_core.multiarray")
        for name in ("_reconstruct", "scalar")
    ),
    *((f"numpy.{core}", "_frombuffer") for core in ("core.numeric", "_core.numeric")),
}

Arrays = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class Serialized:
    """The pickle, and the arrays that it refers to by digest."""

    text: bytes
    arrays: Arrays

    @cached_property
    def key(self) -> str:
        """Return the SHA-256 that identifies the contents."""
        return hashlib.sha256(self.text).hexdigest()


def pack(value: object) -> Serialized:
    """Pack scenes, settings and plain values."""
    arrays: Arrays = {}
    digests: dict[int, str] = {}
    written = io.BytesIO()
    pickler = _Pickler(written, protocol=5)
    pickler.arrays, pickler.digests = arrays, digests
    pickler.dump(value)
    return Serialized(written.getvalue(), arrays)


def unpack(text: bytes, arrays: Mapping[str, NDArray[Any]]) -> Any:
    """Return what was packed.

    Raises SceneError if the pickle names anything that is not part of a scene, or arrays that are missing.
    """
    unpickler = _Unpickler(io.BytesIO(text))
    unpickler.arrays = arrays
    return unpickler.load()


def digest_of(array: NDArray[Any]) -> str:
    """Return the digest that identifies an array."""
    digest = hashlib.sha256(f"{array.dtype.str}{array.shape}".encode())
    digest.update(np.ascontiguousarray(array).reshape(-1).view(np.uint8).data)
    return digest.hexdigest()


class _Pickler(pickle.Pickler):
    arrays: Arrays
    digests: dict[int, str]

    def persistent_id(self, value: object) -> str | None:
        if isinstance(value, PurePath | ModelAnimation):
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
            raise SceneError(f"the received scene lacks an array ({digest})")
        return self.arrays[digest]

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) in NAMES:
            return super().find_class(module, name)
        if module.startswith(ROOMS) and "." not in name and is_dataclass(found := super().find_class(module, name)):
            return found
        raise SceneError(f"the received scene contains {module}.{name}, which is not allowed in a scene")
