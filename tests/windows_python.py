"""Runs `clrt ARGUMENTS` with the gaps of Python on Windows: names that os, signal and mmap lack there are removed
once all libraries are loaded, SIGBREAK exists, ctypes cannot load the process itself, and opening text without an
encoding is an error. Drivers, paths and processes are not simulated.

usage: python -X warn_default_encoding -m tests.windows_python ARGUMENTS
"""

from __future__ import annotations

import concurrent.futures  # noqa: F401
import ctypes
import importlib.metadata
import importlib.resources  # noqa: F401
import logging.handlers  # noqa: F401
import mmap
import multiprocessing.connection  # noqa: F401
import os
import shutil  # noqa: F401
import signal
import subprocess  # noqa: F401
import sys
import tempfile  # noqa: F401
import warnings
from typing import Any

import click  # noqa: F401
import numpy  # noqa: F401
import OpenImageIO  # noqa: F401
import platformdirs  # noqa: F401
import pydantic  # noqa: F401
import pyopencl.array  # noqa: F401

#: A part of what the standard library documents as available on Unix only; subprocess needs some others here.
LACKS = {
    os: "chown fchmod fork forkpty getegid geteuid getgid getuid killpg mkfifo mknod nice O_DIRECT posix_fadvise pread "
        "pwrite register_at_fork sched_getaffinity sched_setaffinity setsid statvfs uname",
    signal: "SIGALRM SIGBUS SIGCHLD SIGCONT SIGHUP SIGPIPE SIGQUIT SIGSTOP SIGTSTP SIGUSR1 SIGUSR2 SIG_BLOCK "
            "SIG_SETMASK SIG_UNBLOCK alarm pthread_kill pthread_sigmask setitimer sigtimedwait sigwait",
    mmap: "MADV_HUGEPAGE"}
MODULES = ("fcntl", "grp", "pwd", "resource", "termios")


def take_away() -> None:
    """Remove what Windows lacks, and add SIGBREAK, which exists only there, as SIGUSR2."""
    setattr(signal, "SIGBREAK", signal.SIGUSR2)
    for module, names in LACKS.items():
        for name in names.split():
            if hasattr(module, name):
                delattr(module, name)
    for name in MODULES:
        sys.modules[name] = None    # type: ignore[assignment]
    ctypes.CDLL = _Library    # type: ignore[misc]


class _Library(ctypes.CDLL):
    """Library loader that requires a name."""

    def __init__(self, name: str | None, *arguments: Any, **options: Any) -> None:
        if name is None:
            raise TypeError("LoadLibrary() argument 1 must be str, not None")
        super().__init__(name, *arguments, **options)


if __name__ == "__main__":
    take_away()
    warnings.filterwarnings("error", category=EncodingWarning, module="clrt")
    from clrt.__main__ import main

    sys.argv = ["clrt", *sys.argv[1:]]
    main()
