"""Permissions of a file that is replaced, kept by the one that takes its place."""

from __future__ import annotations

import os
import stat
import sys
from contextlib import suppress
from pathlib import Path


def keep_mode(old: Path, new: Path) -> None:
    """Give `new` the mode of `old`, if that is there, and its owner and group where the user may set them."""
    try:
        before = old.stat()
    except OSError:
        return
    if sys.platform == "win32":    # access there is by the folder's rights, and a read-only file cannot be replaced
        return
    for owner, group in ((-1, before.st_gid), (before.st_uid, -1)):
        with suppress(PermissionError):
            os.chown(new, owner, group)
    mode, now = stat.S_IMODE(before.st_mode) & 0o777, new.stat()
    # Rights of a group are not given to another one.
    new.chmod(mode if now.st_gid == before.st_gid else mode & ~0o070)
