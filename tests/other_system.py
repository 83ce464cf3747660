"""`clrt ARGUMENTS` as the Python of another system would meet its own modules: what os, signal and others lack there is
taken away once all libraries are loaded. A simulation: drivers, file names and processes stay.

Windows: Ctrl-Break has its signal, ctypes cannot load the process itself, and text that is opened without an encoding
is an error. macOS (darwin): sys.platform says so, there is no /proc, and the C library has nothing of glibc's own.

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

#: Of those that the standard library documents as available elsewhere alone; it needs some others itself here.
LACKS: dict[str, dict[Any, str]] = {
    "win32": {
        os: "chown fchmod fork forkpty getegid geteuid getgid getuid killpg mkfifo mknod nice O_DIRECT posix_fadvise "
            "pread pwrite register_at_fork sched_getaffinity sched_setaffinity setsid statvfs uname",
        signal: "SIGALRM SIGBUS SIGCHLD SIGCONT SIGHUP SIGPIPE SIGQUIT SIGSTOP SIGTSTP SIGUSR1 SIGUSR2 SIG_BLOCK "
                "SIG_SETMASK SIG_UNBLOCK alarm pthread_kill pthread_sigmask setitimer sigtimedwait sigwait",
        mmap: "MADV_HUGEPAGE"},
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
        time: "CLOCK_BOOTTIME CLOCK_TAI pthread_getcpuclockid"}}
MODULES = {"win32": ("fcntl", "grp", "pwd", "resource", "termios"), "darwin": ("spwd",)}
#: Functions that the C library lacks.
C_LACKS = {"win32": "", "darwin": "mallopt malloc_trim prctl sched_getaffinity"}


def become(system: str) -> None:
    """Takes away what is not there."""
    if system == "win32":
        setattr(signal, "SIGBREAK", signal.SIGUSR2)     # which is there alone
    for module, names in LACKS[system].items():
        for name in names.split():
            if hasattr(module, name):
                delattr(module, name)
    for name in MODULES[system]:
        sys.modules[name] = None    # type: ignore[assignment]
    _Library.lacks, _Library.nameless = set(C_LACKS[system].split()), system == "darwin"
    ctypes.CDLL = _Library    # type: ignore[misc]
    if system == "darwin":
        _forget_proc()
        multiprocessing.set_start_method("spawn")
        sys.platform = system


class _Library(ctypes.CDLL):
    """A library; nameless: that of the process itself can be had."""

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
    """Whatever is asked of /proc is not there."""
    def check(path: object) -> None:
        if isinstance(path, str | bytes | os.PathLike) and os.fsdecode(path).startswith("/proc"):
            raise FileNotFoundError(2, "No such file or directory", path)

    stat = os.stat

    def checked_stat(path: Any, **options: Any) -> os.stat_result:
        check(path)
        return stat(path, **options)

    os.stat = checked_stat
    # "open" is both open's and os.open's.
    sys.addaudithook(lambda event, given: check(given[0]) if event in ("open", "os.listdir", "os.scandir") else None)


if __name__ == "__main__":
    sys.path[0] = str(Path(__file__).parents[1])
    system, *arguments = sys.argv[1:]
    become(system)
    warnings.filterwarnings("error", category=EncodingWarning, module="clrt")
    from clrt.__main__ import main

    sys.argv = ["clrt", *arguments]
    main()
