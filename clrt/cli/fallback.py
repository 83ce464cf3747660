"""Fallback locations for results that cannot be written where requested, as they may have taken hours."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from ..errors import ClrtError, KeptBesideError, OutputError

#: Fallback folders; the first writable one is used.
FOLDERS: tuple[Callable[[], Path], ...] = (Path.cwd, Path.home, lambda: Path(tempfile.gettempdir()))


def kept_elsewhere(error: OutputError, path: Path, write: Callable[[Path], object]) -> OutputError:
    """Write to a fallback location what `write` could not write to `path`, and return the error with that location."""
    if isinstance(error, KeptBesideError):
        return error
    kept = _write_elsewhere(path, write)
    return error if kept is None else type(error)(f"{error}; written to {kept} instead")


def _write_elsewhere(path: Path, write: Callable[[Path], object]) -> Path | None:
    """Return the path of the fallback file, whose name is unique; None if no folder is writable."""
    name = f"{path.stem}-{os.urandom(4).hex()}{path.suffix}"
    for folder in FOLDERS:
        with suppress(OSError, RuntimeError, ClrtError):  # the folder may not exist
            kept = folder() / name
            write(kept)
            return kept
    return None
