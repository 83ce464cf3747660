"""Results that cannot be written where they were asked for are kept elsewhere, as they took hours."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from ..errors import ClrtError

#: Where they are kept: in the first of these that they can be written to.
FOLDERS: tuple[Callable[[], Path], ...] = (Path.cwd, Path.home, lambda: Path(tempfile.gettempdir()))


def write_elsewhere(path: Path, write: Callable[[Path], object]) -> Path | None:
    """Write what was to be at `path` by `write` to another folder, under a name that is new there.

    Returns where it is; None where it could be written nowhere.
    """
    name = f"{path.stem}-{os.urandom(4).hex()}{path.suffix}"
    for folder in FOLDERS:
        with suppress(OSError, RuntimeError, ClrtError):     # there may be no such folder
            kept = folder() / name
            write(kept)
            return kept
    return None
