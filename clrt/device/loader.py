"""OpenCL's loader, made to load the drivers it is told, and on Linux no others.

It reads its environment once, when a process first asks for platforms. So for that moment its variables name a folder
with an .icd file for each wanted driver, and pyopencl's own folder is named nowhere, or name libraries that are added
to all others; after it they are as they were.
"""

from __future__ import annotations

import ctypes
import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

import pyopencl as cl

from ..errors import DeviceError

#: The loaders' variables that name folders: of all of them, of Khronos', of pip's; and the one that names libraries.
VARIABLES = ("OCL_ICD_VENDORS", "OPENCL_VENDOR_PATH", "PYOPENCL_HOME")
FILENAMES = "OCL_ICD_FILENAMES"


def load(libraries: Sequence[str]) -> list[cl.Platform]:
    """The platforms of these drivers alone; on Linux. A process can ask for one choice only.

    Raises DeviceError where no temporary file can be written.
    """
    try:
        with tempfile.TemporaryDirectory(prefix="clrt-drivers-") as folder:
            for number, library in enumerate(libraries):
                (Path(folder) / f"{number:03}.icd").write_bytes(os.fsencode(f"{library}\n"))
            with _variables(**dict.fromkeys(VARIABLES, folder) | {FILENAMES: None}):
                return _platforms()
    except OSError as error:
        raise DeviceError(f"no temporary file can be written ({error.strerror}), which OpenCL's loader needs; free "
                          "some space, or name another folder with TMPDIR") from error


def load_all(added: Sequence[str]) -> list[cl.Platform]:
    """The platforms of all drivers that the loader finds by itself, and of these."""
    named = os.environ.get(FILENAMES)
    with _variables(**{FILENAMES: os.pathsep.join([*added, *filter(None, [named])]) or None}):
        return _platforms()


def library() -> ctypes.CDLL:
    """The loader that pyopencl is linked with, for what pyopencl does not ask it, or asks holding Python's lock."""
    if sys.platform == "win32":     # where a library does not lend out the functions of those that it is linked with
        bundled = Path(cl.__file__).parents[1].glob("pyopencl.libs/opencl-*.dll")
        return ctypes.CDLL(next(map(str, bundled), "OpenCL.dll"))
    else:
        return ctypes.CDLL(cl._cl.__file__)


def _platforms() -> list[cl.Platform]:
    """Of the drivers that are loaded now, past pyopencl: that holds Python's lock meanwhile, 6 ms for PoCL, and 5 as it
    is first asked for its devices."""
    try:
        with suppress(OSError, AttributeError):
            loader, count = library(), ctypes.c_uint()
            loader.clGetPlatformIDs(0, None, ctypes.byref(count))
            for platform in cl.get_platforms():
                loader.clGetDeviceIDs(ctypes.c_void_p(platform.int_ptr), ctypes.c_uint64(cl.device_type.ALL), 0, None,
                                      ctypes.byref(count))
        return cl.get_platforms()
    except cl.Error:  # there are none
        return []


def devices_of(platform: cl.Platform) -> list[cl.Device]:
    """Its devices; one without any must not hide the others."""
    try:
        return platform.get_devices()
    except cl.Error:
        return []


@contextmanager
def _variables(**values: str | None) -> Iterator[None]:
    """Meanwhile the environment has these, and lacks those that are None."""
    before = {name: os.environ.get(name) for name in values}
    _set(values)
    try:
        yield
    finally:
        _set(before)


def _set(values: dict[str, str | None]) -> None:
    for name, value in values.items():
        os.environ.pop(name, None)
        os.environ |= {} if value is None else {name: value}
