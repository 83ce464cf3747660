"""The library that writes pictures, loaded beside all else, so that nothing waits for it in the end."""

from __future__ import annotations

import ctypes
import os
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

from ..threads import beside


def load_writer() -> None:
    """Begins to load it.

    The best time is while modules are imported that are Python alone: whoever asks the system's loader for something
    meanwhile waits, holding Python's lock. So do extension modules, and numpy where it finds out whether the memory of
    a large intermediate result may be used again.
    """
    beside(_load)


def _load() -> None:
    """Most of it is for the system's loader, which is asked past Python's import: that would hold Python's lock."""
    spec = find_spec("OpenImageIO")
    for folder in spec.submodule_search_locations or () if spec else ():
        for library in Path(folder).glob("OpenImageIO.*.so"):
            with suppress(TypeError, AttributeError):   # not on Windows
                ctypes.CDLL(None).dlopen(os.fsencode(library), os.RTLD_NOW)
    import OpenImageIO  # noqa: F401
