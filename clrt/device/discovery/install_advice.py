"""Advice on what to install if there is no OpenCL device."""

from __future__ import annotations

import platform
import sys

#: Source of a CPU driver by system and processor. pip has PoCL only for Linux on x86-64.
DRIVERS = {
    ("linux", "x86_64"): 'install one with `pip install "pyopencl[pocl]"`',
    ("linux", ""): "install one with `apt install pocl-opencl-icd` (Debian, Ubuntu) or your distribution's PoCL",
    # Without Microsoft's C++ runtime, which not all machines have, Intel's driver fails to create a context.
    ("win32", "amd64"): "install one with `pip install intel-opencl-rt msvc-runtime`",
    # pip's pyopencl for macOS is linked with Apple's framework, which loads no other drivers.
    ("darwin", ""): "pip's pyopencl supports only Apple's OpenCL; conda-forge's also supports PoCL: "
    "`conda install -c conda-forge pyopencl pocl`",
}


def no_device(system: str = sys.platform, machine: str = platform.machine()) -> str:
    """Return the error message, with its remedy."""
    driver = DRIVERS.get((system, machine.lower())) or DRIVERS.get((system, ""))
    gpu = "" if system == "darwin" else "your GPU vendor's driver"
    return "no OpenCL device: " + (", or ".join(filter(None, (driver, gpu))) if driver else f"install {gpu}")
