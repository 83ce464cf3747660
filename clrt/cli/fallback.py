"""Results that cannot be written where they were asked for are kept elsewhere, as they took hours."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from ..errors import ClrtError, KeptBesideError, OutputError

#: Where they are kept: in the first of these that they can be written to.
FOLDERS: tuple[Callable[[], Path], ...] = (Path.cwd, Path.home, lambda: Path(tempfile.gettempdir()))


def kept_elsewhere(error: OutputError, path: Path, write: Callable[[Path], object]) -> OutputError:
    """Write what could not be written to `path` by `write` elsewhere, and return the error with where it is."""
    if isinstance(error, KeptBesideError):
        return error
    kept = _write_elsewhere(path, write)
    return error if kept is None else type(error)(f"{error}; it was written to {kept}")


def _write_elsewhere(path: Path, write: Callable[[Path], object]) -> Path | None:
    """Where it is, under a name that is new there; None where it could be written nowhere."""
    name = f"{path.stem}-{os.urandom(4).hex()}{path.suffix}"
    for folder in FOLDERS:
        with suppress(OSError, RuntimeError, ClrtError):     # there may be no such folder
            kept = folder() / name
            write(kept)
            return kept
    return None
