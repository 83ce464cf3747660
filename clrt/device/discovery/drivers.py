"""Find installed OpenCL drivers: the libraries that the ICD loader would load, and some that it would not find.

The loader reads .icd files, each of which names a library, in the folder OCL_ICD_VENDORS (or OPENCL_VENDOR_PATH, or
/etc/OpenCL/vendors); if that variable names a file, only this one is read. pip's pyopencl has a loader that also reads
its own folder. OCL_ICD_FILENAMES adds libraries. In addition, this module finds
- drivers installed in Python's environment, where pip leaves .icd files with paths that do not exist (Intel's);
- driver libraries without an .icd file, as in containers that got a GPU's driver from their host.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import pyopencl as cl

VENDORS = "/etc/OpenCL/vendors"
#: Libraries to look for whether or not an .icd file names them, unless a variable says where drivers are.
UNLISTED = ("libnvidia-opencl.so.1", "libamdocl64.so", "intel-opencl/libigdrcl.so")
FOLDERS = (
    f"/usr/lib/{os.uname().machine}-linux-gnu" if hasattr(os, "uname") else "",
    "/usr/lib64",
    "/usr/lib",
    "/usr/local/lib",
    "/usr/local/nvidia/lib64",
    "/usr/lib/wsl/lib",
    "/opt/rocm/lib",
    "/opt/rocm/opencl/lib",
)


@dataclass(frozen=True)
class Driver:
    """An OpenCL driver (ICD).

    library: a path, or a name that only the dynamic linker may find; source: the file or variable that names it.
    """

    library: str
    source: str


def installed_drivers() -> list[Driver]:
    """Return every driver once, in the order in which the loader would load them."""
    named = os.environ.get("OCL_ICD_VENDORS") or os.environ.get("OPENCL_VENDOR_PATH")
    if named and not os.path.isdir(named):
        drivers = [_driver(named, "OCL_ICD_VENDORS")]
    else:
        drivers = [
            *_listed(Path(named or VENDORS)),
            *_listed(Path(cl.__file__).parent / ".libs"),
            *(each for each in _listed(Path(sys.prefix) / "etc/OpenCL/vendors") if os.path.exists(each.library)),
        ]
        drivers += [] if named else _unlisted()
    drivers += [
        _driver(path, "OCL_ICD_FILENAMES") for path in os.environ.get("OCL_ICD_FILENAMES", "").split(os.pathsep) if path
    ]
    by_file = {os.path.realpath(driver.library): driver for driver in reversed(drivers)}
    return list(reversed(by_file.values()))


def _listed(folder: Path) -> Iterator[Driver]:
    """Yield the drivers that a folder's .icd files name."""
    with suppress(OSError):
        names = sorted(name for name in os.listdir(folder) if name.endswith(".icd"))
        yield from (_driver(os.path.join(folder, name), "") for name in names)


def _driver(path: str, variable: str) -> Driver:
    """Return the driver of an .icd file, or of a library that `variable` names."""
    if not path.endswith(".icd"):
        return Driver(_located(path), variable)
    if os.sep not in path:
        path = os.path.join(VENDORS, path)
    try:
        name = Path(path).read_text(encoding="utf-8", errors="replace").partition("\n")[0].strip()
    except OSError:
        name = ""
    return Driver(_located(name, os.path.dirname(path)) if name else path, path)


def _located(name: str, folder: str = "") -> str:
    """Return the path of a library that an .icd file in `folder` names, or the name itself if there is no such file.

    The name may lack a folder, and an absolute path may be that of another machine for what pip or conda installed.
    """
    if os.path.exists(name) and os.sep in name:
        return name
    if folder:
        own = os.path.normpath(os.path.join(folder, *[os.pardir] * 3, "lib")) if os.sep in name else folder
        if os.path.exists(path := os.path.join(own, os.path.basename(name))):
            return path
    paths = (os.path.join(place, os.path.basename(name)) for place in _linker_folders())
    return next((path for path in paths if os.path.exists(path)), name)


def _unlisted() -> list[Driver]:
    found = ((name, os.path.join(folder, name)) for name in UNLISTED for folder in _linker_folders())
    first = {name: path for name, path in reversed([each for each in found if os.path.exists(each[1])])}
    return [Driver(path, os.path.dirname(path)) for path in first.values()]


def _linker_folders() -> list[str]:
    """Return the folders that the dynamic linker searches, and others where drivers are known to be installed."""
    folders = os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep)
    with suppress(OSError):
        for file in sorted(os.scandir("/etc/ld.so.conf.d"), key=lambda entry: entry.name):
            folders += [line.strip() for line in Path(file).read_text(encoding="utf-8", errors="replace").splitlines()]
    return [folder for folder in [*folders, *FOLDERS] if folder.startswith("/")]
