"""What to install where there is no OpenCL device."""

from __future__ import annotations

import platform
import sys

#: By the system and its processors: where a CPU driver comes from. pip has PoCL for Linux on x86-64 alone.
DRIVERS = {
    ("linux", "x86_64"): 'install one with `pip install "pyopencl[pocl]"`',
    ("linux", ""): "install one with `apt install pocl-opencl-icd` (Debian, Ubuntu) or your distribution's PoCL",
    # Without Microsoft's C++ runtime, which not all machines have, Intel's driver fails as it makes a context.
    ("win32", "amd64"): "install one with `pip install intel-opencl-rt msvc-runtime`",
    # pip's pyopencl for macOS is linked with Apple's framework, which loads no other drivers.
    ("darwin", ""): "pip's pyopencl uses Apple's OpenCL alone; conda-forge's uses PoCL, too: "
                    "`conda install -c conda-forge pyopencl pocl`"}


def no_device(system: str = sys.platform, machine: str = platform.machine()) -> str:
    """The message, with its remedy."""
    driver = DRIVERS.get((system, machine.lower())) or DRIVERS.get((system, ""))
    gpu = "" if system == "darwin" else "the driver of your GPU from its vendor"
    return "no OpenCL device: " + (", or ".join(filter(None, (driver, gpu))) if driver else f"install {gpu}")
