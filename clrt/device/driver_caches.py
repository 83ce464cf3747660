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
    own = f"clrt-cache-{os.getuid() if hasattr(os, 'getuid') else 0}"
    folder = next(filter(_writable, [os.path.join(temporary, own), os.path.join(MEMORY, own)]), None)
    if folder is None:
        try:  # another user took the names, or there is no room
            full = not _has_room(temporary) and _has_room(MEMORY)
            folder = tempfile.mkdtemp(prefix="clrt-cache-", dir=MEMORY if full else temporary)
        except OSError:
            return  # drivers fail, and `no_room` says why
    if home_is_closed:
        os.environ["XDG_CACHE_HOME"] = folder
    if programs_are_closed:
        os.environ["POCL_CACHE_DIR"] = os.path.join(folder, "pocl")


def no_room() -> str:
    """Return why drivers fail if no folder has room for the files that they write, or an empty string."""
    home = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    folders = dict.fromkeys([os.environ.get("POCL_CACHE_DIR") or home, _temporary(), MEMORY])
    if any(map(_has_room, folders)):
        return ""
    return (
        f"no file of {ROOM >> 10} kB can be written in {', '.join(folders)}, and drivers need such files; free "
        "some space, or name another folder with TMPDIR"
    )


def _writable(folder: str) -> bool:
    """Return whether the folder has room and belongs to the user."""
    return _has_room(folder) and (not hasattr(os, "getuid") or os.stat(folder).st_uid == os.getuid())


def _has_room(folder: str) -> bool:
    """Return whether the folder exists or can be created, and files of ROOM bytes can be written there.

    Without a home folder "~" is not expanded, so the path is not absolute.
    """
    try:
        if not os.path.isabs(folder):
            return False
        Path(folder).mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder, buffering=0) as file:
            return file.write(bytes(ROOM)) == ROOM
    except (OSError, RuntimeError):
        return False


def _temporary() -> str:
    """Return the folder for temporary files, or one in memory if there is none."""
    try:
        return tempfile.gettempdir()
    except OSError:
        os.environ["TMPDIR"] = tempfile.tempdir = MEMORY  # for child processes, too
        return MEMORY


provide_cache_folders()
