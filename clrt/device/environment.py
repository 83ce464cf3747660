"""Redirect the OpenCL libraries' cache folders if the user's own are not writable.

PoCL offers no device, and pyopencl fails, if their cache folders cannot be created or have no room (no HOME, or a
read-only or full one). They read these variables when they are loaded, so this module is imported before pyopencl.
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

#: Linux's memory-backed file system, writable also in containers whose file system is read-only.
MEMORY = "/dev/shm"
#: Bytes for which a folder must have room: less than the programs of a render.
ROOM = 1 << 18


def provide_cache_folders() -> None:
    """Set XDG_CACHE_HOME and POCL_CACHE_DIR to a temporary folder where those that they name are not writable."""
    temporary = _temporary()
    home = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    programs = os.environ.get("POCL_CACHE_DIR")
    home_is_closed = not _writable(home)
    programs_are_closed = not _writable(programs) if programs else home_is_closed
    if not (home_is_closed or programs_are_closed):
        return
    folder = os.path.join(temporary, f"clrt-cache-{os.getuid() if hasattr(os, 'getuid') else 0}")
    if not _writable(folder):
        has_room = _writable(temporary) or not _writable(MEMORY)
        folder = tempfile.mkdtemp(prefix="clrt-cache-", dir=temporary if has_room else MEMORY)
    if home_is_closed:
        os.environ["XDG_CACHE_HOME"] = folder
    if programs_are_closed:
        os.environ["POCL_CACHE_DIR"] = os.path.join(folder, "pocl")


def _writable(folder: str) -> bool:
    """Return whether the folder exists or can be created, belongs to the user, and is writable.

    Without a home folder "~" is not expanded, so the path is not absolute.
    """
    try:
        if not os.path.isabs(folder):
            return False
        Path(folder).mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder, buffering=0) as file:
            if file.write(bytes(ROOM)) < ROOM:
                return False
            return not hasattr(os, "getuid") or os.stat(folder).st_uid == os.getuid()
    except (OSError, RuntimeError):
        return False


def _temporary() -> str:
    """Return the folder for temporary files, or one in memory if there is none."""
    try:
        return tempfile.gettempdir()
    except OSError:
        os.environ["TMPDIR"] = tempfile.tempdir = MEMORY    # for child processes, too
        return MEMORY


provide_cache_folders()
