"""Background loading of the library that writes images, so that saving does not wait for it."""

from __future__ import annotations

import ctypes
import os
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

from ..threads import beside


def load_writer() -> None:
    """Start to load the library.

    This is best done while pure-Python modules are being imported: anything that uses the system's loader meanwhile
    waits, holding Python's lock. That includes extension modules, and numpy when it checks whether the memory of a
    large temporary can be reused.
    """
    beside(_load)


def _load() -> None:
    """Load most of it by the system's loader, without Python's import, which would hold Python's lock."""
    spec = find_spec("OpenImageIO")
    for folder in spec.submodule_search_locations or () if spec else ():
        for library in Path(folder).glob("OpenImageIO.*.so"):
            with suppress(TypeError, AttributeError):  # not on Windows
                ctypes.CDLL(None).dlopen(os.fsencode(library), os.RTLD_NOW)
    import OpenImageIO  # noqa: F401
