"""Runs `clrt ARGUMENTS` with the gaps of Python on another system: names that os, signal and others lack there are
removed once all libraries are loaded. Drivers, file names and processes are not simulated.

Windows: SIGBREAK exists, ctypes cannot load the process itself, and opening text without an encoding is an error.
macOS (darwin): sys.platform is "darwin", there is no /proc, and the C library lacks functions specific to glibc.

usage: python -X warn_default_encoding -m tests.other_system win32|darwin ARGUMENTS
"""

from __future__ import annotations

import concurrent.futures  # noqa: F401
import ctypes
import fcntl
import importlib.metadata
import importlib.resources  # noqa: F401
import logging.handlers  # noqa: F401
import mmap
import multiprocessing.connection
import os
import resource
import shutil  # noqa: F401
import signal
import subprocess  # noqa: F401
import sys
import tempfile  # noqa: F401
import time
import warnings
from pathlib import Path
from typing import Any

import click  # noqa: F401
import numpy  # noqa: F401
import OpenImageIO  # noqa: F401
import platformdirs  # noqa: F401
import pydantic  # noqa: F401
import pyopencl.array  # noqa: F401

#: A part of what the standard library documents as unavailable there; it needs some others itself on Linux.
LACKS: dict[str, dict[Any, str]] = {
    "win32": {
        os: "chown fchmod fork forkpty getegid geteuid getgid getuid killpg mkfifo mknod nice O_DIRECT posix_fadvise "
        "pread pwrite register_at_fork sched_getaffinity sched_setaffinity setsid statvfs uname",
        signal: "SIGALRM SIGBUS SIGCHLD SIGCONT SIGHUP SIGPIPE SIGQUIT SIGSTOP SIGTSTP SIGUSR1 SIGUSR2 SIG_BLOCK "
        "SIG_SETMASK SIG_UNBLOCK alarm pthread_kill pthread_sigmask setitimer sigtimedwait sigwait",
        mmap: "MADV_HUGEPAGE",
    },
    "darwin": {
        os: "O_DIRECT O_LARGEFILE O_NOATIME O_PATH O_RSYNC copy_file_range eventfd fdatasync getrandom getresgid "
        "getresuid memfd_create pidfd_open pipe2 posix_fadvise posix_fallocate sched_getaffinity sched_getparam "
        "sched_getscheduler sched_setaffinity sched_setparam sched_setscheduler setresgid setresuid splice waitid",
        signal: "SIGCLD SIGPOLL SIGPWR SIGRTMAX SIGRTMIN SIGSTKFLT sigtimedwait sigwaitinfo",
        mmap: "MADV_DODUMP MADV_DOFORK MADV_DONTDUMP MADV_DONTFORK MADV_HUGEPAGE MADV_HWPOISON MADV_MERGEABLE "
        "MADV_NOHUGEPAGE MADV_REMOVE MADV_UNMERGEABLE MAP_DENYWRITE MAP_EXECUTABLE MAP_POPULATE",
        fcntl: "F_ADD_SEALS F_GETLEASE F_GETPIPE_SZ F_GET_SEALS F_NOTIFY F_OFD_GETLK F_OFD_SETLK F_OFD_SETLKW "
        "F_SETLEASE F_SETPIPE_SZ",
        resource: "RLIMIT_MSGQUEUE RLIMIT_NICE RLIMIT_OFILE RLIMIT_RTPRIO RLIMIT_RTTIME RLIMIT_SIGPENDING "
        "RUSAGE_THREAD prlimit",
        time: "CLOCK_BOOTTIME CLOCK_TAI pthread_getcpuclockid",
    },
}
MODULES = {"win32": ("fcntl", "grp", "pwd", "resource", "termios"), "darwin": ("spwd",)}
#: Functions that the C library lacks.
C_LACKS = {"win32": "", "darwin": "mallopt malloc_trim prctl sched_getaffinity"}


def become(system: str) -> None:
    """Remove what the system lacks; on Windows, add SIGBREAK as SIGUSR2."""
    if system == "win32":
        setattr(signal, "SIGBREAK", signal.SIGUSR2)  # exists on Windows only
    for module, names in LACKS[system].items():
        for name in names.split():
            if hasattr(module, name):
                delattr(module, name)
    for name in MODULES[system]:
        sys.modules[name] = None  # type: ignore[assignment]
    _Library.lacks, _Library.nameless = set(C_LACKS[system].split()), system == "darwin"
    ctypes.CDLL = _Library  # type: ignore[misc]
    if system == "darwin":
        _forget_proc()
        multiprocessing.set_start_method("spawn")
        sys.platform = system


class _Library(ctypes.CDLL):
    """Library loader; `nameless`: whether the library of the process itself can be loaded."""

    lacks: set[str] = set()
    nameless = True

    def __init__(self, name: str | None, *arguments: Any, **options: Any) -> None:
        if name is None and not self.nameless:
            raise TypeError("LoadLibrary() argument 1 must be str, not None")
        super().__init__(name, *arguments, **options)

    def __getattr__(self, name: str) -> Any:
        if name in self.lacks:
            raise AttributeError(f"dlsym(RTLD_DEFAULT, {name}): symbol not found")
        return super().__getattr__(name)


def _forget_proc() -> None:
    """Make all accesses to /proc raise FileNotFoundError."""

    def check(path: object) -> None:
        if isinstance(path, str | bytes | os.PathLike) and os.fsdecode(path).startswith("/proc"):
            raise FileNotFoundError(2, "No such file or directory", path)

    stat = os.stat

    def checked_stat(path: Any, **options: Any) -> os.stat_result:
        check(path)
        return stat(path, **options)

    os.stat = checked_stat
    # The event "open" is raised by both open and os.open.
    sys.addaudithook(lambda event, given: check(given[0]) if event in ("open", "os.listdir", "os.scandir") else None)


if __name__ == "__main__":
    sys.path[0] = str(Path(__file__).parents[1])
    system, *arguments = sys.argv[1:]
    become(system)
    warnings.filterwarnings("error", category=EncodingWarning, module="clrt")
    from clrt.__main__ import main

    sys.argv = ["clrt", *arguments]
    main()
