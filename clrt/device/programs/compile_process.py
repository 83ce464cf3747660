"""Compile process: PoCL's front end run in a process of its own, which limits peak memory.

PoCL frees the memory of its front end (90 MB and more) only when a process, or all of its contexts, end; otherwise it
would stay allocated for as long as a large model is rendered. The compile process puts its result into PoCL's cache,
where this process finds it: kernels remain to be compiled, but no source.
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

from ..malloc_trim import give_back
from ..open import open_device
from .child_process import end_child, start_child

#: Data of at least this many bytes count as large.
LARGE = 1 << 25


def compile_aside(device_id: str, source: str, options: list[str], seconds: float) -> None:
    """Compile `source` in the compile process, within `seconds`. Errors are ignored: compiling here reports them."""
    give_back()  # packing's freed memory: both processes run at the same time for a while
    with suppress(OSError), tempfile.TemporaryFile() as given:
        given.write(json.dumps([source, options]).encode())
        given.seek(0)
        child = start_child(__name__, device_id, subprocess.DEVNULL, subprocess.DEVNULL, given=given)
        end = partial(end_child, child)
        atexit.register(end)  # this process may exit in the meantime
        try:
            with suppress(subprocess.TimeoutExpired):
                child.wait(seconds)
        finally:
            end()
            atexit.unregister(end)


def quietly_built(program: cl.Program, options: list[str]) -> cl.Program:
    """Build and return the program.

    pyopencl warns of any compiler output, and Intel's compiler always writes some, so its warnings are ignored.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cl.CompilerWarning)
        program.build(options=options, cache_dir=False)  # type: ignore[arg-type]  # False: pyopencl's own cache off
    return program


def main() -> None:
    """Compile the source and options on standard input for the device whose id is the first argument."""
    device = open_device(sys.argv[1])
    source, options = json.load(sys.stdin)
    quietly_built(cl.Program(device.context, source), options)


if __name__ == "__main__":
    main()
