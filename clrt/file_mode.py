"""Permissions of a replaced file, applied to its replacement."""

from __future__ import annotations

import os
import stat
import sys
from contextlib import suppress
from pathlib import Path


def keep_mode(old: Path, new: Path) -> None:
    """Give `new` the permission bits of `old`, if that exists, and its owner and group if the user may set them.

    Group bits are not granted to a different group. Does nothing on Windows and on file systems without modes.
    """
    if sys.platform == "win32":
        return
    with suppress(OSError):
        before = old.stat()
        for owner, group in ((-1, before.st_gid), (before.st_uid, -1)):
            with suppress(OSError):
                os.chown(new, owner, group)
        mode = stat.S_IMODE(before.st_mode) & 0o777
        new.chmod(mode if new.stat().st_gid == before.st_gid else mode & ~0o070)
