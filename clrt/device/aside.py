"""PoCL's front end in a process of its own: what it takes of memory, it gives back only when a process ends, or all of
its contexts do.

Those are 90 MB and more, which would stay beside a large model for as long as that is rendered. What the other process
makes is put where PoCL keeps its programs, so this one finds it there and has kernels to compile, but no source.
"""

from __future__ import annotations

import atexit
import json
import subprocess
import sys
import tempfile
import warnings
from contextlib import suppress
from functools import partial

import pyopencl as cl

from .child import end_child, start_child
from .heap import give_back
from .open import open_device

#: From so many bytes on data count as large.
LARGE = 1 << 25


def compile_aside(device_id: str, source: str, options: list[str], seconds: float) -> None:
    """Takes so long at most. Whatever goes wrong there will go wrong here, too, where it is told."""
    give_back()     # what packing the data left, as both processes are there for a while
    with suppress(OSError), tempfile.TemporaryFile() as given:
        given.write(json.dumps([source, options]).encode())
        given.seek(0)
        child = start_child(__name__, device_id, subprocess.DEVNULL, subprocess.DEVNULL, given=given)
        end = partial(end_child, child)
        atexit.register(end)    # this process may end meanwhile
        try:
            with suppress(subprocess.TimeoutExpired):
                child.wait(seconds)
        finally:
            end()
            atexit.unregister(end)


def quietly_built(program: cl.Program, options: list[str]) -> cl.Program:
    """The program, built. pyopencl warns of whatever a compiler says, and Intel's always says something."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cl.CompilerWarning)
        program.build(options=options, cache_dir=False)  # type: ignore[arg-type]  # False: pyopencl's own cache off
    return program


def main() -> None:
    """Compiles what is on standard input for the device whose id is the first argument."""
    device = open_device(sys.argv[1])
    source, options = json.load(sys.stdin)
    quietly_built(cl.Program(device.context, source), options)


if __name__ == "__main__":
    main()
