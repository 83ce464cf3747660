"""OpenCL's loader, made to load the drivers it is told and no others.

It reads its environment once, when a process first asks for platforms. So for that moment its variables name a folder
with an .icd file for each wanted driver, and pyopencl's own folder is named nowhere; after it they are as they were.
"""

from __future__ import annotations

import ctypes
import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

import pyopencl as cl

#: The loaders' variables: of all of them, of Khronos', of pip's.
VARIABLES = ("OCL_ICD_VENDORS", "OPENCL_VENDOR_PATH", "OCL_ICD_FILENAMES", "PYOPENCL_HOME")


def load(libraries: Sequence[str] | None) -> list[cl.Platform]:
    """The platforms of these drivers; None leaves the loader alone. A process can ask for one choice only."""
    try:
        if libraries is None:
            return _platforms()
        with _only(libraries):
            return _platforms()
    except cl.Error:  # there are none
        return []


def _platforms() -> list[cl.Platform]:
    """Of the drivers that are loaded now, past pyopencl: that holds Python's lock meanwhile, 6 ms for PoCL, and 5 as it
    is first asked for its devices."""
    with suppress(OSError, AttributeError):
        loader, count = ctypes.CDLL(cl._cl.__file__), ctypes.c_uint()
        loader.clGetPlatformIDs(0, None, ctypes.byref(count))
        for platform in cl.get_platforms():
            loader.clGetDeviceIDs(ctypes.c_void_p(platform.int_ptr), ctypes.c_uint64(cl.device_type.ALL), 0, None,
                                  ctypes.byref(count))
    return cl.get_platforms()


def devices_of(platform: cl.Platform) -> list[cl.Device]:
    """Its devices; one without any must not hide the others."""
    try:
        return platform.get_devices()
    except cl.Error:
        return []


@contextmanager
def _only(libraries: Sequence[str]) -> Iterator[None]:
    before = {name: os.environ.get(name) for name in VARIABLES}
    with tempfile.TemporaryDirectory(prefix="clrt-drivers-") as folder:
        for number, library in enumerate(libraries):
            (Path(folder) / f"{number:03}.icd").write_bytes(os.fsencode(f"{library}\n"))
        os.environ |= {"OCL_ICD_VENDORS": folder, "OPENCL_VENDOR_PATH": folder, "PYOPENCL_HOME": folder}
        os.environ.pop("OCL_ICD_FILENAMES", None)
        try:
            yield
        finally:
            for name, value in before.items():
                os.environ.pop(name, None)
                os.environ |= {} if value is None else {name: value}
