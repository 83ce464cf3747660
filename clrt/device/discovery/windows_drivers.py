"""Windows drivers that the registry does not list: those that pip installs in Python's environment.

The OpenCL loader reads the registry's HKEY_LOCAL_MACHINE, which pip cannot write, and OCL_ICD_FILENAMES, but the latter
only in a process without administrator rights (the Khronos loader's icd_windows_envvars.c).
"""

from __future__ import annotations

import ctypes
import os
import site
import sys

from .drivers import Driver

#: What intel-opencl-rt installs, relative to Python's prefix.
LIBRARIES = (r"Library\bin\intelocl64.dll",)
KEY = r"HKLM\SOFTWARE\Khronos\OpenCL\Vendors"


def pip_drivers() -> list[Driver]:
    """Return drivers in Python's prefix and the user's (`pip install --user`); none on systems other than Windows."""
    return installed_in([sys.prefix, site.getuserbase()]) if sys.platform == "win32" else []


def installed_in(prefixes: list[str]) -> list[Driver]:
    """Return the distinct drivers in these folders."""
    paths = (os.path.join(prefix, *library.split("\\")) for prefix in prefixes for library in LIBRARIES)
    return [Driver(path, "pip") for path in dict.fromkeys(paths) if os.path.exists(path)]


def is_loaded(driver: Driver) -> bool:
    """Return whether this process has loaded the driver's library."""
    if sys.platform == "win32":
        handle = ctypes.WinDLL("kernel32").GetModuleHandleW
        handle.argtypes, handle.restype = [ctypes.c_wchar_p], ctypes.c_void_p
        return handle(driver.library) is not None
    else:
        return False


def not_loaded(driver: Driver) -> str:
    """Return why a driver is not loaded, and the remedy."""
    return (
        "OpenCL's loader did not load it: in a process with administrator rights it loads only what the registry "
        f'lists. Run clrt without them, or register it: reg add {KEY} /v "{driver.library}" /t REG_DWORD /d 0'
    )
