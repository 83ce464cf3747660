"""Have the OpenCL ICD loader load the given drivers, and on Linux no others.

The loader reads its environment once, when a process first queries the platforms. For that moment its variables name a
folder with an .icd file for each of the drivers (in place of pyopencl's own folder, too), or name libraries to add to
all others; afterwards they are restored.
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

from ...errors import DeviceError

#: The loaders' variables that name folders (all loaders', Khronos's, pip's), and the one that names libraries.
VARIABLES = ("OCL_ICD_VENDORS", "OPENCL_VENDOR_PATH", "PYOPENCL_HOME")
FILENAMES = "OCL_ICD_FILENAMES"


def load(libraries: Sequence[str]) -> list[cl.Platform]:
    """Return the platforms of these drivers only (on Linux). A process can make this choice only once.

    Raises DeviceError if no temporary file can be written.
    """
    try:
        with tempfile.TemporaryDirectory(prefix="clrt-drivers-") as folder:
            for number, library in enumerate(libraries):
                (Path(folder) / f"{number:03}.icd").write_bytes(os.fsencode(f"{library}\n"))
            with _variables(**dict.fromkeys(VARIABLES, folder) | {FILENAMES: None}):
                return _platforms()
    except OSError as error:
        raise DeviceError(
            f"cannot write a temporary file ({error.strerror}), which OpenCL's loader needs; free "
            "some space, or set TMPDIR to another folder"
        ) from error


def load_all(added: Sequence[str]) -> list[cl.Platform]:
    """Return the platforms of all drivers that the loader finds by itself, and of `added`."""
    named = os.environ.get(FILENAMES)
    with _variables(**{FILENAMES: os.pathsep.join([*added, *filter(None, [named])]) or None}):
        return _platforms()


def library() -> ctypes.CDLL:
    """Return the ICD loader that pyopencl is linked with, for calls that pyopencl lacks or makes holding the GIL."""
    if sys.platform == "win32":  # where a library does not export the symbols of those that it is linked with
        bundled = Path(cl.__file__).parents[1].glob("pyopencl.libs/opencl-*.dll")
        return ctypes.CDLL(next(map(str, bundled), "OpenCL.dll"))
    else:
        return ctypes.CDLL(cl._cl.__file__)


def _platforms() -> list[cl.Platform]:
    """Return the platforms of the drivers, loaded now by direct calls.

    pyopencl would hold the GIL meanwhile: 6 ms for PoCL, and another 5 ms for the first query of its devices.
    """
    try:
        with suppress(OSError, AttributeError):
            loader, count = library(), ctypes.c_uint()
            loader.clGetPlatformIDs(0, None, ctypes.byref(count))
            for platform in cl.get_platforms():
                loader.clGetDeviceIDs(
                    ctypes.c_void_p(platform.int_ptr), ctypes.c_uint64(cl.device_type.ALL), 0, None, ctypes.byref(count)
                )
        return cl.get_platforms()
    except cl.Error:  # no platforms
        return []


def devices_of(platform: cl.Platform) -> list[cl.Device]:
    """Return the devices of a platform; none on an error, so that it does not hide the other platforms' devices."""
    try:
        return platform.get_devices()
    except cl.Error:
        return []


@contextmanager
def _variables(**values: str | None) -> Iterator[None]:
    """Set environment variables temporarily; those that are None are removed."""
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
